"""One tick of the control law: measured fields in, torque out.

Read `step` first: it is the block diagram. Every part is a pure compiled function of the tick, the state
and the parameters; nothing here knows time, devices or processes."""
# longer than 300 lines: one tick from the sample to the torque, in the order in which it is worked out

from __future__ import annotations

import math

import numpy as np

from rtctl.control import arming, detectors, force_doubt, gate, intake, running_delay
from rtctl.control.assistance import assistance_share, keep_assistance, remember_compensation
from rtctl.control.braking import unbraked_share
from rtctl.control.current_answer import report as report_actuator
from rtctl.control.device_velocity import device_velocity
from rtctl.control.display import begin_display, fade_display, helped_share, is_admittance
from rtctl.control.disturbance_observer import observe_friction, observer_torque
from rtctl.control.dry_friction import credit_friction
from rtctl.control.environments.coupling import coupling_torque
from rtctl.control.feedforward import friction_feedforward, range_fade
from rtctl.control.feeding import unfed_share
from rtctl.control.force import hand_torque, tare_done
from rtctl.control.force_feedback import force_feedback, keep_account, remember
from rtctl.control.friction_curve import BACKWARD, FORWARD
from rtctl.control.jit import compiled, inlined
from rtctl.control.passivity import granted, injected_damping, observe_port, passivity_fault
from rtctl.control.paying import paid_share
from rtctl.control.place_trust import conservative_feedforward, judge_place, place_trust
from rtctl.control.program import in_program, program_torque
from rtctl.control.records import Record
from rtctl.control.resting import advance_rest
from rtctl.control.sample import accept_sample
from rtctl.control.shrinking import steady_share
from rtctl.control.states import advance, is_powered
from rtctl.control.take_back import OVERSPEED_FACTOR, in_flight, torque_to_take_back
from rtctl.control.trembling import calm_share
from rtctl.control.velocity import estimate_velocity
from rtctl.control.virtual_mass import observe_hand, raise_damping, servo_torque
from rtctl.control.vocabulary import Fault, GateFlag, State
from rtctl.control.wrench import report_wrench

_ARMING = int(State.ARMING)
_ACTIVE = int(State.ACTIVE)
_HOLD = int(State.HOLD)
_STOPPING = int(State.STOPPING)
_FAULT = int(State.FAULT)
_F_LAW = int(Fault.LAW_NOT_FINITE)
_F_OVERSPEED = int(Fault.OVERSPEED)
_F_GATE = int(Fault.GATE)
_NOT_FINITE = int(GateFlag.NOT_FINITE)
_VIOLATION = int(GateFlag.VIOLATION)

HOLD_SHARE = 0.2
"""HOLD's damping may use at most this share of the torque limit (safety contract)."""


@compiled
def step(
    tick: np.ndarray, state: np.ndarray, params: np.ndarray, command: np.ndarray, model: np.ndarray
) -> None:
    """Run the law for one tick, in place.

    Parameters
    ----------
    tick : array, shape (1,), `rtctl.tick.tick_dtype`
        The backend has written the measured fields and the loop `tick` and `missed_ticks`; every field
        whose writer is "law" is written here.
    state, params, command : array, shape (1,)
        Records of `rtctl.control.records`. A zeroed state is the state before the first tick.
    model : array, shape (n_axes,), `MODEL`
        Compiled friction model of each axis; zeroed for none.

    Notes
    -----
    Signs: docs/theory.md 1.1. A torque is positive when it accelerates the joint."""
    t, s, p, c = tick[0], state[0], params[0], command[0]
    # 1. what is asked
    requests, arm_allowed = intake.take_command(t, s, p, c)
    # 2. what was measured
    skipped = detectors.count_late(t, s)
    faults, elapsed = accept_sample(t, s, p, skipped)
    faults |= detectors.late_fault(s, p, skipped) | detectors.realtime_fault(t, p) | detectors.age_fault(s, p)
    # the state of the last tick, whose torque was held in the period that is judged now
    powered = is_powered(s.state)
    for axis in range(len(t.position_rad)):
        dx = s.position_rad[axis] - s.position_before_rad[axis]  # 0 on a missed sample: the next carries it
        # 3. velocity, 4. force
        faults |= _estimate(t, s, p, axis, elapsed, powered)
        faults |= _detect(t, s, p, axis, elapsed, skipped)
        # 5. virtual world behind the coupling, or around the virtual mass
        t.coupling_torque_nm[axis] = _display(t, s, p, c, axis, elapsed, powered)
        t.proxy_position_rad[axis] = s.proxy_position_rad[axis]
        t.environment_kind[axis] = s.world_kind[axis]  # in force, not asked for: a change takes ticks (3.3)
        # 6. friction: what it surely takes out, what is seen of it, and the help with it that both allow
        advance_rest(s, p, axis, t.hand_torque_nm[axis], s.authority * t.coupling_torque_nm[axis])
        # the accounts below read its credit
        credit_friction(s, p, model[axis], axis, dx, elapsed, t.velocity_rad_s[axis])
        keep_assistance(s, p, axis, dx, elapsed, t.velocity_rad_s[axis], powered)
        observe_friction(t, s, p, axis, elapsed)  # judges of place and force read it below
        judge_place(t, s, p, model[axis], axis, dx)
        t.place_trust[axis] = place_trust(s, p, axis)  # told: the drift watch goes by the law's own (0062)
        faults |= force_doubt.offset_fault(t, s, p, axis, elapsed, powered)
        velocity, doubt = device_velocity(t, s, p, axis, elapsed, dx)
        faults |= doubt | friction_feedforward(t, s, p, model[axis], axis, dx, velocity)
        _compensate(t, s, p, model[axis], axis, elapsed)
        keep_account(s, p, axis, dx, elapsed, powered)  # before the feedback that may spend from it
        feedback = force_feedback(t, s, p, model[axis], axis, elapsed > 0)
        # or, in their place, an excitation program
        program = program_torque(t, s, p, c, model[axis], axis, elapsed)
        # 7. energy of the last period, and damping where it ran out
        faults |= _observe(t, s, p, axis, dx, elapsed, powered)
        faults |= _sum_torques(t, s, axis, feedback, program)
    faults |= _doubt_force(t, s, p, elapsed, powered)
    faults |= intake.target_fault(s, p, c) | intake.host_fault(s, c)
    # 8. state machine
    may_arm = arm_allowed and tare_done(s, p)
    changed = advance(s, p, t.tick, faults, requests, may_arm, arming.tested(s, p), intake.holding(s, p, c))
    if changed and s.state == _STOPPING:  # planned once: shares of what is left would never reach 0
        _plan_ramp(s, p)
    # 9. gate and current, 10. energies
    faults |= _send(t, s, p)
    # apart from `_send`: a fault of the last axis takes the torque of the first away, too
    for axis in range(len(t.position_rad)):
        _account(t, s, p, axis)
    _report(t, s, faults)


@inlined
def _estimate(t: Record, s: Record, p: Record, axis: int, elapsed: int, powered: bool) -> int:
    """Velocity, motor torque and hand torque of one axis."""
    velocity, difference = estimate_velocity(s, p, axis, elapsed)
    t.velocity_rad_s[axis] = velocity
    t.velocity_difference_rad_s[axis] = difference
    t.motor_torque_nm[axis] = s.current_a[axis] * _torque_per_ampere(p, axis)
    t.hand_torque_raw_nm[axis] = s.force_raw_nm[axis]
    t.hand_torque_nm[axis] = hand_torque(s, p, axis, elapsed > 0, not powered)
    # the bound on what a torque can give out counts on this cut (4.4)
    return _F_OVERSPEED if abs(velocity) > OVERSPEED_FACTOR * p.velocity_limit_rad_s[axis] else 0


@inlined
def _display(t: Record, s: Record, p: Record, c: Record, axis: int, elapsed: int, powered: bool) -> float:
    """Torque of coupling and world on the joint, or of the servo that has it follow a virtual mass."""
    difference = t.velocity_difference_rad_s[axis]
    begin_display(s, p, c, axis)
    t.display_kind[axis] = int(s.display_kind[axis])
    if is_admittance(s, axis):
        # a reading that begins or ends to be held is no motion: the servo would answer it by K_v Delta/T
        # (2.10)
        if s.reading_slip_rad[axis] != 0.0 and elapsed > 0:
            difference -= s.reading_slip_rad[axis] / (elapsed * p.period_s)
        torque = servo_torque(s, p, c, axis, elapsed, difference, t.hand_torque_nm[axis], not powered)
        t.mass_kgm2[axis], t.mass_damping_nms_rad[axis] = s.mass_kgm2[axis], s.mass_damping_nms_rad[axis]
    else:
        torque = coupling_torque(s, p, c, axis, elapsed, difference, not powered)
        t.mass_kgm2[axis] = t.mass_damping_nms_rad[axis] = 0.0
    return torque * fade_display(s, p, c, axis)


@inlined
def _detect(t: Record, s: Record, p: Record, axis: int, elapsed: int, skipped: int) -> int:
    """Faults of one axis that show over time; the share of the limit that heat and a waiver leave."""
    share = detectors.temperature_share(t, s, p, axis)
    if t.waiver != 0:
        share *= min(max(p.waiver_share, 0.0), 1.0)
    t.torque_share[axis] = share
    faults = (
        detectors.temperature_fault(s, p, axis)
        | detectors.follow_fault(t, s, p, axis, elapsed, skipped)
        | detectors.window_fault(s, p, axis)
        | arming.arming_faults(t, s, p, axis, elapsed, skipped)
        | running_delay.running_fault(t, s, p, axis, skipped)
    )
    report_actuator(t, s, axis)
    return faults


@inlined
def _doubt_force(t: Record, s: Record, p: Record, elapsed: int, powered: bool) -> int:
    """Tared force and moment into the tick; faults of a force sensor that lies."""
    report_wrench(t, s)
    faults = force_doubt.clipped_fault(s, p, elapsed) | force_doubt.off_axis_fault(s, p, elapsed)
    return faults | force_doubt.frozen_fault(t, s, p, elapsed, powered)


@compiled
def _torque_per_ampere(p: Record, axis: int) -> float:
    """Link torque of one ampere, N m/A: gear ratio * efficiency * torque constant."""
    return p.gear_ratio[axis] * p.gear_efficiency[axis] * p.torque_constant_nm_a[axis]


@inlined
def _compensate(t: Record, s: Record, p: Record, model: Record, axis: int, elapsed: int) -> None:
    """Add conservative part and observer to the feed-forward, and hold what helps with friction to what its
    account, a hand that brakes, strokes that shrink, trembling, what is paid and what the observer feeds
    leave."""
    speed = t.velocity_rad_s[axis]
    branch = FORWARD if speed >= 0.0 else BACKWARD
    spring = conservative_feedforward(t, s, p, model, axis, range_fade(model, branch, abs(speed)))
    s.conservative_nm[axis] = spring
    friction = t.feedforward_torque_nm[axis]
    if spring != 0.0:
        t.feedforward_torque_nm[axis] = friction + spring  # the observer sees both
    t.observer_torque_nm[axis] = observer_torque(t, s, p, model, axis, elapsed)
    # the tick tells the account's share alone: what else takes help away is no shortage
    share = assistance_share(s, p, axis)
    t.assistance_share[axis] = share
    # each of these advances what it remembers, so all of them run in every tick, whatever another one leaves
    share *= helped_share(s, p, axis) * unbraked_share(t, s, p, axis) * steady_share(t, s, p, axis)
    share *= calm_share(s, p, axis)
    share *= paid_share(t, s, p, axis, elapsed)
    t.feedforward_torque_nm[axis] = friction
    t.feedforward_torque_nm[axis] *= share
    if spring != 0.0:
        t.feedforward_torque_nm[axis] += spring  # whole: it gives back by itself what it took up (8.9)
    t.observer_torque_nm[axis] *= share
    # the observer alone lags, and so feeds (6.6)
    t.observer_torque_nm[axis] *= unfed_share(s, p, axis, elapsed)


@inlined
def _observe(t: Record, s: Record, p: Record, axis: int, dx: float, elapsed: int, powered: bool) -> int:
    """Passivity observer, controller, and the energies the hand and the feed-forward have put in."""
    # a hand's torque varies within a period
    work = 0.5 * (s.hand_torque_before_nm[axis] + t.hand_torque_nm[axis]) * dx
    s.energy_hand_j[axis] += work
    s.hand_torque_before_nm[axis] = t.hand_torque_nm[axis]
    s.energy_feedforward_j[axis] += s.feedforward_applied_nm[axis] * dx  # the motor's is held: exact
    t.injected_damping_nms_rad[axis] = 0.0
    if not powered or in_program(s, axis):  # a program is a source by intent, behind guards of its own
        s.energy_port_j[axis] = s.mass_injected_nms_rad[axis] = 0.0
        return 0
    if is_admittance(s, axis):
        observe_hand(s, p, axis, work, granted(s, axis), t.velocity_rad_s[axis])
        asked = injected_damping(s, p, axis, dx, elapsed, p.servo_velocity_gain_nms_rad[axis])
        t.injected_damping_nms_rad[axis] = raise_damping(s, p, axis, asked)
        # of rings too quick to wait for a deficit (14.5)
        t.injected_damping_nms_rad[axis] += s.mass_watch_nms_rad[axis]
    else:
        observe_port(s, p, axis, dx, elapsed)
        most = p.injected_damping_max_nms_rad[axis]
        t.injected_damping_nms_rad[axis] = injected_damping(s, p, axis, dx, elapsed, most)
    return passivity_fault(s, p, axis)


@inlined
def _sum_torques(t: Record, s: Record, axis: int, feedback: float, program: float) -> int:
    """Wanted torque of ACTIVE; its damping share is written beside it."""
    if in_program(s, axis):
        t.coupling_torque_nm[axis] = 0.0
        t.feedforward_torque_nm[axis] = t.observer_torque_nm[axis] = 0.0
        s.force_feedback_nm[axis] = feedback = s.conservative_nm[axis] = 0.0
    # by dx/T, as the deficit was reckoned (4.3): a smoothed velocity would pay late, and another sum
    t.damping_torque_nm[axis] = -t.injected_damping_nms_rad[axis] * t.velocity_difference_rad_s[axis]
    if is_admittance(s, axis):  # it damps the mass, which the joint follows
        t.damping_torque_nm[axis] = 0.0
    wanted = t.coupling_torque_nm[axis] + t.feedforward_torque_nm[axis] + t.damping_torque_nm[axis]
    wanted += t.observer_torque_nm[axis] + feedback + program
    t.torque_wanted_nm[axis] = wanted
    return 0 if math.isfinite(wanted) else _F_LAW


@compiled
def _hold_torque(t: Record, p: Record, axis: int) -> float:
    """Damping of HOLD, capped at HOLD_SHARE of the limit."""
    # it only takes: no authority scales it, no deficit adds to what is sure, and a mass's damping is its own
    t.injected_damping_nms_rad[axis] = 0.0
    cap = HOLD_SHARE * p.torque_limit_nm[axis]
    return min(max(-p.hold_damping_nms_rad[axis] * t.velocity_difference_rad_s[axis], -cap), cap)


@compiled
def _plan_ramp(s: Record, p: Record) -> None:
    """Step per tick that brings each torque to zero within `stop_ticks`."""
    for axis in range(len(s.torque_applied_nm)):
        # of each axis its own: all end together
        s.ramp_step_nm[axis] = abs(s.torque_applied_nm[axis]) / max(p.stop_ticks, 1)


@compiled
def _ramp_torque(s: Record, axis: int) -> float:
    """The torque sent last, one ramp step nearer to zero."""
    before = s.torque_applied_nm[axis]
    left = abs(before) - s.ramp_step_nm[axis]
    # A remainder of rounding is zero: the ramp ends in stop_ticks, not one tick later.
    if left <= 1e-9 * s.ramp_step_nm[axis]:
        return 0.0
    return left if before > 0.0 else -left


@compiled
def _torque_of_state(t: Record, s: Record, p: Record, axis: int) -> float:
    """Torque the present state asks of the gate; writes what HOLD and STOPPING change in the tick."""
    if s.state == _ACTIVE:
        return s.authority * t.torque_wanted_nm[axis]
    if s.state == _STOPPING:
        return _ramp_torque(s, axis)
    if s.state == _ARMING:
        return arming.pulse_torque(s, p, axis)
    if s.state == _HOLD:
        t.damping_torque_nm[axis] = _hold_torque(t, p, axis)
        t.torque_wanted_nm[axis] = t.damping_torque_nm[axis]
        return t.damping_torque_nm[axis]
    return 0.0


@compiled
def _state_share(state: int) -> float:
    """Share of the torque limit that a state may use (safety contract)."""
    if state == _ARMING:
        return arming.MAX_SHARE
    return HOLD_SHARE if state == _HOLD else 1.0


@inlined
def _gate(t: Record, s: Record, p: Record, axis: int) -> int:
    """Put one axis through the gate, encode its current, check what was encoded; `GateFlag` bits."""
    limit = p.torque_limit_nm[axis]
    window_limit = gate.window_limit(
        s.window_mean_nm[axis], limit, p.torque_continuous_nm[axis], p.window_share
    )
    # A ramp only falls, and must not be stretched by a share that its start exceeded.
    share = 1.0 if s.state == _STOPPING else t.torque_share[axis] * _state_share(s.state)
    allowed = min(share * limit, window_limit)
    # a program gives energy by intent, behind guards of its own
    if not in_program(s, axis):
        left = s.energy_port_j[axis] - in_flight(s, p, axis)
        allowed = min(allowed, torque_to_take_back(p, axis, left))  # torques in flight are spent (4.4)
    torque, flags = gate.gate_torque(
        _torque_of_state(t, s, p, axis),
        s.torque_applied_nm[axis],
        t.velocity_rad_s[axis],
        limit,
        allowed,
        p.torque_rate_nm[axis],
        p.velocity_limit_rad_s[axis],
        is_powered(s.state),
    )
    per_ampere = _torque_per_ampere(p, axis)
    # without a constant `encoded_fits` passes 0 alone
    current = torque / per_ampere if per_ampere > 0.0 else 0.0
    if not gate.encoded_fits(torque, current, per_ampere, limit):
        flags |= _VIOLATION
    if window_limit < limit:  # the flag tells what bounded the torque: it is compared with what left the gate
        flags |= gate.window_flag(window_limit, torque)
    t.torque_share[axis] = allowed / limit
    t.torque_applied_nm[axis] = torque
    t.current_command_a[axis] = current
    t.gate_flags[axis] = flags
    return flags


@compiled
def _send(t: Record, s: Record, p: Record) -> int:
    """Gate every axis; one that is not finite cuts all of them in this tick, a broken gate locks out."""
    flags = 0
    for axis in range(len(t.position_rad)):
        flags |= _gate(t, s, p, axis)
    fault = 0
    if flags & _VIOLATION:
        fault = _F_GATE
    elif flags & _NOT_FINITE:
        fault = _F_LAW
    if fault == 0:
        return 0
    for axis in range(len(t.position_rad)):
        t.torque_applied_nm[axis] = 0.0
        t.current_command_a[axis] = 0.0
    # The machine has seen LAW_NOT_FINITE already unless the gate caught what the law did not.
    advance(s, p, t.tick, fault, 0, False, False, False)
    return fault


@inlined
def _account(t: Record, s: Record, p: Record, axis: int) -> None:
    """Keep the torque sent; what of it was feed-forward; energies into the tick."""
    torque = t.torque_applied_nm[axis]
    s.torque_applied_nm[axis] = torque
    detectors.remember_torque(s, axis)
    s.window_mean_nm[axis] = gate.push_window(s.window_mean_nm[axis], torque, p.window_share)
    wanted = t.torque_wanted_nm[axis]
    # what gate and authority left of the sum they left of each part of it
    share = torque / wanted if s.state == _ACTIVE and wanted != 0.0 else 0.0
    share = min(max(share, 0.0), 1.0)
    s.feedforward_applied_nm[axis] = share * (t.feedforward_torque_nm[axis] + t.observer_torque_nm[axis])
    remember_compensation(t, s, axis, share)
    remember(t, s, axis, share)
    t.energy_port_j[axis] = s.energy_port_j[axis]
    t.energy_hand_j[axis] = s.energy_hand_j[axis]
    t.energy_feedforward_j[axis] = s.energy_feedforward_j[axis]


@compiled
def _report(t: Record, s: Record, faults: int) -> None:
    """State fields of the tick."""
    s.faults = faults
    s.ticks += 1
    t.sample_age_ticks = s.sample_age_ticks
    t.target_age_ticks = s.target_age_ticks
    t.lease_held = 1 if s.lease != 0 else 0
    t.targets_refused = s.targets_refused
    t.state = s.state
    t.enabled = 1 if is_powered(s.state) else 0
    # kept in the state, felt in these two only
    t.authority = s.authority if s.state in (_ACTIVE, _HOLD) else 0.0
    t.epoch = s.epoch
    t.faults = faults
    t.fault_first = s.fault_first
