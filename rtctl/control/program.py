"""Excitation programs: motions the rig makes by itself, for identification, with nobody's hand on it.

| kind | torque |
|---|---|
| BRAKE | -d v, at most the share HOLD may use; at rest none; d of HOLD once the joint was stopped |
| SERVO | k (x_r - x) + d (v_r - v): PI on the velocity, its integral taken exactly, as position |
| RAMP | open loop: rises by `program_ramp_nm_s` until it slips; below `program_fast_nm` FAST_RAMP times |
| TRACK | PD or PID with inertia and friction feed-forward after a reference; k = k_p, d = k_d |

x position, v velocity, x_r and v_r their references; v_r approaches the wanted speed with bounded
acceleration. A program replaces the law's other torques and goes through the same authority, gate and
state machine. It is a source of energy by intent, so the passivity observer rests meanwhile; in its place
four guards are checked every tick: hand torque, travel, duration, slip (TRACK: distance from the reference).
A guard that trips ends the program in BRAKE, and nothing but a new request leaves it: the host's delay never
matters.

Why v is the low-passed backward difference and not the configured estimator: at low speed a long window
is late by up to half its length, and d must exceed the steepest fall of the Stribeck curve or the joint
stick-slips; both together have no phase margin on a light rig."""

from __future__ import annotations

import math

from rtctl.control.jit import compiled
from rtctl.control.position import friction_toward, reference_at, reference_fits
from rtctl.control.records import Record
from rtctl.control.vocabulary import Program, ProgramFlag, State

_ACTIVE = int(State.ACTIVE)
_OFF = int(Program.OFF)
_BRAKE = int(Program.BRAKE)
_SERVO = int(Program.SERVO)
_RAMP = int(Program.RAMP)
_TRACK = int(Program.TRACK)
_REFUSED = int(ProgramFlag.REFUSED)
_HAND = int(ProgramFlag.HAND)
_TRAVEL = int(ProgramFlag.TRAVEL)
_DONE = int(ProgramFlag.DONE)
_SLIPPED = int(ProgramFlag.SLIPPED)
_LIMIT = int(ProgramFlag.LIMIT)

FAST_RAMP = 10.0
"""The ramp is this many times quicker below `program_fast_nm`."""

INTEGRAL_SHARE = 0.2
"""Most torque of TRACK's integral, share of the torque limit."""

BRAKE_SHARE = 0.2
"""BRAKE uses at most this share of the torque limit, as HOLD does."""


@compiled
def in_program(s: Record, axis: int) -> bool:
    """True while a program makes this axis' torque."""
    return s.program_kind[axis] != _OFF


@compiled
def take_program(s: Record, c: Record, p: Record, axis: int) -> None:
    """Start the program asked for, once per rise of `program_count`.

    A request is used up in the tick that sees it: one that arrives in any state but ACTIVE, or that was
    made in an epoch before the last stop, is void, so nothing queued before a stop can move the rig."""
    asked = c.program_count[axis] > s.program_seen_count[axis]
    s.program_seen_count[axis] = c.program_count[axis]  # in every state: what was asked at rest is void
    if s.state != _ACTIVE:
        s.program_kind[axis] = _OFF
        s.program_flags[axis] = 0
        return
    if not asked or c.epoch != s.epoch:
        return
    before = s.program_kind[axis]
    s.program_kind[axis] = c.program_kind[axis]
    s.program_flags[axis] = 0
    s.program_ticks[axis] = 0
    s.program_ramp_nm[axis] = 0.0
    s.program_integral_nm[axis] = 0.0
    s.program_start_rad[axis] = s.position_rad[axis]
    if before == _OFF:  # else the estimate of the motion goes on
        s.program_velocity_rad_s[axis] = 0.0
    # from one servo motion into the next the reference runs on without a step
    if before != _SERVO or s.program_kind[axis] != _SERVO:
        s.program_reference_rad[axis] = s.position_rad[axis]
        s.program_speed_rad_s[axis] = s.program_velocity_rad_s[axis]
    if not _valid(c, p, axis) or (s.program_kind[axis] == _TRACK and not _trackable(s, c, p, axis)):
        s.program_kind[axis] = _BRAKE
        s.program_flags[axis] = _REFUSED


@compiled
def _valid(c: Record, p: Record, axis: int) -> bool:
    """Finite, of a known kind, and within the rig's limits; NaN is in no range."""
    kind = c.program_kind[axis]
    if kind in (_OFF, _BRAKE):
        return True
    return (
        kind in (_SERVO, _RAMP, _TRACK)
        and abs(c.program_velocity_rad_s[axis]) <= p.velocity_limit_rad_s[axis]
        and 0.0 < c.program_acceleration_rad_s2[axis] < math.inf
        and 0.0 < c.program_torque_max_nm[axis] <= p.torque_limit_nm[axis]
        and 0.0 <= c.program_stiffness_nm_rad[axis] < math.inf
        and 0.0 <= c.program_damping_nms_rad[axis] < math.inf
        and 0.0 < c.program_alpha[axis] <= 1.0
        and abs(c.program_ramp_nm_s[axis]) < math.inf
        and 0.0 <= c.program_fast_nm[axis] < math.inf
        and 0.0 < c.program_slip_rad[axis] < math.inf
        and 0.0 < c.program_hand_nm[axis] < math.inf
        and abs(c.program_hand_zero_nm[axis]) < math.inf
        and p.position_min_rad[axis] <= c.program_min_rad[axis] < c.program_max_rad[axis]
        and c.program_max_rad[axis] <= p.position_max_rad[axis]
    )


@compiled
def _trackable(s: Record, c: Record, p: Record, axis: int) -> bool:
    """Whether a reference that begins here stays within the travel and the rig's speed, and its gains are
    sound."""
    here = s.position_rad[axis]
    return (
        0.0 <= c.program_integral_nm_rad_s[axis] < math.inf
        and 0.0 <= c.program_inertia_kgm2[axis] < math.inf
        and 0.0 <= c.program_friction_gain[axis] <= 1.0
        and 0.0 < c.program_error_rad[axis] < math.inf
        and reference_fits(
            int(c.program_shape[axis]),
            c.program_amplitude_rad[axis],
            c.program_rate[axis],
            here - c.program_min_rad[axis],
            c.program_max_rad[axis] - here,
            p.velocity_limit_rad_s[axis],
        )
    )


@compiled
def _outward(s: Record, c: Record, axis: int, way: float) -> bool:
    """Whether a joint beyond its travel is sent further out (`way` is 1 or -1), or goes there.

    It goes there by both the filtered velocity and the newest sample. The filter alone points outward for a
    while after the joint has turned back, and at rest for ever; a sample alone is noise. While the filter
    points outward no reading gets past the first one beyond: that takes a sample outward, which trips."""
    kind = s.program_kind[axis]
    if kind == _RAMP:  # a joint that still sticks has no velocity
        return way * c.program_ramp_nm_s[axis] > 0.0
    moved = s.position_rad[axis] - s.position_before_rad[axis]
    goes = way * s.program_velocity_rad_s[axis] > 0.0 and way * moved > 0.0
    return goes or (kind == _SERVO and way * c.program_velocity_rad_s[axis] > 0.0)


@compiled
def _tripped(t: Record, s: Record, c: Record, axis: int) -> int:
    """Guards that end the program now, as `ProgramFlag` bits."""
    flags = 0
    # not: a torque that is NaN trips it
    if not abs(t.hand_torque_nm[axis] - c.program_hand_zero_nm[axis]) <= c.program_hand_nm[axis]:
        flags |= _HAND
    x = s.position_rad[axis]
    if (x <= c.program_min_rad[axis] and _outward(s, c, axis, -1.0)) or (
        x >= c.program_max_rad[axis] and _outward(s, c, axis, 1.0)
    ):
        flags |= _TRAVEL
    if s.program_ticks[axis] >= c.program_limit_ticks[axis]:
        flags |= _DONE
    if s.program_kind[axis] == _RAMP:
        if abs(x - s.program_start_rad[axis]) >= c.program_slip_rad[axis]:
            flags |= _SLIPPED
        if abs(s.program_ramp_nm[axis]) >= c.program_torque_max_nm[axis]:
            flags |= _LIMIT
    if (
        s.program_kind[axis] == _TRACK
        and not abs(s.program_reference_rad[axis] - x) <= c.program_slip_rad[axis]
    ):
        flags |= _SLIPPED
    return flags


@compiled
def _servo(s: Record, c: Record, axis: int, dt: float) -> float:
    """Torque of the speed servo; moves its references by `dt` seconds."""
    most = c.program_torque_max_nm[axis]
    step = c.program_acceleration_rad_s2[axis] * dt
    change = c.program_velocity_rad_s[axis] - s.program_speed_rad_s[axis]
    s.program_speed_rad_s[axis] += min(max(change, -step), step)
    x_r = s.program_reference_rad[axis] + s.program_speed_rad_s[axis] * dt
    k = c.program_stiffness_nm_rad[axis]
    if k > 0.0:  # a joint that cannot follow must not wind the reference up
        x = s.position_rad[axis]
        x_r = min(max(x_r, x - most / k), x + most / k)
    s.program_reference_rad[axis] = x_r
    slip = s.program_speed_rad_s[axis] - s.program_velocity_rad_s[axis]
    torque = k * (x_r - s.position_rad[axis]) + c.program_damping_nms_rad[axis] * slip
    return min(max(torque, -most), most)


@compiled
def _ramp(s: Record, c: Record, axis: int, dt: float) -> float:
    """Torque of the open-loop ramp."""
    before = s.program_ramp_nm[axis]
    quick = FAST_RAMP if abs(before) < c.program_fast_nm[axis] else 1.0
    most = c.program_torque_max_nm[axis]
    s.program_ramp_nm[axis] = min(max(before + quick * c.program_ramp_nm_s[axis] * dt, -most), most)
    return s.program_ramp_nm[axis]


@compiled
def _track(s: Record, p: Record, c: Record, model: Record, axis: int, dt: float) -> float:
    """Torque of the position controller; takes its reference `program_ticks` periods after the start."""
    place, v_r, a_r = reference_at(
        int(c.program_shape[axis]),
        c.program_amplitude_rad[axis],
        c.program_rate[axis],
        s.program_ticks[axis] * p.period_s,
    )
    s.program_reference_rad[axis] = x_r = s.program_start_rad[axis] + place
    s.program_speed_rad_s[axis] = v_r
    error, v = x_r - s.position_rad[axis], s.program_velocity_rad_s[axis]
    most = INTEGRAL_SHARE * p.torque_limit_nm[axis]
    integral = s.program_integral_nm[axis] + c.program_integral_nm_rad_s[axis] * error * dt
    # no wind-up while the joint sticks
    s.program_integral_nm[axis] = integral = min(max(integral, -most), most)
    torque = c.program_stiffness_nm_rad[axis] * error + integral + c.program_damping_nms_rad[axis] * (v_r - v)
    torque += c.program_inertia_kgm2[axis] * a_r
    torque += friction_toward(model, c.program_friction_gain[axis], v_r, v, error, c.program_error_rad[axis])
    most = c.program_torque_max_nm[axis]
    return min(max(torque, -most), most)


@compiled
def program_torque(
    t: Record, s: Record, p: Record, c: Record, model: Record, axis: int, elapsed: int
) -> float:
    """Torque of the program in force on this axis, N m; 0 without one. Writes the program's tick fields.

    Parameters
    ----------
    elapsed : int
        Grid ticks since the last valid sample; 0 on a missed one."""
    take_program(s, c, p, axis)
    torque = 0.0
    if in_program(s, axis):
        dt = p.period_s * elapsed
        if elapsed > 0:
            alpha = c.program_alpha[axis]
            alpha = alpha if 0.0 < alpha <= 1.0 else 1.0  # BRAKE is not validated
            # once for every tick since: on seldom samples it would be as many times as slow
            for _ in range(elapsed):
                error = t.velocity_difference_rad_s[axis] - s.program_velocity_rad_s[axis]
                s.program_velocity_rad_s[axis] += alpha * error
        if s.program_kind[axis] != _BRAKE:
            s.program_flags[axis] |= _tripped(t, s, c, axis)
            if s.program_flags[axis] != 0:
                s.program_kind[axis] = _BRAKE
                s.program_speed_rad_s[axis] = s.program_velocity_rad_s[axis]
        torque = _torque(s, p, c, model, axis, dt)
        s.program_ticks[axis] += 1
    t.program_kind[axis] = s.program_kind[axis]
    t.program_flags[axis] = s.program_flags[axis]
    t.program_torque_nm[axis] = torque
    return torque


@compiled
def _torque(s: Record, p: Record, c: Record, model: Record, axis: int, dt: float) -> float:
    """Torque of the kind in force."""
    if s.program_kind[axis] == _SERVO:
        return _servo(s, c, axis, dt)
    if s.program_kind[axis] == _RAMP:
        return _ramp(s, c, axis, dt)
    if s.program_kind[axis] == _TRACK:
        return _track(s, p, c, model, axis, dt)
    damping = c.program_damping_nms_rad[axis]
    if not 0.0 <= damping < math.inf:  # of a refused or plain BRAKE: still brakes, as HOLD does
        damping = p.hold_damping_nms_rad[axis]
    if not s.program_velocity_rad_s[axis] * s.program_speed_rad_s[axis] > 0.0:
        s.program_speed_rad_s[axis] = 0.0  # it has been stopped, for good: more would ring, in a hand perhaps
        damping = min(damping, p.hold_damping_nms_rad[axis])
    cap = BRAKE_SHARE * p.torque_limit_nm[axis]
    return min(max(-damping * s.program_velocity_rad_s[axis], -cap), cap)
