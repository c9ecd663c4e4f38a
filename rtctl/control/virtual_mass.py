"""Admittance display: the measured force moves a virtual mass in its world, and the joint follows the mass.

    m (v_r+ - v_r)/T = tau_f - b_v v_r+ - f_env(p+),      p+ = p + T v_r+      the mass, one implicit step
    tau = K_v (v_r - v_hat) + K_p (p - x) + z <J a_r + b v_r - tau_f>                  the servo of the joint

tau_f is the hand's torque after a low-pass and a dead band, v_hat the low-passed difference of positions, p
the place of the mass, which is the proxy of the tick. <...> is low-passed: what the mass's motion asks of the
joint is sent ahead by the share z, less while the watch rings. With A = (m/T + b_v)/T and w = m v_r/T +
tau_f + A p the first line is f_env(p+) = w - A p+, which every environment solves already
(`environments.coupling`): a world of any stiffness is stable on the mass.

What a world is felt through is the mass: m/T^2 stands where the coupling's stiffness stands for an impedance.

The account is kept where the hand is, from the measured torque (docs/theory.md 14):

    E += tau_h dx + granted,      E <= m v_r^2/2 + J v^2/2 + U + K_p (p - x)^2/2 + bank + c(tau_held)

The motor itself is no port to be watched: to show less inertia than J it must give (J - m) v^2/2, and take it
back. A deficit adds to b_v (and `CALM_S` longer), and beyond 1.35 budgets is a fault (`passivity`).

While only a share a of the display is felt (soft start, change of display), b_v is greater by (1 - a) K_v: a
mass that a weak servo cannot have the joint follow would ring in hands that it bears at full torque (14.2).

The servo never asks for more than the torque limit L: the speed of the mass stays within L/K_v of that of the
joint, its place within L/K_p: when what holds the joint lets go, it does not come back all at once."""

from __future__ import annotations

import math

from rtctl.control.display import felt_share, follow_mass, start_speed
from rtctl.control.environments.changes import HALVINGS, follow_world, pay, towards
from rtctl.control.environments.laws import environment_energy, finite_command, solve_proxy
from rtctl.control.environments.table import Environment
from rtctl.control.flicker import is_blind
from rtctl.control.jit import compiled
from rtctl.control.program import in_program
from rtctl.control.records import Record
from rtctl.control.stability_watch import forget_force, watch_force
from rtctl.control.take_back import cost_to_take_back, in_flight
from rtctl.control.vocabulary import State

CALM_S = 2.0
"""Time constant over which damping that a deficit added is forgotten."""
KEPT_SHARE = 0.02
"""A deficit below this share of the budget is noise of the force: no damping is added for it."""

MASS_REST_HZ = 4.0
"""Motion of the mass above this is damped while the joint sticks: hands are slower, bent bristles quicker."""

_ACTIVE, _ARMING, _REMOTE = int(State.ACTIVE), int(State.ARMING), int(Environment.REMOTE)


@compiled
def _rest(s: Record, axis: int) -> None:
    """Put the mass where the joint is, at rest: nothing winds up while the servo does nothing."""
    s.proxy_position_rad[axis] = s.remote_position_rad[axis] = s.position_rad[axis]
    s.mass_velocity_rad_s[axis] = s.mass_watch_nms_rad[axis] = s.watch_share[axis] = 0.0
    s.mass_forward_nm[axis] = s.mass_calm_rad_s[axis] = 0.0
    s.proxy_set_count[axis] = 1  # it has a place: no display begins anew


@compiled
def _forget(s: Record, axis: int) -> None:
    """As `_rest`, without a trace of what came in: it was no number."""
    _rest(s, axis)
    s.mass_force_nm[axis] = s.servo_velocity_rad_s[axis] = s.mass_bristle_share[axis] = 0.0
    forget_force(s, axis)
    s.stored_energy_j[axis] = s.renderer_grant_j[axis] = 0.0


@compiled
def _bend(s: Record, p: Record, axis: int, dx: float) -> None:
    """Move the joint on by `dx` within its bristles; at their end, or without any, it slides."""
    length = p.mass_rest_rad[axis]
    if not (length > 0.0 and math.isfinite(dx)):  # never stuck: no damping of rest
        s.mass_bristle_share[axis] = 1.0
        return
    s.mass_bristle_share[axis] = min(max(s.mass_bristle_share[axis] + dx / length, -1.0), 1.0)


@compiled
def _rest_damping(s: Record, p: Record, axis: int) -> float:
    """Damping of the mass while the joint sticks, N m s/rad, more while it is not seen: none may ring.

    Of its motion beyond a low-pass: a damper to a mass, at rest when the joint begins to stick, so it only
    takes. It begins at the speed of the mass where the joint is no longer seen (a hand that leans on it moves
    the mass on, and to brake that would jolt the joint by counts), and where the joint gave way by a count at
    the end of its bristles and the mass goes on towards that end: nothing turned back."""
    before, damping, blind = s.mass_calms_nms_rad[axis], 0.0, is_blind(s, p, axis)
    if blind:
        damping = p.mass_blind_nms_rad[axis]
    elif abs(s.mass_bristle_share[axis]) < 1.0:
        damping = p.mass_rest_nms_rad[axis]
    if damping == 0.0:
        s.mass_calm_rad_s[axis] = 0.0
    # else it begins at 0: a damper to a mass at rest only takes (2.15)
    elif before == 0.0 and (blind or s.mass_velocity_rad_s[axis] * s.mass_bristle_share[axis] > 0.0):
        s.mass_calm_rad_s[axis] = s.mass_velocity_rad_s[axis]
    s.mass_calms_nms_rad[axis] = damping
    return float(damping)


@compiled
def _measure(s: Record, p: Record, axis: int, elapsed: int, difference: float, hand_nm: float) -> float:
    """Low-passes of force and velocity, once a fresh sample; the hand's torque beyond the dead band, N m."""
    if elapsed > 0:
        _bend(s, p, axis, difference * elapsed * p.period_s)
        s.mass_watch_nms_rad[axis] = watch_force(s, p, axis, hand_nm)
        quick = p.mass_blind_alpha[axis] if is_blind(s, p, axis) else p.mass_force_alpha[axis]
        s.mass_force_nm[axis] += quick * (hand_nm - s.mass_force_nm[axis])
        alpha = 1.0 - (1.0 - p.servo_velocity_alpha[axis]) ** elapsed
        s.servo_velocity_rad_s[axis] += alpha * (difference - s.servo_velocity_rad_s[axis])
    band = p.mass_force_deadband_nm[axis]
    return s.mass_force_nm[axis] - towards(0.0, s.mass_force_nm[axis], band)  # a dead band without a step


@compiled
def _follow_remote(s: Record, p: Record, axis: int) -> None:
    """Bring the renderer's end of the spring towards its target, as far as it is paid for (`targets`)."""
    if s.target_age_ticks >= s.remote_ticks:
        return
    age = min(s.target_age_ticks, p.target_hold_ticks)
    target = s.target_position_rad[axis] + s.target_velocity_rad_s[axis] * p.period_s * age
    before, mass = s.remote_position_rad[axis], s.proxy_position_rad[axis]  # of the tick before
    step = towards(before, target, p.velocity_limit_rad_s[axis] * p.period_s) - before
    k = p.coupling_stiffness_nm_rad[axis]
    for _ in range(HALVINGS):
        way, way_before = mass - before - step, mass - before
        work = 0.5 * k * (way * way - way_before * way_before)
        if work <= s.renderer_store_j[axis]:
            s.remote_position_rad[axis] = before + step
            pay(s, axis, work)
            return
        step *= 0.5  # as far as it is paid, and no all or nothing


@compiled
def _world_step(s: Record, p: Record, axis: int, drive: float, stiffness: float) -> float:
    """Place of the mass after this tick, rad: of a remote world on a spring to the renderer's end of it.

    The damper goes to the ground: one to a moving end would do work of the renderer's that nobody pays."""
    before, dt = s.proxy_position_rad[axis], p.period_s
    if s.world_kind[axis] != _REMOTE:
        return solve_proxy(s, axis, drive, stiffness, before, dt)
    _follow_remote(s, p, axis)
    end = s.remote_position_rad[axis]
    k, b = p.coupling_stiffness_nm_rad[axis], p.coupling_damping_nms_rad[axis] / dt
    return (drive + k * end + b * before) / (stiffness + k + b)


@compiled
def _step(s: Record, p: Record, c: Record, axis: int, felt_nm: float) -> None:
    """One implicit step of the mass in its world, which looks at the mass where others look at the joint."""
    joint = s.position_rad[axis]
    before, dt, speed = s.proxy_position_rad[axis], p.period_s, s.mass_velocity_rad_s[axis]
    s.position_rad[axis] = before  # for `changes`: the mass is what lies between hand and world (14.3)
    follow_world(s, p, c, axis, abs(speed), False)
    follow_mass(s, p, c, axis, False)
    inertia = s.mass_kgm2[axis] / dt
    added = s.mass_injected_nms_rad[axis] + s.mass_watch_nms_rad[axis]
    added += (1.0 - felt_share(s, axis)) * p.servo_velocity_gain_nms_rad[axis]
    calms = _rest_damping(s, p, axis)
    # A of 14.1: the mass is what the world is felt through
    stiffness = (inertia + s.mass_damping_nms_rad[axis] + added + calms) / dt
    drive = inertia * speed + felt_nm + calms * s.mass_calm_rad_s[axis] + stiffness * before
    after = _world_step(s, p, axis, drive, stiffness)
    s.position_rad[axis] = joint  # what else reads it this tick is of the joint
    velocity = (after - before) / dt  # implicit: of the place it has come to
    held = s.servo_velocity_rad_s[axis]  # as the servo sees the joint: its torque then stays within the limit
    slip = p.torque_limit_nm[axis] / p.servo_velocity_gain_nms_rad[axis]
    s.mass_velocity_rad_s[axis] = towards(held, velocity, slip)  # what is held does not wind up (14.2)
    if calms > 0.0:
        beyond = s.mass_velocity_rad_s[axis] - s.mass_calm_rad_s[axis]
        s.mass_calm_rad_s[axis] += p.mass_rest_alpha[axis] * beyond
    place = before + dt * s.mass_velocity_rad_s[axis]  # not `after`: the speed may have been cut
    if p.servo_position_gain_nm_rad[axis] > 0.0:
        place = towards(joint, place, p.torque_limit_nm[axis] / p.servo_position_gain_nm_rad[axis])
    s.proxy_position_rad[axis] = place
    if s.world_kind[axis] != _REMOTE:  # it begins slack: nobody pays for a stretch
        s.remote_position_rad[axis] = place
    _send_ahead(s, p, axis, (s.mass_velocity_rad_s[axis] - speed) / dt, felt_nm)


@compiled
def _send_ahead(s: Record, p: Record, axis: int, acceleration: float, felt_nm: float) -> None:
    """Low-pass what the mass's motion asks of the joint beyond the hand: J a_r + b v_r - tau_f, N m."""
    drag = p.viscous_nms_rad[axis] * s.mass_velocity_rad_s[axis]
    asked = p.inertia_kgm2[axis] * acceleration + drag - felt_nm
    asked = towards(0.0, asked, p.torque_limit_nm[axis])  # a jolt of the force would stay in the low-pass
    s.mass_forward_nm[axis] += p.mass_forward_alpha[axis] * (asked - s.mass_forward_nm[axis])


@compiled
def _store(s: Record, p: Record, axis: int) -> None:
    """Write the energy of the world and of the servo's spring, which is given back."""
    place = s.proxy_position_rad[axis]
    stretch = place - s.position_rad[axis]
    stored = 0.5 * p.servo_position_gain_nm_rad[axis] * stretch * stretch
    if s.world_kind[axis] == _REMOTE:
        stored += 0.5 * p.coupling_stiffness_nm_rad[axis] * (place - s.remote_position_rad[axis]) ** 2
    else:
        stored += environment_energy(s, axis, place)
    s.stored_energy_j[axis] = stored if math.isfinite(stored) else 0.0


@compiled
def servo_torque(
    s: Record,
    p: Record,
    c: Record,
    axis: int,
    elapsed: int,
    difference: float,
    hand_nm: float,
    disabled: bool,
) -> float:
    """Torque that makes the joint follow the virtual mass, N m; moves the mass, `state.proxy_position_rad`.

    Parameters
    ----------
    elapsed : int
        Grid ticks since the last valid sample; 0 on a missed one: the mass goes on with the last force.
    difference : float
        Plain backward difference of the position, rad/s.
    hand_nm : float
        Tared hand torque, N m, positive where it accelerates the joint.
    disabled : bool
        True while no torque leaves.

    Returns
    -------
    float
        0 outside ACTIVE and in a program: the mass rests at the joint. NaN if force or command is not finite.
    """
    felt = _measure(s, p, axis, elapsed, difference, hand_nm)
    if not (finite_command(c, axis) and math.isfinite(felt) and math.isfinite(difference)):
        _forget(s, axis)
        return math.nan
    if s.proxy_set_count[axis] == 0 or disabled or s.state != _ACTIVE or in_program(s, axis):
        # a display that was just exchanged: at the joint's speed
        begins = s.proxy_set_count[axis] == 0 and not in_program(s, axis)
        _rest(s, axis)
        follow_world(s, p, c, axis, 0.0, disabled)
        follow_mass(s, p, c, axis, True)
        if begins:
            s.mass_velocity_rad_s[axis] = start_speed(s, axis)
        _store(s, p, axis)
        return 0.0
    _step(s, p, c, axis, felt)
    if not math.isfinite(s.proxy_position_rad[axis]):
        _forget(s, axis)
        return math.nan
    _store(s, p, axis)
    lag = s.mass_velocity_rad_s[axis] - s.servo_velocity_rad_s[axis]  # positive: the joint is behind
    stretch = s.proxy_position_rad[axis] - s.position_rad[axis]
    torque = p.servo_velocity_gain_nms_rad[axis] * lag + p.servo_position_gain_nm_rad[axis] * stretch
    ahead = p.mass_forward[axis] * (1.0 - s.watch_share[axis]) * s.mass_forward_nm[axis]
    return torque + ahead


@compiled
def observe_hand(s: Record, p: Record, axis: int, work_j: float, granted_j: float, speed: float) -> None:
    """Advance the account of the hand's port by the work the hand did in the last period, J.

    Parameters
    ----------
    work_j
        tau_h dx, as measured.
    granted_j
        What a renderer or a change of environment was allowed to put in.
    speed
        Of the joint, rad/s."""
    held = s.authority * s.stored_energy_j[axis] + 0.5 * p.inertia_kgm2[axis] * speed * speed
    held += 0.5 * s.mass_kgm2[axis] * s.mass_velocity_rad_s[axis] ** 2
    if p.mass_rest_alpha[axis] > 0.0:
        # the mass that the damper of rest hangs on: b_r/(2 pi f_r)
        calms_kgm2 = s.mass_calms_nms_rad[axis] * p.period_s / p.mass_rest_alpha[axis]
        held += 0.5 * calms_kgm2 * s.mass_calm_rad_s[axis] ** 2
    if s.state == _ARMING:  # the test pulse works on whoever holds the joint, by intent
        s.energy_port_j[axis] = 0.0
        return
    energy = s.energy_port_j[axis] + work_j + granted_j
    held += cost_to_take_back(p, axis, s.torque_applied_nm[axis]) + in_flight(s, p, axis)
    s.energy_port_j[axis] = min(energy, held + p.energy_bank_j)


@compiled
def raise_damping(s: Record, p: Record, axis: int, asked: float) -> float:
    """Damping beyond b_v from the next tick on, N m s/rad: what a deficit asks for, forgotten over `CALM_S`.

    Notes
    -----
    A hand in a vibration that pays and owes in turn would else be left stiffer than promised. Damping takes.
    """
    left = s.mass_injected_nms_rad[axis] * math.exp(-p.period_s / CALM_S)
    if not s.energy_port_j[axis] < -KEPT_SHARE * p.energy_budget_j:
        asked = 0.0  # a deficit of noise, or NaN
    s.mass_injected_nms_rad[axis] = max(asked, left)
    return max(asked, left)
