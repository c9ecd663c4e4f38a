"""Friction feed-forward: how much, in which direction, and how far it may go (docs/theory.md 5.5).

tau_ff = compensation * f * g * s * min(magnitude, cap): s in -1..1 is the direction the policy decides near
zero velocity, g in 0..1 the force gate, f in 0..1 the share by which friction that has changed is followed
(`friction_factor`). v rad/s, tau_h hand torque N m."""
# longer than 300 lines: direction, gate and size of one torque, each with what it remembers

from __future__ import annotations

import math

from rtctl.control import compensation_limit as limits
from rtctl.control.display import is_admittance
from rtctl.control.dry_friction import slides
from rtctl.control.friction_curve import BACKWARD, FORWARD, branch_magnitude
from rtctl.control.friction_factor import followed_share
from rtctl.control.jit import compiled, inlined
from rtctl.control.load_friction import load_friction, load_gain
from rtctl.control.pace import GATE_TIMES, MEAN_TIMES, TURN_TIMES, eased, is_slow
from rtctl.control.place_friction import curve_and_place
from rtctl.control.place_trust import place_of, place_trust
from rtctl.control.records import Record
from rtctl.control.resting import calm_speed, is_bent, slides_on, speed_seen, while_bent
from rtctl.control.vocabulary import Fault, Policy

_OFF = int(Policy.OFF)
_HYBRID = int(Policy.HYBRID)
_SIGN = int(Policy.SIGN)
_DEADBAND = int(Policy.DEADBAND)
_TANH = int(Policy.TANH)
_DITHER = int(Policy.DITHER)
_INTENT = int(Policy.INTENT)
_STOP = int(Policy.STOP)
_STOP_GATED = int(Policy.STOP_GATED)
_OBSERVER = int(Policy.OBSERVER)
_LUGRE = int(Policy.LUGRE)
_F_LAW = int(Fault.LAW_NOT_FINITE)

_is_force_gated = compiled(limits.is_force_gated)
_cap_in_force = compiled(limits.cap_in_force)
_feedforward_limit = compiled(limits.feedforward_limit)


SLIDING_GATE = 0.5
"""On a joint that slides this share of `gate_nm` opens the gate: help that leaves the hand little would shut
it otherwise."""


@compiled
def saturate(x: float) -> float:
    """Limit to -1..1; NaN becomes 0, because a direction that is not known is no direction."""
    if x > 1.0:
        return 1.0
    if x < -1.0:
        return -1.0
    return x if x == x else 0.0  # NaN alone differs from itself


@compiled
def sign(v: float) -> float:
    """-1, 0 or 1."""
    return 1.0 if v > 0.0 else (-1.0 if v < 0.0 else 0.0)


@compiled
def blend(v: float, motion: float, rest: float, width: float) -> float:
    """(1 - w) motion + w rest with w = exp(-(v/width)^2)."""
    w = math.exp(-((v / width) ** 2))
    return (1.0 - w) * motion + w * rest


@compiled
def _intent(s: Record, p: Record, axis: int) -> float:
    """Direction that the hand, or the virtual mass, asks for, -1..1."""
    return saturate(s.friction_intent_nm[axis] / p.friction_intent_nm[axis])


@inlined
def friction_direction(s: Record, p: Record, axis: int, v: float, tick: int) -> float:
    """Direction s of the feed-forward by the configured policy, -1..1.

    Notes
    -----
    w = exp(-(v/v_b)^2). HYBRID: s = (1 - w) h + w sat(LP tau_h/tau_g), h the stop operator over the
    presliding length: where friction is a spring, sign and tanh of the velocity would drive a vibration. On
    bent bristles w is 1: their velocity, or an edge of the encoder, would turn the help to h and back.
    DITHER: s = (1 - w) tanh(v/v_0) + w times a square wave of `friction_dither_ticks`. Stop operator, LuGre
    bristles and the intent's low-pass are advanced by `advance_stop` and `advance_intent` on every tick,
    whatever the policy."""
    policy = p.friction_policy[axis]
    if policy == _HYBRID:
        # no blend: a bend is no motion (5.7)
        if is_bent(s, p, axis) and not is_admittance(s, axis):
            return _intent(s, p, axis)
        return blend(v, s.friction_stop[axis], _intent(s, p, axis), p.friction_blend_rad_s[axis])
    if policy == _SIGN:
        return sign(v)
    if policy == _DEADBAND:
        return sign(v) if abs(v) > p.friction_deadband_rad_s[axis] else 0.0
    if policy == _TANH:
        return math.tanh(v / p.friction_tanh_rad_s[axis])
    if policy == _DITHER:
        # one tick up and one down at least: of a single one there is no mean of 0
        ticks = max(p.friction_dither_ticks[axis], 2)
        wave = 1.0 if 2 * (tick % ticks) < ticks else -1.0
        return blend(v, math.tanh(v / p.friction_tanh_rad_s[axis]), wave, p.friction_blend_rad_s[axis])
    if policy == _INTENT:
        return _intent(s, p, axis)
    if policy in (_STOP, _STOP_GATED, _LUGRE):
        return s.friction_stop[axis]
    return 0.0


@compiled
def advance_stop(s: Record, p: Record, axis: int, dx: float) -> None:
    """Direction of motion over a presliding length x_d, rate independent.

    Notes
    -----
    Stop (play) operator s <- clip(s + dx/x_d, -1, 1). LUGRE: ds/dx = (1 - s sgn dx)/x_d, which is LuGre's
    bristle under the motion measured, z sigma0/g: s <- e + (s - e) exp(-|dx|/x_d), e = sgn dx."""
    length = p.friction_stop_rad[axis]
    if not length > 0.0:
        return
    if p.friction_policy[axis] == _LUGRE:
        end = sign(dx)
        # exact over any way: a step of Euler's overshoots where the way of a tick is longer than the bristle
        s.friction_stop[axis] = saturate(end + (s.friction_stop[axis] - end) * math.exp(-abs(dx) / length))
    else:
        s.friction_stop[axis] = saturate(s.friction_stop[axis] + dx / length)


@compiled
def wished_push(s: Record, p: Record, axis: int) -> float:
    """What the intent follows, N m: the hand's torque; under `hybrid` at rest that of hand and coupling, on a
    joint that slides its motion, tau_g at its end, and in a turn from there to that push as `blend`.

    With the push alone an intent that a ring had turned waited behind the motion: help stepped over to it as
    the ring's speed passed zero. With the hand's alone help held who leans on a world in it until the joint
    slid, then stepped by 2 F. Of a virtual mass the way it goes: one that leans stands, as its hand asked."""
    if is_admittance(s, axis):
        # as a torque, since what comes of it is divided by tau_g again: sat(LP v_r/v_b)
        return s.mass_velocity_rad_s[axis] / p.friction_blend_rad_s[axis] * p.friction_intent_nm[axis]
    if p.friction_policy[axis] != _HYBRID:
        return s.calm_hand_nm[axis]
    # what acts on the joint besides the help itself: hand and world together move it, or do not
    push = s.calm_hand_nm[axis] + s.calm_world_nm[axis]
    if is_bent(s, p, axis):
        return push
    way = s.friction_stop[axis] * p.friction_intent_nm[axis]  # +-tau_g at its end: all of the help, no more
    if slides_on(s, p, axis):
        return way
    return blend(s.velocity_rad_s[axis], way, push, p.friction_blend_rad_s[axis])


@compiled
def _led_by(s: Record, p: Record, axis: int, dx: float, v: float) -> tuple[float, float]:
    """Way, rad, and velocity, rad/s, that the direction goes by: the joint's, or those of the virtual mass
    that it follows.

    The mass is moved by the hand alone. So friction, whose own vibration the joint's velocity is full of near
    standstill, has no way into the direction, and the help turns as early as the mass does instead of a
    servo's lag later."""
    if not is_admittance(s, axis):
        return dx, v
    velocity = s.mass_velocity_rad_s[axis]
    # a period's way even on a missed sample: the mass goes on
    return velocity * p.period_s, velocity


@compiled
def advance_intent(s: Record, p: Record, axis: int, push: float) -> None:
    """Low-pass what a joint at rest is to be helped with, N m, for the intent; NaN and inf empty it.

    Unfiltered, the mass of a hand closes a loop within one tick: its torque falls by m/(J + m) of what the
    motor adds, and kappa F/tau_g times that is above 1 for a few grams on a small joint, which then buzzes at
    half the rate. In the turn of a slow hand it is as slow as at rest, in that of a brisk one `TURN_TIMES` as
    fast (`pace`)."""
    alpha = while_bent(s, p, axis, p.friction_intent_alpha[axis], 1.0)
    if p.friction_policy[axis] == _HYBRID and not slides_on(s, p, axis) and not is_admittance(s, axis):
        alpha = min(alpha, p.rest_alpha[axis] * (1.0 if is_slow(s, p, axis) else TURN_TIMES))
    s.friction_intent_nm[axis] += alpha * (push - s.friction_intent_nm[axis])
    # one NaN would stay in the low-pass for good
    if not math.isfinite(s.friction_intent_nm[axis]):
        s.friction_intent_nm[axis] = 0.0


@compiled
def advance_gate(s: Record, p: Record, axis: int, hand: float) -> float:
    """Force gate g <- LPF clip((|tau_h| - deadband)/tau_g, 0, 1): without a hand there is no feed-forward.

    It closes no faster than `resting.REST_HZ`: a hand's torque passes zero in every stroke, while the joint
    is slowed down. While a hand slides the joint on, it goes by the hand's mean torque, and opens and closes
    `pace.GATE_TIMES` as fast."""
    mean = s.friction_mean_hand_nm[axis] = eased(p, axis, s.friction_mean_hand_nm[axis], hand, MEAN_TIMES)
    moves_on = slides(s, axis) and not is_bent(s, p, axis) and not is_admittance(s, axis)
    if moves_on:
        hand = mean
    # `slides` and not `moves_on`: beside a virtual mass, too, a joint that slides has begun to be helped
    width = p.friction_gate_nm[axis] * (SLIDING_GATE if slides(s, axis) else 1.0)
    wanted = saturate(max(abs(hand) - p.friction_gate_deadband_nm[axis], 0.0) / width)
    alpha = while_bent(s, p, axis, p.friction_gate_alpha[axis], 1.0)
    if moves_on or wanted < s.friction_gate[axis]:  # closing is slow always, opening only in motion
        alpha = min(alpha, p.rest_alpha[axis] * (GATE_TIMES if moves_on else 1.0))
    s.friction_gate[axis] += alpha * (wanted - s.friction_gate[axis])
    return s.friction_gate[axis]


@compiled
def has_gate(policy: int) -> bool:
    """True for policies multiplied by the gate; INTENT is proportional to the hand's torque already."""
    return policy in limits.GATED


@compiled
def range_fade(model: Record, branch: int, speed: float) -> float:
    """1 inside the trained range, falling to 0 over `speed_fade_rad_s` beyond it."""
    beyond = speed - model.speed_max_rad_s[branch]
    if beyond <= 0.0:
        return 1.0
    fade = model.speed_fade_rad_s[branch]
    return 1.0 - beyond / fade if beyond < fade else 0.0


@inlined
def compensated_magnitude(
    p: Record,
    model: Record,
    axis: int,
    branch: int,
    speed: float,
    place: float = 0.0,
    trust: float = 0.0,
    load_nm: float = 0.0,
) -> tuple[float, float]:
    """What the feed-forward may add at this speed and place (rad), and what the model says, both N m.

    `trust` in place, 0 to 1; `load_nm` is what the torque through the gear adds to the friction.

    Notes
    -----
    kappa (F - b_v |v|) + kappa_v b_v |v| + kappa_l L (1 - e^-(v/v_b)^2), faded out of the trained range, at
    least 0, at most `friction_cap_nm`, and `friction_ungated_cap_nm` for policies without a force gate. NaN
    stays NaN."""
    trough = p.place_trough_nm[axis]
    if trough > 0.0:  # as far as its place is not known, the weakest
        curve, by_place = curve_and_place(model, branch, speed, place)
        # the last term is not asked at trust 0: a place that is NaN must not spoil what does not use it
        friction = curve - (1.0 - trust) * trough + (trust * by_place if trust > 0.0 else 0.0)
    else:
        friction = branch_magnitude(model, branch, speed)
    # as the curve, which ends there
    viscous = model.viscous_nms_rad[branch] * min(speed, model.speed_max_rad_s[branch])
    gated = _is_force_gated(p.friction_policy[axis])
    cap = _cap_in_force(gated, p.friction_cap_nm[axis], p.friction_ungated_cap_nm[axis])
    gain, viscous_gain = p.friction_gain[axis], p.friction_viscous_gain[axis]
    fade = range_fade(model, branch, speed)
    load = load_gain(p, axis, speed) * load_nm
    return _feedforward_limit(friction, viscous, gain, viscous_gain, fade, cap, load), friction + load_nm


@inlined
def friction_feedforward(
    t: Record, s: Record, p: Record, model: Record, axis: int, dx: float, v: float
) -> int:
    """Write the feed-forward fields of axis `axis` of the tick; return fault bits.

    Reads the hand's torque of `resting.advance_rest`, and of the tick `velocity_rad_s` and `compensation`;
    `dx` is the joint's motion since the last tick, rad, `v` the velocity to go by, rad/s. The direction of an
    admittance is that of its mass. A model value that is not finite counts as no friction and is a fault.

    Notes
    -----
    Where `v` is not the encoder's velocity, the torque is the lesser of what either allows. What the proofs
    of passivity and the observer's credit rest on, |tau_ff| <= ff(|v|) at the encoder's velocity, holds
    however far off or late `v` is: an error of `v` can only take compensation away. On a joint that
    stands it is ff at the speed before, and the account bounds it (docs/theory.md 5.8); beyond the trained
    range it is 0 in any case."""
    hand = s.calm_hand_nm[axis]
    policy = p.friction_policy[axis]
    way, led = _led_by(s, p, axis, dx, v)
    advance_stop(s, p, axis, way)
    advance_intent(s, p, axis, wished_push(s, p, axis))
    gate = advance_gate(s, p, axis, hand) if has_gate(policy) else 1.0
    direction = saturate(friction_direction(s, p, axis, led, t.tick))
    side = direction if direction != 0.0 else v  # the branch of what is helped, not of what moves
    # NaN is BACKWARD: what it says is NaN as well, and a fault
    branch = FORWARD if side >= 0.0 else BACKWARD
    place, trust = place_of(s, p, axis), place_trust(s, p, axis)
    speed = calm_speed(s, p, axis, speed_seen(s, p, axis, abs(v)))
    load = load_friction(t, s, p, model, axis, speed)
    magnitude, friction = compensated_magnitude(p, model, axis, branch, speed, place, trust, load)
    encoder = speed_seen(s, p, axis, abs(t.velocity_rad_s[axis]))
    if speed != encoder:
        load = load_friction(t, s, p, model, axis, encoder)
        # a device's velocity may only take help away (10.3)
        allowed, _ = compensated_magnitude(p, model, axis, branch, encoder, place, trust, load)
        if not allowed >= magnitude:  # or NaN
            magnitude = allowed
    s.friction_load_nm[axis] = load if math.isfinite(load) else 0.0
    faults = 0
    if not math.isfinite(magnitude) or not math.isfinite(friction):
        magnitude, friction, faults = 0.0, 0.0, _F_LAW
    measured = abs(t.velocity_rad_s[axis])
    if encoder == 0.0:  # a speed beyond the curve is no bend of bristles, nor an edge
        magnitude *= range_fade(model, branch, measured)
    inside = max(speed, measured) <= model.speed_max_rad_s[branch]  # beyond, a friction would be extrapolated
    t.friction_model_nm[axis] = friction if inside else 0.0
    t.friction_sign[axis] = direction
    t.friction_gate[axis] = gate
    torque = t.compensation[axis] * followed_share(s, p, axis) * gate * direction * magnitude
    # the observer's policy has a model for its range and its credit, and no feed-forward
    t.feedforward_torque_nm[axis] = torque if policy not in (_OFF, _OBSERVER) else 0.0
    return faults
