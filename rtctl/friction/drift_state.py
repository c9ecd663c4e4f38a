"""What is remembered of the friction from one run to the next (`rtctl.state_file`).

What was kept of another model or another inertia says nothing of this rig."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rtctl import state_file
from rtctl.friction.drift_strokes import PIECE_ROWS, ROWS_MIN, STROKES, SUMS, unpacked
from rtctl.friction.drift_watch import AxisWatch

NAME = "friction-drift.json"
MOST_BYTES = 8_000_000
"""Eight axes with all their strokes have a fifth of it."""

_MOST_SESSIONS = 1e9
_MOST_SUM = 1e15


def packed(axis: AxisWatch) -> dict[str, Any]:
    """What is to be kept of one axis."""
    return {
        "identity": axis.by.identity,
        "warned": bool(axis.warning),
        "factor": axis.factor,
        "strokes": np.ascontiguousarray(axis.strokes.table),
    }


def write(folder: Path, devices: str, axes: Mapping[str, Mapping[str, Any]]) -> None:
    """Keep the axes, by their names; `devices` is the checksum of the rig's devices. Raises OSError."""
    state_file.write(folder / NAME, devices, axes)


def read(folder: Path, devices: str) -> dict[str, Any]:
    """What was kept, by the name of the axis; nothing from a file that is missing, damaged or of other
    devices."""
    return state_file.read(folder / NAME, devices, MOST_BYTES)


def restore(axis: AxisWatch, kept: object) -> bool:
    """Take up what was kept of this axis, as of earlier sessions; False where it is not of this axis or no
    such thing."""
    # a file may be damaged or somebody's: everything in it is asked for its type
    if not isinstance(kept, dict) or kept.get("identity") != axis.by.identity:
        return False
    strokes = kept.get("strokes")
    table = np.zeros((0, SUMS)) if strokes == [] else _table(strokes)  # none kept: [] has one dimension
    if table is None:
        return False
    axis.take_up(table, warned=kept.get("warned") is True, factor=_factor(kept.get("factor")))
    return True


def _factor(kept: object) -> float:
    """The factor that the feed-forward went by; 1, as learned, unless a number was kept."""
    # its bounds are those of the rig file as it is now: `take_up` holds it to them
    return kept if isinstance(kept, float) and math.isfinite(kept) else 1.0


def _table(rows: object) -> np.ndarray | None:
    """The strokes, or None unless every number is there and can be one."""
    try:
        table = np.array(rows, dtype=float)
    except (TypeError, ValueError):
        return None
    if table.ndim != 2 or table.shape[1] != SUMS or not 0 < len(table) <= STROKES:
        return None
    session, count, trust = table[:, :3].T
    squares, _, _ = unpacked(table)
    sound = (
        (np.abs(table) <= _MOST_SUM).all()
        and (session >= 0).all()
        and (np.diff(session) >= 0).all()
        and (session <= _MOST_SESSIONS).all()
        # a piece more on one that was nearly full
        and ((count >= ROWS_MIN) & (count <= 2 * PIECE_ROWS)).all()
        # a sum of shares: rounding may make it more than their number
        and ((trust >= 0) & (trust <= count * (1 + 1e-9))).all()
        and (squares == squares.transpose(0, 2, 1)).all()  # Z'Z is, to the last digit
        # sums of squares of real rows are positive: a least squares of others could say anything
        and (np.linalg.eigvalsh(squares) >= -1e-9 * np.trace(squares, axis1=1, axis2=2)[:, None]).all()
    )
    return table if sound else None
