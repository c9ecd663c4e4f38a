"""Pictures without a display: an empty figure, and what becomes of it, a file or bytes."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rtctl.errors import DataError
from rtctl.whole_files import whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Metadata = Mapping[str, str | None]


def blank(width: float, height: float, facecolor: str | None = None) -> Figure:
    """An empty figure of this size, inches."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained", facecolor=facecolor)
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, path: str | Path, metadata: Metadata | None = None) -> None:
    """Write a PNG, PDF, SVG or JPEG file, by its ending; it is whole once it is there. Raises DataError."""
    path = Path(path)
    with whole(path) as new:
        try:
            figure.savefig(new, dpi=120, format=path.suffix.removeprefix("."), metadata=metadata)
        except ValueError as error:
            raise DataError(f"{path}: cannot write the plot: {error}; choose another path, .png") from error


def png(figure: Figure, metadata: Metadata | None = None) -> bytes:
    """The bytes of a PNG."""
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=100, metadata=metadata)
    return out.getvalue()
