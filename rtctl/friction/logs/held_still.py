"""A joint that stands although more than its friction pushes it: a brake, an end stop, something in its
way."""

from __future__ import annotations

import numpy as np

from rtctl.friction.logs.balance import Balance
from rtctl.friction.logs.torque_faults import longest_run

STANDS_RAD_S = 0.01
"""Speed below which a joint stands, times what stands for a radian of the axis."""

PUSHED = 2.5
"""Torque on a joint that stands, in its Coulomb friction: break-away takes up to twice of it."""

STANDS_S = 0.3
"""Shortest stand that is told; a joint that turns stands shorter."""


def held_still(balance: Balance) -> tuple[str, ...]:
    """The warning that something held the joint; the rows where that began or ended may be in the
    parameters."""
    signals, fit = balance.signals, balance.fit()
    # no measure of a push without the friction that it has to overcome
    if not fit.coulomb > 0:
        return ()
    wanted = balance.motion @ np.array([fit.inertia, fit.viscous, fit.coulomb])
    torque_nm = signals.torque_nm - signals.place_nm
    # less the zero that the sliding rows of its log tell: an offset of the sensor pushes nothing
    left, logs = torque_nm[signals.sliding] - wanted, range(len(signals.sources))
    zeros = np.array([np.median(left[mine]) if (mine := balance.log == k).any() else 0.0 for k in logs])
    push = np.abs(torque_nm - zeros[signals.log])
    stands = np.abs(signals.velocity_rad_s) < STANDS_RAD_S * signals.radian
    held = stands & (push > PUSHED * fit.coulomb)
    # log by log: the end of one and the begin of the next are no stand
    runs = [longest_run(held & (signals.log == k)) for k in logs]
    begin, rows = max(runs, key=lambda run: run[1])
    # rows of the thinned signals: their step is that of the filter, not of the log
    stood_s = rows * float(np.median(np.diff(signals.time_s)))
    if stood_s < STANDS_S:
        return ()
    log = int(signals.log[begin])
    since_s = signals.time_s[begin] - signals.began_s(log)  # a person looks for it by the time of that file
    return (
        f"{signals.sources[log]}: the joint stands for {stood_s:.2g} s from {since_s:.4g} s on "
        f"although {float(push[begin : begin + rows].max()):.3g} N m push it, and it rubs by "
        f"{fit.coulomb:.3g} N m: a brake, an end stop or another torque holds it, and may be in the "
        "parameters; cut that part out, or map that torque",
    )
