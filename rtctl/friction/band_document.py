"""The band in a model file: written, read, and refused where it is none."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from rtctl.friction.band import Band
from rtctl.friction.document import BandDocument


def body(band: Band | None) -> dict[str, Any]:
    """What a branch's document says of its band; nothing without one."""
    if band is None:
        return {}
    lists = {"edges_rad_s": list(band.edges_rad_s), "half_width_nm": list(band.half_width_nm)}
    return {"band": {**asdict(band), **lists}}


def part(document: BandDocument | None) -> Band | None:
    """The band of a branch's document."""
    if document is None:
        return None
    edges, widths = tuple(document.edges_rad_s), tuple(document.half_width_nm)
    return Band(edges, widths, document.way, document.units, document.errors, document.slowest_rad_s)


def refusal(band: Band | None) -> str:
    """Why this is no band; empty where it is one."""
    if band is None:
        return ""
    if len(band.half_width_nm) == len(band.edges_rad_s) + 1 and (np.diff(band.edges_rad_s) > 0).all():
        return ""
    return "needs edges that rise and one half width more than edges"
