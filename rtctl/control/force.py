"""Torque of the hand on the joint from the tip force: tare, then low-pass."""

from __future__ import annotations

from rtctl.control.jit import compiled
from rtctl.control.records import Record


@compiled
def restart_tare(s: Record, axis: int) -> None:
    """Begin averaging the bias again; the old tare stays in use until the new one is complete."""
    s.tare_count[axis] = 0
    s.tare_sum_nm[axis] = 0.0


@compiled
def tare_done(s: Record, p: Record) -> bool:
    """True when every axis has averaged its `tare_ticks` samples."""
    for axis in range(len(s.tare_count)):
        if s.tare_count[axis] < p.tare_ticks[axis]:
            return False
    return True


@compiled
def hand_torque(s: Record, p: Record, axis: int, fresh: bool, disabled: bool) -> float:
    """Hand torque on the joint, tared and low-passed, N m (positive accelerates the joint).

    Averages the bias over the first `tare_ticks` fresh samples while the rig is disabled. A missed
    sample holds the last value.

    Notes
    -----
    tau_h = lever . f - tare;  y += alpha (tau_h - y).
    """
    raw = s.force_raw_nm[axis]
    if not fresh:
        return s.force_filtered_nm[axis]
    if disabled and s.tare_count[axis] < p.tare_ticks[axis]:
        s.tare_sum_nm[axis] += raw
        s.tare_count[axis] += 1
        if s.tare_count[axis] == p.tare_ticks[axis]:
            s.tare_nm[axis] = s.tare_sum_nm[axis] / s.tare_count[axis]
            s.force_filtered_nm[axis] = raw - s.tare_nm[axis]
    s.force_filtered_nm[axis] += p.force_alpha[axis] * (raw - s.tare_nm[axis] - s.force_filtered_nm[axis])
    return s.force_filtered_nm[axis]
