"""Local force feedback: what the hand feels beyond the virtual force, fed back to the motor. Off by default.

    e    = tau_h - tau_h*,  tau_h* = -tau_c            measured minus desired torque of the hand
    y   <- y + alpha (e - y)
    tau  = clip(kappa_f g(y), -L - tau_ff, L - tau_ff)
    L    = r s (F_lo(v) + b_free |v|) - reserve + E_free / (T_E max(|v|, v_E))
    E   <- E - tau_a dx + s (D + b_free dx^2 / T),   E <= bank

tau_c torque of the coupling, tau_ff friction feed-forward and observer, D what dry friction surely took out
(`dry_friction`), g a dead band, F_lo(v) the dry friction the joint
surely has at this speed, b_free the viscous damping that the coupling does not need (all of it in free
motion), reserve what the quantised coupling needs (docs/theory.md 2.10). E is the account of the
assistance tau_a = tau_ff + tau alone: what friction and spare damping took out less what it put in. E_free is
what E holds beyond half the bank; r falls from 1 to 0 as E falls below 0 by a twentieth of the bank.

Why this bound and not one on the gain alone. With one tick of delay and an unknown hand no linear gain worth
having is passive: J alone turns the phase of the device's admittance (a gain of 1 would need a filter below
b/J, 0.7 Hz on the nominal rig). Bounded like this, feed-forward and feedback together put in no more than
friction and spare damping take out of the same motion, and beyond that only what is in the account already,
such as the energy of the inertia, which comes back when the hand slows down. That needs no model of the hand.

Why an account of its own beside the passivity observer's. The torque sent acts some ticks late, which at the
resonance of a stiff hand turns torque in phase with position into torque in phase with velocity: 14 mW on the
nominal rig in a grip of 200 N m/rad, none of which the observer sees. tau_a dx is therefore the worse of the
delay that is declared for the torque and one tick more, so that a tick nobody knew of is covered.

The command's `compensation` scales it with the feed-forward: one switch for all that helps the hand."""

from __future__ import annotations

import math

from rtctl.control.dry_friction import guaranteed_friction
from rtctl.control.handle import own_rad
from rtctl.control.jit import compiled
from rtctl.control.records import HELD, Record
from rtctl.control.vocabulary import Environment

_FREE = int(Environment.FREE)

BANK_KEPT = 0.5
"""Share of the bank that is never spent."""

DEFICIT = 0.05
"""Share of the bank by which the account may be short before nothing is assisted."""

TINY_J = 1e-9
"""Keeps a bank of nothing from dividing by it."""

SPEND_S = 0.05
"""T_E: the free energy would last this long at the present speed."""

SPEED_MIN_RAD_S = 0.02
"""v_E: below it speed is noise; the cap bounds the torque there."""


@compiled
def spare_damping(s: Record, p: Record, axis: int) -> float:
    """Viscous damping of the device that nothing else lives on, N m s/rad: all of it where nothing is
    coupled."""
    damping = p.force_feedback_damping_nms_rad[axis]
    if s.world_kind[axis] == _FREE:
        damping = p.sure_viscous_nms_rad[axis]
    return max(damping, 0.0)


@compiled
def assistance_limit(s: Record, p: Record, model: Record, axis: int, velocity: float) -> float:
    """Most torque feed-forward and feedback may have together at this velocity, N m, >= 0; 0 for NaN."""
    speed, energy = abs(velocity), s.force_feedback_energy_j[axis]
    taken = guaranteed_friction(p, model, axis, velocity) + spare_damping(s, p, axis) * speed
    # fades over the deficit: at a step it would chatter
    trust = min(max(1.0 + energy / max(DEFICIT * p.energy_bank_j, TINY_J), 0.0), 1.0)
    limit = trust * p.force_feedback_share[axis] * taken - p.force_feedback_reserve_nm[axis]
    free = energy - BANK_KEPT * p.energy_bank_j
    if free > 0.0:
        limit += free / (SPEND_S * max(speed, own_rad(p, axis, SPEED_MIN_RAD_S)))
    return limit if limit > 0.0 else 0.0


@compiled
def keep_account(s: Record, p: Record, axis: int, dx: float, elapsed: int, powered: bool) -> None:
    """Advance the account of the assistance by the last period's motion; an empty one while no torque
    leaves."""
    # empty, not full: nothing is lent before friction has taken any
    if not powered or not p.force_feedback_gain[axis] > 0.0:
        s.force_feedback_energy_j[axis] = 0.0
        return
    late = min(max(p.actuator_delay_ticks[axis], 0), HELD - 3)
    sent = s.assistance_nm[axis, (s.ticks - 1 - late) % HELD]
    later = s.assistance_nm[axis, (s.ticks - 2 - late) % HELD]
    dt = p.period_s * max(elapsed, 1)
    taken = s.friction_credit_j[axis]
    taken += spare_damping(s, p, axis) * dx * dx / dt
    energy = s.force_feedback_energy_j[axis] + p.force_feedback_share[axis] * taken
    energy -= max(sent * dx, later * dx)  # what it surely put in, whichever of the two acted
    s.force_feedback_energy_j[axis] = min(energy, p.energy_bank_j)


@compiled
def remember(t: Record, s: Record, axis: int, share: float) -> None:
    """Note what of the torque sent was assistance: `share` (0 to 1) of feed-forward, observer and
    feedback."""
    compensation = t.feedforward_torque_nm[axis] + t.observer_torque_nm[axis]
    compensation -= s.conservative_nm[axis]  # a spring of the place: no help, and no account's matter (8.9)
    s.assistance_nm[axis, s.ticks % HELD] = share * (compensation + s.force_feedback_nm[axis])


@compiled
def force_feedback(t: Record, s: Record, p: Record, model: Record, axis: int, fresh: bool) -> float:
    """Torque of the local force feedback on this axis, N m; 0 where it is not configured.

    Reads hand, coupling and feed-forward torque and the velocity of the tick. A torque that is not finite
    gives NaN, which is a fault of the law, and leaves the filter empty."""
    s.force_feedback_nm[axis] = 0.0
    gain = p.force_feedback_gain[axis]
    if not gain > 0.0:
        return 0.0
    error = t.hand_torque_nm[axis] + t.coupling_torque_nm[axis]
    if not math.isfinite(error):
        s.force_error_nm[axis] = 0.0  # one NaN would stay in the low-pass
        return math.nan
    if fresh:
        s.force_error_nm[axis] += p.force_feedback_alpha[axis] * (error - s.force_error_nm[axis])
    seen = s.force_error_nm[axis]
    beyond = max(abs(seen) - p.force_feedback_deadband_nm[axis], 0.0)
    wanted = min(t.compensation[axis] * gain * beyond, p.force_feedback_cap_nm[axis])
    limit = assistance_limit(s, p, model, axis, t.velocity_rad_s[axis])
    forward = t.feedforward_torque_nm[axis] + t.observer_torque_nm[axis]
    forward -= s.conservative_nm[axis]
    if seen >= 0.0:
        torque = min(wanted, max(limit - forward, 0.0))  # the bound is of all help together
    else:
        torque = -min(wanted, max(limit + forward, 0.0))
    s.force_feedback_nm[axis] = torque
    return torque
