"""The velocity that a device measures: held against the encoder before anything uses it.

The device's velocity d, summed up, must give the encoder's travel. With T the period, W = WINDOW_TICKS, dx
the travel since the last valid sample, m ticks ago, their difference is forgotten exponentially:

    r <- (1 - 1/W)^m r + m T d - dx

A device whose velocity is off by at most e, late by at most D, on a joint that accelerates with at most a,
whose encoder truncates to one count, has |r| <= W T (e + a (D + m T / 2)) + 1 count, whatever the motion: the
differences of the truncation telescope, the rest is a geometric series. So a sample is plausible when
|d| <= 1.5 v_max and |r| <= W T tolerance + SLACK_COUNTS counts, and with a tolerance of e + a (D + m T / 2)
it never trips. A steady error of twice what is allowed is found in W ln 2 = 11 ticks, and is a
fault at the third sample in a row.

What is used lies within the tolerance of the encoder's estimate in every tick, and the feed-forward never
gives more than at the encoder's. Gate, over-speed rule and passivity observer look at the encoder's alone."""

from __future__ import annotations

from rtctl.control.jit import compiled
from rtctl.control.records import Record
from rtctl.control.sample import JUMP_FACTOR
from rtctl.control.vocabulary import DeviceVelocity, Fault

_RECORD = int(DeviceVelocity.RECORD)
_USE = int(DeviceVelocity.USE)
_F_VELOCITY = int(Fault.VELOCITY)

WINDOW_TICKS = 16
"""Over about so many ticks the device's velocity is summed up."""

SLACK_COUNTS = 2.0
"""Encoder counts by which the sum may be off besides the tolerance: one of truncation, one of rounding."""


@compiled
def device_velocity(t: Record, s: Record, p: Record, axis: int, elapsed: int, dx: float) -> tuple[float, int]:
    """Judge this tick's device velocity; what the friction feed-forward takes as velocity.

    Parameters
    ----------
    t : record
        `velocity_rad_s` holds the encoder's estimate of this tick already.
    elapsed : int
        Grid ticks since the last valid sample; 0 on a missed one, whose velocity is worth nothing either.
    dx : float
        Travel of the encoder since then, rad.

    Returns
    -------
    velocity : float
        rad/s: the device's, no further than the tolerance from the encoder's, or the encoder's own where the
        device's is not used, missed or implausible.
    faults : int
        VELOCITY while `stale_limit_ticks` samples in a row were implausible."""
    encoder = t.velocity_rad_s[axis]
    # not even judged: its fault would stop a rig that does not use it
    if p.device_velocity_kind[axis] == _RECORD:
        return encoder, 0
    velocity, tolerance = encoder, p.device_tolerance_rad_s[axis]
    if elapsed > 0:
        device = t.device_velocity_rad_s[axis]
        if _plausible(s, p, axis, elapsed, dx, device):
            s.device_doubt_ticks[axis] = 0
            if p.device_velocity_kind[axis] == _USE:
                # plausible on the mean is not near in every tick
                velocity = min(max(device, encoder - tolerance), encoder + tolerance)
        else:
            s.device_doubt_ticks[axis] += 1
    return velocity, _F_VELOCITY if s.device_doubt_ticks[axis] >= p.stale_limit_ticks else 0


@compiled
def _plausible(s: Record, p: Record, axis: int, elapsed: int, dx: float, device: float) -> bool:
    """Advance the sum and compare; comparisons are false for NaN. What is out of range is not summed up."""
    begins = s.history_count[axis] <= 1  # the encoder too: no travel is known to hold the velocity against
    if begins:
        s.device_gap_rad[axis] = 0.0
    if not abs(device) <= JUMP_FACTOR * p.velocity_limit_rad_s[axis]:
        return False
    if begins:
        return True
    keep = (1.0 - 1.0 / WINDOW_TICKS) ** elapsed  # by time, not by samples: missed ones forget as fast
    s.device_gap_rad[axis] = keep * s.device_gap_rad[axis] + elapsed * p.period_s * device - dx
    allowed = WINDOW_TICKS * p.period_s * p.device_tolerance_rad_s[axis] + SLACK_COUNTS * p.count_rad[axis]
    return abs(s.device_gap_rad[axis]) <= allowed
