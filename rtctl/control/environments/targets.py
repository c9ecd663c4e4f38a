"""A remote proxy follows the targets of its renderer as far as is paid for.

A remote proxy is moved by a program with bodies of its own: an active hand by nature, which may know the
state and always be ahead of the motion. Its work on the coupling is exact as well and paid from the same
store; what is not paid for is not done, and (1) of `changes` holds. The proxy then lags behind its target
instead of running the port into a deficit. It is never put further ahead than U = L^2/(2 k_c), beyond which
nobody feels it. The rest of (2) is not asked of it: it would have to stay behind any joint that moves; there
the account bounds the torque (`take_back`)."""

from __future__ import annotations

from hw.jit import compiled
from hw.record_fields import Record
from rtctl.control.environments.changes import HALVINGS, pay, towards


@compiled
def follow_target(s: Record, p: Record, axis: int, difference: float) -> float:
    """Move a remote proxy towards the renderer's target, as far as is paid; the velocity its damper follows,
    rad/s.

    Notes
    -----
    The target is extrapolated no further than `target_hold_ticks`; the proxy moves at most v_max T a tick,
    and the damper follows the target's velocity up to v_max. Such a target is an active hand by nature, which
    may always be ahead of the joint: its work on the coupling's spring and through the coupling's damper is
    paid, one after the other, and what the store does not pay for is not done. The proxy then lags behind its
    target. It rests until the first target since the environment became remote: what was sent before was
    meant for another world."""
    if s.target_age_ticks >= s.remote_ticks:  # sent before the world was remote
        return 0.0
    # extrapolated, or a renderer of 60 Hz would move its proxy in jumps of 16 ticks
    age = min(s.target_age_ticks, p.target_hold_ticks)  # a silent renderer's proxy stops where HOLD begins
    velocity = s.target_velocity_rad_s[axis]
    target = s.target_position_rad[axis] + velocity * p.period_s * age
    before = s.proxy_position_rad[axis]
    step = towards(before, target, p.velocity_limit_rad_s[axis] * p.period_s) - before
    for _ in range(HALVINGS):
        if step == 0.0 or _move_proxy(s, p, axis, before + step):
            break
        step *= 0.5
    if s.target_age_ticks > p.target_hold_ticks:  # its velocity is not believed then
        return 0.0
    # no quicker than the joint may be: the damper would pull with b_c times whatever a program writes
    velocity = towards(0.0, velocity, p.velocity_limit_rad_s[axis])
    for _ in range(HALVINGS):
        if _pull_damper(s, p, axis, velocity, difference):
            return velocity
        velocity *= 0.5
    return 0.0


@compiled
def _move_proxy(s: Record, p: Record, axis: int, proxy: float) -> bool:
    """Set a remote proxy if the store allows, and no further ahead than the torque limit lets through; True
    when done."""
    k_c, x = p.coupling_stiffness_nm_rad[axis], s.position_rad[axis]
    stored = 0.5 * k_c * (x - proxy) ** 2
    work = stored - 0.5 * k_c * (x - s.proxy_position_rad[axis]) ** 2
    room = 0.5 * p.torque_limit_nm[axis] ** 2
    # what gives energy back is never refused
    if work > 0.0 and not (work <= s.renderer_store_j[axis] and k_c * stored <= room):
        return False
    s.proxy_position_rad[axis] = proxy
    pay(s, axis, work)
    return True


@compiled
def _pull_damper(s: Record, p: Record, axis: int, velocity: float, difference: float) -> bool:
    """Pay for the coupling's damper following `velocity` while the joint moves at `difference`; True when
    done."""
    # the renderer's work on its end of the damper; below 0 where it takes, which the store does not get
    work = -p.coupling_damping_nms_rad[axis] * (difference - velocity) * velocity * p.period_s
    if work > s.renderer_store_j[axis]:
        return False
    pay(s, axis, work)
    return True
