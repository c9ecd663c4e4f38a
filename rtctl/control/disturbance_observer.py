"""Friction as the force sensor sees it: disturbance observer, and the torque that compensates what it finds.

With u the torque that acts, tau_h the hand's, J the inertia and v the velocity, the joint's balance leaves

    F = u + tau_h - J dv/dt                               all that opposes the motion, positive along +v

which needs no friction model. Both sides pass the same two low-passes, one of the bandwidth w_q and one four
times as fast against the encoder's steps; the derivative is then w_q (v - LP v), never a difference of
differences. (Sampled it would be alpha/T (v - LP v), 6 % less at 20 Hz and 1 kHz: the inertia is taken that
much too high on purpose. With the exact one an elastic joint of 30 Hz keeps less than a quarter of its
damping, `observer_margin`.)

    Fhat = LP[u + tau_h] - J w_q (v - LP v) - b LP v      b: the viscous damping, which is left to the joint
    tau  = gain d(c Fhat - LP[tau_ff])                    c: 1, or a little less at rest; d: dead band

(docs/theory.md 6.1). With a learned
feed-forward tau_ff the observer adds what the feed-forward leaves; alone (policy `observer`) it does all.

v is the plain backward difference: half a period late, where a window that grows at low speed is as late as
it is long, and a late acceleration is a negative inertia that a stiff hand rings on.

For the same reason tau_h is the sample before: the difference of two mean velocities is the acceleration
between them, one period ago. The last sample alone is early; a stiff hand's -k_h x then leaves a false
friction k_h T v, which the low-passes turn into negative damping (`observer_margin`: on a slow drive unstable
from 15 Hz on in a hand of 600 N m/rad).

A sensor shows tau_h later still. So u and v are taken of `observer_late_ticks` before, and all that is added
up belongs to one instant: friction that is found a little later closes no loop in a hand, a hand's torque
beside a motion of another instant does. What the sensor may be quicker or later than that is damped by an
inertia that is taken higher by `observer_excess` (docs/theory.md 6.4).

A bias of the sensor is amplified by gain/(1 - gain) at rest: the dead band keeps a resting joint from
creeping as long as the bias is below it. `rtctl check` bounds gain and bandwidth by the eigenvalues of the
loop with every hand of a stated box; `assistance` bounds the energy.

While the joint slides (the bristles of `dry_friction` at their end) Fhat, low-passed once more, is remembered
for each direction as the friction seen."""

from __future__ import annotations

import math

from rtctl.control.display import is_admittance
from rtctl.control.dry_friction import slides
from rtctl.control.feedforward import range_fade
from rtctl.control.friction_curve import BACKWARD, FORWARD
from rtctl.control.handle import own_rad
from rtctl.control.jit import compiled, inlined
from rtctl.control.pace import GATE_TIMES, eased
from rtctl.control.records import HELD, Record
from rtctl.control.resting import held_part, is_resting, speed_seen, while_resting
from rtctl.control.vocabulary import Policy

_OFF = int(Policy.OFF)
_HYBRID = int(Policy.HYBRID)

SMOOTHING = 4.0
"""The second low-pass is this many times as fast as the first."""

TURNING_SHARE = 0.5
"""Share of the observer's torque that is sent while the bristles turn under a `hybrid` feed-forward."""

SLOW_SHARE, SLOW_RAD_S = 0.03, 0.03
"""Share of the friction that is left to a joint that hardly moves: what a bias of the force sensor must
overcome to make it creep."""

HELD_SHARE = 0.15
"""Besides, to one that has not moved on for long (`resting.held_part`): it would slip seconds after it came
to rest, helped ever more against a pull that stays."""

SLOW_HAND_RAD_S, SLOW_HAND_LEFT = 0.08, 0.5
"""Under a `hybrid` feed-forward a hand that is slower than that on the mean is left this share of the
observer's torque; it goes and comes as slowly as a gate."""

TARGET_AT_REST = 1.0 - SLOW_SHARE

LATE_MOST = HELD - 8
"""Most ticks by which torque and velocity are delayed: a motor's own delay must be remembered, too."""


@compiled
def _forget(s: Record, axis: int) -> None:
    """Empty the filters, so that a number that is not finite does not stay."""
    s.observer_torque_smooth_nm[axis] = s.observer_torque_nm[axis] = 0.0
    s.observer_velocity_smooth_rad_s[axis] = s.observer_velocity_rad_s[axis] = 0.0
    s.observer_forward_nm[axis] = 0.0
    s.friction_seen_nm[axis, FORWARD] = s.friction_seen_nm[axis, BACKWARD] = 0.0
    for k in range(HELD):
        s.observer_moved_rad_s[axis, k] = 0.0


@compiled
def _acting_torque(s: Record, p: Record, axis: int) -> float:
    """Torque that acted over the period before the force that is shown: sent one tick, the configured delay
    and the sensor's ago, N m."""
    # declared beyond the ring: the oldest
    late = min(max(p.actuator_delay_ticks[axis], 0) + _late(p, axis), HELD - 3)
    return float(s.held_nm[axis, (s.ticks - 1 - late) % HELD])


@compiled
def _late(p: Record, axis: int) -> int:
    """Ticks by which the observer's own signals are delayed."""
    return int(min(max(p.observer_late_ticks[axis], 0), LATE_MOST))


@inlined
def _velocity_then(t: Record, s: Record, p: Record, axis: int, elapsed: int) -> float:
    """Difference velocity of the instant that the force belongs to, rad/s; a sample that took several ticks
    counts for each of them."""
    velocity, late = t.velocity_difference_rad_s[axis], _late(p, axis)
    if late == 0:
        return float(velocity)
    for k in range(min(elapsed, HELD)):  # else the ring keeps what it had HELD ticks ago
        s.observer_moved_rad_s[axis, (s.ticks - k) % HELD] = velocity
    return float(s.observer_moved_rad_s[axis, (s.ticks - late) % HELD])


@compiled
def _over(alpha: float, ticks: int) -> float:
    """Coefficient of a low-pass over several ticks at once, from that of one."""
    return alpha if ticks == 1 else 1.0 - (1.0 - alpha) ** ticks


@inlined
def observe_friction(t: Record, s: Record, p: Record, axis: int, elapsed: int) -> None:
    """Write `friction_observed_nm` of the tick, N m along +v; NaN for a measurement that is not finite.

    Does nothing (0) on an axis whose `observer_alpha` is 0; holds on a missed sample (`elapsed` 0)."""
    if not p.observer_alpha[axis] > 0.0 or elapsed < 1:
        t.friction_observed_nm[axis] = s.friction_observed_nm[axis]
        return
    slow = _over(p.observer_alpha[axis], elapsed)
    quick = _over(p.observer_smooth_alpha[axis], elapsed)
    calm = _over(while_resting(s, p, axis, p.observer_smooth_alpha[axis]), elapsed)
    # of the sample before: `law._observe`, which writes it, runs later in the tick
    hand = s.hand_torque_before_nm[axis]
    torque = _acting_torque(s, p, axis) + hand
    velocity = _velocity_then(t, s, p, axis, elapsed)
    # there it is an edge of the encoder, worth J w_q Delta/t of torque (6.2)
    if is_resting(s, p, axis):
        velocity = 0.0
    s.observer_torque_smooth_nm[axis] += calm * (torque - s.observer_torque_smooth_nm[axis])
    s.observer_velocity_smooth_rad_s[axis] += quick * (velocity - s.observer_velocity_smooth_rad_s[axis])
    behind = s.observer_velocity_smooth_rad_s[axis] - s.observer_velocity_rad_s[axis]
    follow = _over(while_resting(s, p, axis, p.observer_alpha[axis]), elapsed)
    s.observer_torque_nm[axis] += follow * (s.observer_torque_smooth_nm[axis] - s.observer_torque_nm[axis])
    s.observer_velocity_rad_s[axis] += slow * behind
    inertia = p.inertia_kgm2[axis] * (1.0 + p.observer_excess[axis])
    friction = s.observer_torque_nm[axis] - inertia * p.observer_bandwidth_rad_s[axis] * behind
    # the viscous part is left to the joint: the coupling lives on it (5.2)
    friction -= p.viscous_nms_rad[axis] * s.observer_velocity_rad_s[axis]
    if not math.isfinite(friction + t.hand_torque_nm[axis]):  # or what the next tick will go by
        _forget(s, axis)
        friction = math.nan
    elif slides(s, axis):  # on bent bristles it is their spring, no friction
        forward = s.bristle_share[axis] > 0.0
        seen = friction if forward else -friction
        side = FORWARD if forward else BACKWARD
        share = _over(p.friction_seen_alpha[axis], elapsed)
        s.friction_seen_nm[axis, side] += share * (seen - s.friction_seen_nm[axis, side])
    # the tick tells NaN, the state keeps none
    s.friction_observed_nm[axis] = friction if friction == friction else 0.0
    t.friction_observed_nm[axis] = friction


@compiled
def _turning(s: Record, p: Record, axis: int) -> float:
    """Share of the observer's torque while the bristles turn, for a policy whose direction turns by itself.

    On a joint that sticks the friction observed is the torque that acts, so that the observer holds on to its
    own: it follows within its lag over 1 - gain, a tenth of a second, and held the joint back for as long at
    every turn. On a joint that rests the share stays what it was: as a function of the bristles it is a late
    spring, gain x torque over their length, and shook a carriage at 42 Hz."""
    if not is_resting(s, p, axis):
        s.observer_end[axis] = min(max(2.0 * abs(s.bristle_share[axis]) - 1.0, 0.0), 1.0)  # 0 up to half way
    return TURNING_SHARE + (1.0 - TURNING_SHARE) * s.observer_end[axis]


@compiled
def _paced(s: Record, p: Record, axis: int) -> float:
    """Share of the observer's torque in a hand of this pace, beside a feed-forward that gives most of the
    help.

    On a joint that sticks the observer is an integrator: what breaks it away falls to 1 - gain of the
    friction, and what friction loses as it lets go pushes the joint on for the lag of two low-passes. A slow
    hand meets that at each slip; with half of the observer it is not thrown, and mostly pulls no more."""
    wanted = SLOW_HAND_LEFT if s.pace_rad_s[axis] < own_rad(p, axis, SLOW_HAND_RAD_S) else 0.0
    s.observer_left[axis] = eased(p, axis, s.observer_left[axis], wanted, GATE_TIMES)
    return 1.0 - s.observer_left[axis]


@compiled
def _beside_a_mass(s: Record, p: Record, axis: int) -> float:
    """Share of the observer's torque that is left where a virtual mass is shown: none, gone through the
    low-pass of rest where the display changes.

    What acts on a joint that sticks the observer takes for friction, and adds to it: what the servo pulls
    with grows threefold, a tenth of a second late. That is an integrator, and an integrator hunts about dry
    friction: mass and joint leapt to and fro."""
    if is_admittance(s, axis):
        s.mass_helped_share[axis] -= p.rest_alpha[axis] * s.mass_helped_share[axis]
    else:
        s.mass_helped_share[axis] = 1.0
    return float(s.mass_helped_share[axis])


@inlined
def observer_torque(t: Record, s: Record, p: Record, model: Record, axis: int, elapsed: int) -> float:
    """Torque that compensates what the feed-forward leaves of the friction observed, N m; NaN stays NaN.

    Reads the feed-forward of the tick. With it, it keeps within `friction_cap_nm`, and beyond the trained
    range of a model it fades out as the feed-forward does."""
    if not p.observer_gain[axis] > 0.0 or p.friction_policy[axis] == _OFF:
        return 0.0
    forward = t.feedforward_torque_nm[axis]
    if elapsed > 0:
        # as slowly as the torque observed: their difference is what is sent
        follow = _over(while_resting(s, p, axis, p.observer_alpha[axis]), elapsed)
        s.observer_forward_nm[axis] += follow * (forward - s.observer_forward_nm[axis])
    slow = SLOW_SHARE + HELD_SHARE * held_part(s, p, axis)
    seen = speed_seen(s, p, axis, t.velocity_rad_s[axis])
    target = 1.0 - slow * math.exp(-((seen / own_rad(p, axis, SLOW_RAD_S)) ** 2))
    rest = target * t.friction_observed_nm[axis] - s.observer_forward_nm[axis]
    if not math.isfinite(rest):
        return math.nan
    beyond = max(abs(rest) - p.observer_deadband_nm[axis], 0.0)
    torque = t.compensation[axis] * p.observer_gain[axis] * math.copysign(beyond, rest)
    if p.friction_policy[axis] == _HYBRID:
        torque *= _turning(s, p, axis)
        torque *= _paced(s, p, axis)
    torque *= _beside_a_mass(s, p, axis)
    v = t.velocity_rad_s[axis]  # not `seen`: a joint beyond the range has no model, however calm it seems
    branch = FORWARD if v >= 0.0 else BACKWARD
    if model.n_segments[branch] > 0:
        torque *= range_fade(model, branch, abs(v))
    cap = p.friction_cap_nm[axis]
    return min(max(torque, -cap - forward), cap - forward)  # the cap is of both together
