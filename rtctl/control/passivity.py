"""Passivity observer and controller on the torque the motor actually held (docs/theory.md 4).

    E += -tau_held (x_k - x_{k-1}) + b dx^2 / T + D,              E <= a U + bank + c(tau_held)

tau_held is the torque sent one tick ago, after authority, gate and limits, feed-forward included: the
motor held exactly this torque while the joint went from x_{k-1} to x_k, so the first term is exact. Of a
motor that is declared late it is the torque that acted then (`take_back.acted_torque`). The
other two credit what the device itself is guaranteed to dissipate: viscous damping b (Cauchy-Schwarz
over one period; of an elastic joint what is sure at the motor, docs/theory.md 2.8) and D, what its dry
friction surely took out, less what its bristles gave back (`dry_friction`).

U is the energy in the virtual spring and coupling. It belongs to the hand that put it there and will be
given back, so only what exceeds it counts as banked: a cap without U would forget the energy of every
spring stronger than the bank and call its return active. c is what taking back the torque held may cost
(`take_back`): it is kept until then. a is the authority: the world felt is a U. What is put into a U by
others than the hand is granted: U da while the authority rises (`authority`), and the work that a step of the
environment (`environments.changes`) or of a remote proxy (`environments.targets`) does on U. All of it is
paid from one store with a bounded power, and nothing else is ever granted, so that no stream of parameters,
targets or silences is an unbounded source of energy. As E never falls below -1.5 budgets (`take_back`), and
what friction and damping are credited with the device has taken, t seconds after arming the hand was given,
beyond what it put in itself, at most

    renderer_store_j + renderer_power_w t + 1.5 budget_j

Why the dry-friction credit follows the model. A right feed-forward spends kappa F(v) dx by design and
the device's friction takes it back. Crediting one constant, the least friction over the range, would
call that activity wherever the Stribeck curve lies above its minimum: slow motion with 90 % of a
stiction peak would run into a false alarm within seconds."""

from __future__ import annotations

from rtctl.control.jit import compiled, inlined
from rtctl.control.place_trust import place_trust
from rtctl.control.records import Record
from rtctl.control.take_back import acted_torque, cost_to_take_back, in_flight
from rtctl.control.vocabulary import Fault, State

_ACTIVE = int(State.ACTIVE)
_F_PASSIVITY = int(Fault.PASSIVITY)
_F_GROSS = int(Fault.PASSIVITY_GROSS)

FAULT_FACTOR = 1.35
"""A deficit of this many budgets is PASSIVITY: early enough for the ramp to end above
`take_back.FLOOR_FACTOR`."""

GROSS_FACTOR = 3.0
"""A deficit of this many budgets is PASSIVITY_GROSS, a cut (safety contract)."""


@compiled
def granted(s: Record, axis: int) -> float:
    """Energy that the rise of the authority and the renderer, not the hand, put into the world felt, J; used
    up."""
    given = s.authority_grant_j[axis]
    # once: it was put in by one rise
    s.authority_grant_j[axis] = 0.0
    if s.state == _ACTIVE:
        given += s.authority * s.renderer_grant_j[axis]  # of a step of the world the hand feels this share
    return given


@inlined
def observe_port(s: Record, p: Record, axis: int, dx: float, elapsed: int) -> float:
    """Advance the port's energy by the last period, J.

    Never more than `energy_bank_j` above what is stored and what taking back the torque held may cost.

    Parameters
    ----------
    dx : float
        Motion since the last tick, rad; 0 on a missed sample, whose motion the next one carries.
    elapsed : int
        Grid ticks it took.

    Notes
    -----
    `dry_friction.credit_friction` has run for the same period."""
    held = acted_torque(s, p, axis, elapsed)  # not what was asked: gate and limits took their part
    dt = p.period_s * max(elapsed, 1)
    # never more than b v^2 over the period took (2.3)
    credit = max(p.sure_viscous_nms_rad[axis], 0.0) * dx * dx / dt
    credit += s.friction_credit_j[axis]
    energy = s.energy_port_j[axis] - held * dx + credit + granted(s, axis)
    felt = s.authority * s.stored_energy_j[axis]
    if p.conservative_swing_j[axis] > 0.0:  # what the compensated cogging has taken up comes back
        felt += s.authority * place_trust(s, p, axis) * p.conservative_swing_j[axis]
    kept = cost_to_take_back(p, axis, s.torque_applied_nm[axis]) + in_flight(s, p, axis)
    # an old surplus must not pay for a new defect
    s.energy_port_j[axis] = min(energy, felt + p.energy_bank_j + kept)
    return s.energy_port_j[axis]


@compiled
def injected_damping(s: Record, p: Record, axis: int, dx: float, elapsed: int, most: float) -> float:
    """Damping that would pay back a deficit within one period at the present speed, N m s/rad.

    Notes
    -----
    alpha = -E/(T v^2) with v = dx/T, capped at `most`, N m s/rad (an uncapped controller
    made a limit cycle of its own in simulation); 0 below one encoder count of motion, where v is noise."""
    energy = s.energy_port_j[axis]
    if energy >= 0.0 or abs(dx) < p.count_rad[axis] or dx == 0.0:  # a count of 0: no encoder is told
        return 0.0
    dt = p.period_s * max(elapsed, 1)
    return min(-energy * dt / (dx * dx), max(most, 0.0))  # = -E/(t v^2)


@compiled
def passivity_fault(s: Record, p: Record, axis: int) -> int:
    """PASSIVITY and PASSIVITY_GROSS while the deficit exceeds their budgets; NaN is the worst deficit."""
    deficit = -s.energy_port_j[axis]
    if deficit <= FAULT_FACTOR * p.energy_budget_j:  # this way round: NaN goes on to the worst
        return 0
    return _F_PASSIVITY if deficit <= GROSS_FACTOR * p.energy_budget_j else _F_GROSS
