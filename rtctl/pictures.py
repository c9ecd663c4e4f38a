"""Pictures without a display: an empty figure, and what becomes of it, a file or bytes."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rtctl.errors import DataError

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
    """Write a PNG, PDF or SVG file, by its ending. Raises DataError."""
    try:
        figure.savefig(path, dpi=120, metadata=metadata)
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot write the plot: {error}; choose another path, .png") from error


def save_whole(figure: Figure, path: Path) -> None:
    """Write a PNG that is whole once it is there. Raises OSError."""
    part = path.with_name(path.name + ".part")
    figure.savefig(part, format="png", dpi=110)
    part.replace(path)


def png(figure: Figure, metadata: Metadata | None = None) -> bytes:
    """The bytes of a PNG."""
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=100, metadata=metadata)
    return out.getvalue()
