"""What the force sensor's own electronics make of the hand's torque before it is shown: a low-pass, and whole
periods of delay."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hw.interface import Options
from hw.simulators.jit import compiled

FORCE_LINE = 17
"""Length of the line of what has not been shown yet: delays of 0 to 16 periods."""


def force_filter_fields() -> list[tuple[Any, ...]]:
    """Fields of the parameters."""
    return [
        ("force_kept", "<f8"),  # of what the low-pass shows, after one period; 0: none
        ("force_delay_ticks", "<i8"),
    ]


def force_filter_state_fields(n_axes: int) -> list[tuple[Any, ...]]:
    """Fields of the state."""
    return [
        ("force_line_nm", "<f8", (n_axes, FORCE_LINE)),  # behind the low-pass, [axis, 0] newest
        ("force_before_nm", "<f8", (n_axes,)),  # and before it, a period ago
    ]


def fill_force_filter(p: np.void, table: Options, period_s: float) -> None:
    """Write what [device.options.force] says of it into the parameters."""
    cut = 2 * math.pi * table["lowpass_hz"] * period_s
    p["force_kept"], p["force_delay_ticks"] = math.exp(-cut) if cut > 0 else 0.0, table["delay_ticks"]


@compiled
def advance_force(s: np.record, p: np.record, periods: int) -> None:
    """Put the hand's torque at the end of so many periods through the sensor's low-pass and into the line of
    what it shows late.

    Exact for a torque that runs straight over them: with e = exp(-w T), T all of their time, that is
    f <- e f + (1 - a) now + (a - e) before, a = (1 - e)/(w T)."""
    kept = p.force_kept
    if kept == 0.0 and p.force_delay_ticks == 0:
        return
    if periods > 1:
        kept = kept**periods
    ahead = (1.0 - kept) / -math.log(kept) if kept > 0.0 else 0.0
    for axis in range(len(s.hand_torque_nm)):
        line, now = s.force_line_nm[axis], s.hand_torque_nm[axis]
        shown = kept * line[0] + (1.0 - ahead) * now + (ahead - kept) * s.force_before_nm[axis]
        for k in range(p.force_delay_ticks, 0, -1):
            line[k] = line[k - 1]
        # the line is moved first: with no delay place 0 is what is shown now
        line[0], s.force_before_nm[axis] = shown, now


@compiled
def shown_torque(s: np.record, p: np.record, axis: int) -> float:
    """The hand's torque on an axis as the sensor shows it now, N m."""
    late = p.force_delay_ticks
    if p.force_kept > 0.0 or late > 0:
        return float(s.force_line_nm[axis, late])
    return float(s.hand_torque_nm[axis])
