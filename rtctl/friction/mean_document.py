"""The parts of a mean in a model file: written, and read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rtctl.friction.document import PartDocument
from rtctl.friction.kind_curve import Curve
from rtctl.friction.kind_table import MEAN

SHARES_OFF = 1e-9
"""Most that the shares together may differ from 1."""

Parts = tuple[tuple[float, Curve], ...]


def body(parts: Parts) -> dict[str, Any]:
    """What a branch's document says of its parts; nothing for a curve of one kind."""
    found = [
        {
            "share": share,
            "kind": curve.kind,
            "parameters": dict(curve.parameters),
            "intercept": curve.intercept,
            "support_vectors": curve.support_vectors.tolist(),
            "dual_coef": curve.dual_coef.tolist(),
        }
        for share, curve in parts
    ]
    return {"parts": found} if found else {}


def parts(documents: Sequence[PartDocument]) -> Parts:
    """The parts of a branch's document."""
    return tuple(
        (
            d.share,
            Curve(d.kind, d.parameters, np.array(d.support_vectors), np.array(d.dual_coef), d.intercept),
        )
        for d in documents
    )


def refusal(whole: Curve) -> str:
    """Why this is no mean, or no curve of one kind; empty where it is."""
    if whole.kind != MEAN.name:
        return f"a {whole.kind} curve has none" if whole.parts else ""
    if len(whole.support_vectors) or whole.intercept != 0:
        return "a mean has no support vectors and no intercept beside those of its parts"
    if len(whole.parts) < 2 or not abs(sum(share for share, _ in whole.parts) - 1) <= SHARES_OFF:
        return "a mean is of two curves or more, whose shares are 1 together"
    # parts have no parts in the file: a mean among them would be of nothing
    if any(part.kind == MEAN.name for _, part in whole.parts):
        return "a mean is not of means"
    return ""
