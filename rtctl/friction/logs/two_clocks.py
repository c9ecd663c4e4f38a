"""Torque and position stamped by two clocks that differ so little that friction is nearly right: the delay of
the torque grows over the log (docs/theory.md 9.5)."""

from __future__ import annotations

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.logs.least_squares import Columns, solve
from rtctl.friction.logs.offsets import OffsetColumns
from rtctl.friction.logs.regressors import Regressors

GAINED_S = 2e-3
"""Least that one clock gains on the other over a log that is told."""

SURE = 5.0
"""Half widths of its interval by which that is not 0: in a sweep of frequencies a peak at rest, cogging or
friction by load looks like one clock that gains a few ms, by up to 4.4 of them."""


def two_clocks(signals: Regressors, columns: Columns, offset: OffsetColumns) -> str:
    """What is said of a log whose torque is the later, or the earlier, the longer it runs; "" where that is
    not sure.

    Notes
    -----
    A torque late by d_0 + g s, s from -1/2 at the first row to 1/2 at the last, has -d_0 J and -g J as the
    coefficients of the jerk and of s times the jerk. Of one frequency the jerk is the velocity, so friction
    that changes over the log has columns beside them."""
    # several logs: where each began is not where its clocks agreed
    if len(signals.sources) != 1:
        return ""
    along = signals.time_s - signals.time_s[0]
    # about the middle: the jerk's own coefficient is then the mean delay, and the two are hardly correlated
    along = along / max(float(along[-1]), 1e-12) - 0.5
    more = {
        "jerk": signals.jerk_rad_s3,
        "gained": along * signals.jerk_rad_s3,
        "viscous_more": along * signals.velocity_rad_s,
        "coulomb_more": along * signals.direction,
    }
    # two clocks without friction that changes would take a lubricant that warms up for a clock
    try:
        found = solve(signals, {**columns, **more}, offset, offset.drift).parameters
    except DataError:
        return ""
    inertia, gained = found["inertia_kgm2"].value, found["gained"]
    if not inertia > 0:
        return ""
    late_s, gained_s = -found["jerk"].value / inertia, -gained.value / inertia
    half_s = 0.5 * (gained.high - gained.low) / inertia
    if abs(gained_s) < max(GAINED_S, SURE * half_s):
        return ""
    first_s, last_s = late_s - 0.5 * gained_s, late_s + 0.5 * gained_s
    return (
        f"{signals.source}: torque and position look as if they were stamped by two clocks: the torque is "
        f"{1e3 * first_s:.1f} ms late against the position at the first row and {1e3 * last_s:.1f} ms at the "
        f"last (+- {1e3 * half_s:.1f} ms); viscous friction and inertia are then wrong: "
        f"{put_right(signals, first_s, last_s)}"
    )


def put_right(signals: Regressors, first_s: float, last_s: float) -> str:
    """The remedy of two clocks, delays at the first and the last row of a log, as a line of numpy."""
    rate = (last_s - first_s) / max(float(np.ptp(signals.time_s)), 1e-12)
    return (
        "stamp both by one clock, or put the torque column right, t in s: "
        f"torque = np.interp(t {first_s:+.4f} {rate:+.6f} * (t - t[0]), t, torque)"
    )
