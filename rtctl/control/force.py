"""Torque of the hand on the joint from force and moment of the tip: tare, then low-pass."""

from __future__ import annotations

from rtctl.control.jit import compiled, inlined
from rtctl.control.records import Record


@compiled
def restart_tare(s: Record, axis: int) -> None:
    """Begin averaging the bias again; the old tare stays in use until the new one is complete."""
    # the sum and its count alone: `tare` is what is in force
    s.tare_count[axis] = 0
    for i in range(6):
        s.tare_sum[axis, i] = 0.0


@compiled
def tare_done(s: Record, p: Record) -> bool:
    """True when every axis has averaged its `tare_ticks` samples."""
    for axis in range(len(s.tare_count)):
        if s.tare_count[axis] < p.tare_ticks[axis]:
            return False
    return True


@compiled
def _average(s: Record, p: Record, axis: int) -> bool:
    """Take a sample into the tare of an axis; True when that completes it."""
    s.tare_count[axis] += 1
    done = s.tare_count[axis] == p.tare_ticks[axis]  # equal, not at least: a tare is written once
    for i in range(6):
        # less the weight of that very pose: joints may stand differently from sample to sample
        s.tare_sum[axis, i] += s.wrench[i] - s.weight[i]
        if done:
            s.tare[axis, i] = s.tare_sum[axis, i] / s.tare_count[axis]
    return bool(done)


@inlined
def _tared(s: Record, p: Record, axis: int) -> float:
    """Torque on one joint of what is left of force and moment without weight and tare, N m."""
    longest = True
    for other in range(len(s.tare_count)):
        # the first axis of equals
        longest = longest and (p.tare_ticks[axis], -axis) >= (p.tare_ticks[other], -other)
    torque = 0.0
    for i in range(6):
        left = s.wrench[i] - s.weight[i] - s.tare[axis, i]
        torque += s.screw[axis, i] * left
        if longest:
            s.tared[i] = left
    return torque


@inlined
def hand_torque(s: Record, p: Record, axis: int, fresh: bool, disabled: bool) -> float:
    """Hand torque on the joint, tared and low-passed, N m (positive accelerates the joint).

    Averages the bias of all six components over the first `tare_ticks` fresh samples while the rig is
    disabled. A missed sample holds the last value. The axis with the longest tare writes `tared`.

    Notes
    -----
    tau_h = lever . (F - F_w - F_0) + direction . (M - M_w - M_0) (`wrench`);  y += alpha (tau_h - y)."""
    if not fresh:
        return s.force_filtered_nm[axis]
    # in power a hand is on it: an average of its pull would be taken for zero
    averaged = disabled and s.tare_count[axis] < p.tare_ticks[axis] and _average(s, p, axis)
    torque = _tared(s, p, axis)
    if averaged:
        s.force_filtered_nm[axis] = torque  # the low-pass begins at the new zero: no ring from the old
    s.force_filtered_nm[axis] += p.force_alpha[axis] * (torque - s.force_filtered_nm[axis])
    return s.force_filtered_nm[axis]
