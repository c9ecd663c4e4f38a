"""design"""

from __future__ import annotations

from rtctl.control.display import is_admittance
from rtctl.control.handle import own_rad
from rtctl.control.jit import inlined
from rtctl.control.records import Record
from rtctl.control.states import is_powered


@inlined
def unrung_share(t: Record, s: Record, p: Record, axis: int, elapsed: int) -> float:
    """Design."""
    d = p.design[axis]
    if d[0] == 0.0:
        return 1.0
    T = p.period_s
    v = t.velocity_rad_s[axis]
    s.ring_s[axis] += T
    if elapsed > 0:
        raw = (s.position_rad[axis] - s.position_before_rad[axis]) / (T * elapsed) - s.fed_rad_s[axis]
        helps = s.feedforward_applied_nm[axis] - s.ring_help_nm[axis]
        s.ring_help_nm[axis] += min(1.5 * p.rest_alpha[axis] * elapsed, 1.0) * helps
        s.ring_fed_j[axis] += (helps - d[13] * p.viscous_nms_rad[axis] * raw) * raw * T * elapsed
    way = -1.0 if s.ring_turned[axis] != 0.0 else 1.0
    on = (v - s.ring_rad_s[axis]) * way
    if on > 0.0:
        s.ring_rad_s[axis] = v
    elif on < -max(own_rad(p, axis, d[1]), 2.0 * p.count_rad[axis] / 0.01):
        swing = abs(s.ring_rad_s[axis] - s.ring_from_rad_s[axis])
        if s.ring_s[axis] <= d[2] and swing >= d[3] * s.ring_swing[axis]:
            s.ring_halves[axis] += 1.0
            s.rung_s[axis] += s.ring_s[axis]
        else:
            s.ring_halves[axis] = s.rung_s[axis] = s.ring_fed_j[axis] = 0.0
        s.ring_swing[axis], s.ring_from_rad_s[axis] = swing, s.ring_rad_s[axis]
        s.ring_rad_s[axis], s.ring_turned[axis], s.ring_s[axis] = v, 1.0 - s.ring_turned[axis], 0.0
    if s.ring_s[axis] > d[2] or not is_powered(s.state):
        s.ring_halves[axis] = s.rung_s[axis] = s.ring_fed_j[axis] = 0.0
    if not is_powered(s.state) or is_admittance(s, axis):
        s.ring_left[axis], s.ring_hold_s[axis], s.ring_wait_s[axis] = 1.0, 0.0, d[6]
        return 1.0
    if s.ring_halves[axis] >= d[4] and s.rung_s[axis] >= d[11] and s.ring_fed_j[axis] > d[14]:
        if s.ring_hold_s[axis] <= 0.0:
            s.ring_wait_s[axis] = min(2.0 * s.ring_wait_s[axis], d[7])
            s.ring_events[axis] += 1.0
        s.ring_hold_s[axis] = s.ring_wait_s[axis]
    elif s.ring_hold_s[axis] > 0.0:
        s.ring_hold_s[axis] -= T
    else:
        s.ring_wait_s[axis] = max(s.ring_wait_s[axis] - d[12] * T, d[6])
    step = -T / d[5] if s.ring_hold_s[axis] > 0.0 else T / d[8]
    s.ring_left[axis] = min(max(s.ring_left[axis] + step, d[9]), 1.0)
    return s.ring_left[axis]
