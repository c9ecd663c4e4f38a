"""Whoever moves a joint that is helped with friction pays for some of it; what nobody pays for is not helped.

    E <- min(E + (tau_h + tau_c) dx - d(J v^2/2) - LEAST D, bank)
              tau_c: coupling and injected damping; D: what dry friction surely took out
    share = LP clip(1 + E/bank, 0, 1)    of feed-forward and observer that is sent

Why. The account of the help (`assistance`) lets it put in what friction takes out, dry and viscous. That is
no decay: a mass on a spring that does not damp swings on for ever in a joint whose friction is taken whole,
and where a curve is a little high or turns a little early it grows (.9 mN m in a hand of 82 mN m/rad:
177 mrad/s at 4.8 Hz, and 637 without the observer). It is too slow for `trembling`, and its strokes do not
shrink. But nobody gives it energy: by the balance of the joint what hand and world put in beyond its own
energy of motion is what friction takes and help does not give back, measured, whatever the model says. A
person pays for LEAST and more, since gains leave as much; a swing that nobody feeds cannot, until friction is
left to it.

The share settles where LEAST is paid: who is helped beyond that, by a curve that is too high or a force
sensor that is off by so much, is helped a few hundredths less. So the bank only has to bear what is lent for
a moment: the spring of an elastic joint, steps of the encoder.

It goes and comes as slowly as a gate (`pace.GATE_TIMES`). At once it went to and fro in step with a ring:
behind a sensor three ticks late what the inertia lends is seen late, and a mass on a spring of 255 N m/rad
was swung at 14 Hz by 438 mrad/s (101 without this account).

The balance is exact between the middles of two periods: the torque of the sample between them over the mean
of both ways. A force that is late sees a swing paid for a little more than it is. Less help breaks no proof.
A virtual mass has damping and a watch of its own."""

from __future__ import annotations

import math

from rtctl.control.display import is_admittance
from rtctl.control.handle import own_rad
from rtctl.control.jit import compiled
from rtctl.control.pace import GATE_TIMES
from rtctl.control.records import Record
from rtctl.control.states import is_powered

LEAST = 0.04
"""Share of the dry friction that is paid for at least: less than the usual gains leave a hand in slow
motion."""

BANK_RAD = 0.004
"""The bank is what friction takes over this way."""

OWED_BANKS = 2.0
"""Most that is owed: what was swung up long ago is forgotten."""


@compiled
def _pay(s: Record, p: Record, axis: int, bank: float, push: float, elapsed: int) -> None:
    """Take in the period up to this sample; `push` is the torque of world and injected damping from now on,
    N m. What is no number leaves an empty account."""
    dx = s.position_rad[axis] - s.position_before_rad[axis]
    v = dx / (p.period_s * elapsed)
    # of the sample between both ways, one tick ago
    torque = s.hand_torque_before_nm[axis] + s.paid_push_nm[axis]
    paid = torque * 0.5 * (dx + s.paid_rad[axis]) - 0.5 * p.inertia_kgm2[axis] * (
        v * v - s.paid_rad_s[axis] ** 2
    )
    energy = s.paid_j[axis] + paid - LEAST * s.friction_credit_j[axis]
    # 0, not the bank: after a NaN help is whole and nothing is lent
    s.paid_j[axis] = max(min(energy, bank), -OWED_BANKS * bank) if math.isfinite(energy) else 0.0
    s.paid_rad[axis], s.paid_rad_s[axis], s.paid_push_nm[axis] = dx, v, push


@compiled
def paid_share(t: Record, s: Record, p: Record, axis: int, elapsed: int) -> float:
    """Advance the account; return the share of the help that is left, 0 to 1. It is full without power."""
    bank = p.paying_nm[axis] * own_rad(p, axis, BANK_RAD)
    if not bank > 0.0:
        return 1.0
    if not is_powered(s.state) or is_admittance(s, axis):
        s.paid_j[axis], s.paid_left[axis] = bank, 1.0
        s.paid_rad[axis] = s.paid_rad_s[axis] = s.paid_push_nm[axis] = 0.0
        return 1.0
    if elapsed > 0:
        # injected damping brakes: no hand is to pay for it as for friction
        damping = t.injected_damping_nms_rad[axis] * t.velocity_difference_rad_s[axis]
        _pay(s, p, axis, bank, t.coupling_torque_nm[axis] - damping, elapsed)
    left = min(max(1.0 + s.paid_j[axis] / bank, 0.0), 1.0)
    s.paid_left[axis] += min(GATE_TIMES * p.rest_alpha[axis], 1.0) * (left - s.paid_left[axis])
    return float(s.paid_left[axis])
