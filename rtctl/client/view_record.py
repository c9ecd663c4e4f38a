"""What the page's record button saves: every tick of the signals shown, as CSV with the column names of
`rtctl export`."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from hw.motion import name as own_name
from rtctl.client.view_feed import Signal
from rtctl.tick import FIELD

ALWAYS = ("tick", "time_ns")
"""The first columns, whatever is shown: a gap in `tick` is a tick that is missing."""


def head(signals: Sequence[Signal], hello: Mapping[str, Any]) -> str:
    """The line of names: `field`, `field.axis` or `field.x`."""
    parts = {"scalar": [], "axis": [axis["name"] for axis in hello["axes"]], "xyz": ["x", "y", "z"]}
    motions, names = [axis.get("motion", "rotary") for axis in hello["axes"]], []
    for signal in signals:
        shape = FIELD[signal.field].shape
        of, field = parts[shape], signal.field
        if signal.index < len(of):  # else the rig has no such axis, and the column stays empty
            field = own_name(field, motions[signal.index]) if shape == "axis" else field
            field = f"{field}.{of[signal.index]}"
        names.append(field)
    return _lines([[*ALWAYS, *names]])


def body(rows: np.ndarray, signals: Sequence[Signal]) -> str:
    """A line for each of these ticks; empty where a value is not finite."""
    return _lines(
        zip(*(Signal(name, 0).of(rows) for name in ALWAYS), *(s.of(rows) for s in signals), strict=True)
    )


def _lines(table: Iterable[Iterable[Any]]) -> str:
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(table)
    return out.getvalue()
