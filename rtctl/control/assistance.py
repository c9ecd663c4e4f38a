"""Account of the help with friction: what feed-forward and observer put in, against what friction surely
takes out.

    E <- min(E - tau_a dx + credit, bank)        tau_a: their torque that acted over the period
    share = clip(1 + E/bank, 0, 1)               of the compensation that is sent

`credit` is what the joint's dry friction has surely taken out of the same motion (`dry_friction`), and, as
far as the bristles are at their end, the viscous damping that the coupling does not live on. Whatever the
policy decides about the direction, whatever a delay, a noise, a hand or a wrong model make of it, over any
stretch of time the compensation puts in no more than friction took out, two banks, and one bent bristle F
x_b/2. The bank is F x_b, what one reversal costs, and 4 mJ at most (`friction.guarantee`).

Why it is needed. A policy that is right in sliding is wrong in presliding: there friction is a spring, and
torque that follows the sign of the motion, or the hand's, is negative damping. A hand that holds still was
shaken by it for as long as it held. Such a vibration stays within the bristles' length, is credited nothing,
and empties the account within some periods; the compensation goes, friction is there in full, and the joint
rests. The next stroke fills the account within some milliradians.

Why a creeping joint earns nothing. A joint that a hand leans on may creep below break-away. If that filled
the account, the compensation would grow, the creep with it, and the joint would slip seconds after it came to
rest. Below `CREEP_RAD_S` the account is only spent.

Why the conservative part is not in it. Torque that depends on the place alone is a spring: what it gives on
the way up it takes on the way down, `conservative_swing_j` at most, and what sampling and delay add is in the
damping the sampled loop needs (docs/theory.md 8.9). Charged here, each wave would be paid for and its return
cut off at the bank.

Why two accounts. The torque sent acts some ticks later. Which tick of motion it meets is known to one tick,
so both are kept and the emptier one counts."""

from __future__ import annotations

import math

from rtctl.control.force_feedback import spare_damping
from rtctl.control.handle import own_rad
from rtctl.control.jit import compiled, inlined
from rtctl.control.records import HELD, Record

VISCOUS_SHARE = 0.95
"""Share of the viscous damping that nothing else lives on that may be credited in sliding."""

CREEP_RAD_S = 0.01
"""Slower motion of a joint does not fill the account."""

TINY_J = 1e-12
"""Keeps a bank of nothing from dividing by it."""


@inlined
def keep_assistance(
    s: Record, p: Record, axis: int, dx: float, elapsed: int, velocity: float, powered: bool
) -> None:
    """Advance both accounts by the last period's motion; they are full while no torque leaves.

    `dx` rad in `elapsed` ticks; `velocity`, rad/s, only tells creep from sliding."""
    bank = p.assistance_bank_j[axis]
    if not powered:
        s.assistance_energy_j[axis, 0] = s.assistance_energy_j[axis, 1] = bank
        return
    if dx == 0.0:  # missed samples, too: the next one carries the motion
        return
    # room in the ring for the account that is a tick later
    late = min(max(p.actuator_delay_ticks[axis], 0), HELD - 3)
    creeps = not abs(velocity) > own_rad(p, axis, CREEP_RAD_S)
    slides = s.bristle_share[axis] ** 2
    viscous = VISCOUS_SHARE * spare_damping(s, p, axis) * dx * dx / (p.period_s * max(elapsed, 1))
    credit = s.friction_credit_j[axis] + slides * viscous
    for later in range(2):
        acted = s.compensation_nm[axis, (s.ticks - 1 - late - later) % HELD]
        earned = credit - acted * dx
        if creeps:
            earned = min(earned, 0.0)
        s.assistance_energy_j[axis, later] = min(s.assistance_energy_j[axis, later] + earned, bank)


@compiled
def assistance_share(s: Record, p: Record, axis: int) -> float:
    """Share of the compensation that the account allows, 0 to 1; 0 for NaN."""
    energy = min(s.assistance_energy_j[axis, 0], s.assistance_energy_j[axis, 1])
    # whole down to 0, nothing at -bank: help fades, it does not switch
    share = 1.0 + energy / max(p.assistance_bank_j[axis], TINY_J)
    return min(share, 1.0) if share > 0.0 else 0.0


@compiled
def remember_compensation(t: Record, s: Record, axis: int, share: float) -> None:
    """Note what of the torque sent was compensation: `share` (0 to 1) of feed-forward and observer, and of
    the observer alone."""
    sent = t.feedforward_torque_nm[axis] + t.observer_torque_nm[axis]
    sent -= s.conservative_nm[axis]
    s.compensation_nm[axis, s.ticks % HELD] = share * sent
    observer = share * t.observer_torque_nm[axis]
    # one NaN would stay in two low-passes
    s.fed_sent_nm[axis, s.ticks % HELD] = observer if math.isfinite(observer) else 0.0
