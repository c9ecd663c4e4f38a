"""A force sensor that lies: frozen, at the end of its range, off by too much, or pushed across its joints.

**Frozen.** A sensor that repeats one value to the last bit may be frozen, or quiet: coarse steps hide a small
force for as long as it stays small. What tells the two apart is energy. While the value stays, the joint's
damping and dry friction (`dry_friction`) surely take energy out of the motion, and only the motor and the
force shown put some in. When the joint is back where it was when the value began to stay, a weight or a
spring has given nothing on the whole, and neither has a constant force. If then

    D - W_motor - W_shown + kinetic energy gained  >  budget + path * what one step of the sensor can hide

somebody moved the joint whom the sensor did not show. (Joints that carry each other are not judged so: a
weight may give one of them something while the other one moves.) A step is the smallest change of the value
seen so far, or `axis.force.resolution_n`, whichever is smaller; what it hides, as torque, is that times the
longest lever, on both sides.

**Clipped.** A component exactly at its limit may stand for anything beyond.

**Off.** The friction that `disturbance_observer` sees in sliding is as large forward as backward, give and
take the joint. Half of the difference is what the force shows too much (or a weight that nobody compensates,
which the hand feels just the same). Where not a bit of it has changed meanwhile, it is frozen: what was seen
before, under another load, is not held against it, nor is a joint that rests.

**Across.** The tared force or moment beside those that turn a joint."""

from __future__ import annotations

import math

from rtctl.control.dry_friction import slides
from rtctl.control.friction_curve import BACKWARD, FORWARD
from rtctl.control.jit import compiled, inlined
from rtctl.control.program import in_program
from rtctl.control.records import Record
from rtctl.control.resting import is_resting
from rtctl.control.vocabulary import Fault
from rtctl.control.wrench import beside

_F_FROZEN = int(Fault.FORCE_FROZEN)
_F_CLIPPED = int(Fault.FORCE_CLIPPED)
_F_OFFSET = int(Fault.FORCE_OFFSET)
_F_OFF_AXIS = int(Fault.OFF_AXIS)

FROZEN_S = 0.5
"""A value that stays for less than this is not judged."""

STEPS = 2.0
"""So many steps of the sensor a force may change by without showing: a step each way."""

KINETIC_SHARE = 1.5
"""The kinetic energy that a motion began with may be so many times the one that inertia and velocity say."""

EDGE = 1e-9
"""A value within this share of its limit is at it."""

IN_A_ROW = 3
"""Samples at the limit, or across the joints, that are a fault: as many as bad ones."""

SLID_S = 1.0
"""The joint must have slid so long in each direction, since it is powered, before its friction says
anything."""

AVERAGED_S = 1.0
"""The friction of each direction is averaged over so much sliding: an elastic or uneven joint shows more of
it and less by turns."""

STAYING_SLID_S, STAYING_OFFSET_S = 0.2, 0.1
"""A value that stays has no noise: it is judged after so much sliding each way since it began to, for so
long, and without an average."""

OFFSET_S = 0.25
"""An offset that stays for so much sliding is a fault."""


@inlined
def _changed(s: Record) -> bool:
    """True when any component differs from the sample before; keeps it, and the smallest change seen of
    forces and moments."""
    changed = False
    for part in range(2):
        most = 0.0
        for i in range(3 * part, 3 * part + 3):
            most = max(most, abs(s.wrench[i] - s.wrench_before[i]))
            s.wrench_before[i] = s.wrench[i]
        if most > 0.0:
            changed = True
            seen = s.wrench_step[part]
            # the smallest ever: a step of a coarse sensor is never smaller
            s.wrench_step[part] = most if seen == 0.0 else min(seen, most)
    return changed


@compiled
def _hidden_torque(s: Record, p: Record, axis: int) -> float:
    """Torque that one joint may get without a bit of the force changing, N m."""
    torque = 0.0
    for part in range(2):
        lever = 0.0
        for i in range(3 * part, 3 * part + 3):
            # all three components may hide a step at once, each in the worst sense
            lever += abs(s.screw[axis, i])
        step, coarsest = s.wrench_step[part], p.force_step[part]
        if step == 0.0 or step > coarsest:  # none seen yet, or one that a hand made: what the sheet says
            step = coarsest
        torque += lever * step
    return STEPS * torque


@compiled
def _begin(t: Record, s: Record, p: Record) -> None:
    """Forget what was taken: from here on the value stays."""
    # counted from the sample that changed, or from when the motor came on
    s.same_ticks = 0
    for axis in range(len(s.position_rad)):
        s.stayed_ticks[axis, FORWARD] = s.stayed_ticks[axis, BACKWARD] = 0.0
        v = t.velocity_rad_s[axis]
        s.unseen_start_rad[axis] = s.position_rad[axis]
        # what the motion brings along may be spent
        s.unseen_j[axis] = -0.5 * KINETIC_SHARE * p.inertia_kgm2[axis] * v * v
        s.unseen_path_rad[axis] = 0.0


@compiled
def _unseen(t: Record, s: Record, p: Record, axis: int) -> bool:
    """Add what the last period took out and nobody gave; True when the joint is back and it is too much."""
    dx = s.position_rad[axis] - s.position_before_rad[axis]
    if dx == 0.0:
        return False
    v = t.velocity_rad_s[axis]
    # sent or measured: in doubt it was the motor
    motor = max(s.torque_applied_nm[axis] * dx, t.motor_torque_nm[axis] * dx)
    # an estimate of the other sign takes nothing
    taken = s.friction_credit_j[axis] + max(p.sure_viscous_nms_rad[axis] * v * dx, 0.0)
    s.unseen_j[axis] += taken - motor - t.hand_torque_nm[axis] * dx
    s.unseen_path_rad[axis] += abs(dx)
    here, before = s.position_rad[axis] - s.unseen_start_rad[axis], s.unseen_start_rad[axis]
    # over a closed way weights and springs give nothing
    back = here * (s.position_before_rad[axis] - before) <= 0.0
    # summed up before it is asked: what was taken on the way counts when the joint comes back
    if not back or s.same_ticks * p.period_s < FROZEN_S:
        return False
    # divided here, multiplied at the begin: an inertia told wrong blames nobody
    gained = 0.5 * p.inertia_kgm2[axis] * v * v / KINETIC_SHARE
    hidden = p.energy_budget_j + _hidden_torque(s, p, axis) * s.unseen_path_rad[axis]
    return bool(s.unseen_j[axis] + gained > hidden)


@inlined
def frozen_fault(t: Record, s: Record, p: Record, elapsed: int, powered: bool) -> int:
    """FORCE_FROZEN while a value that stays hides who moves the joint. After friction and hand torque of
    every axis."""
    if elapsed == 0:
        return 0
    # chained joints: a weight may give one of them something while the other one moves
    watched = powered and p.force_used != 0 and p.force_answers != 0 and p.chain_count < 2
    for axis in range(len(s.position_rad)):
        watched = watched and not in_program(s, axis)
    if _changed(s) or not watched:  # asked first: what it keeps must go on while nothing is watched
        _begin(t, s, p)
        return 0
    s.same_ticks += elapsed
    frozen = False
    for axis in range(len(s.position_rad)):
        frozen = _unseen(t, s, p, axis) or frozen
    return _F_FROZEN if frozen else 0


@compiled
def _at_limit(s: Record, p: Record) -> bool:
    # the least limit of all axes: a component there may stand for more on any of them
    for i in range(6):
        limit = p.force_limit_n[0] if i < 3 else p.moment_limit_nm
        if i < 3:
            for axis in range(1, len(s.position_rad)):
                limit = min(limit, p.force_limit_n[axis])
        if abs(s.wrench[i]) >= (1.0 - EDGE) * limit:  # rounding of a scale or a matrix
            return True
    return False


@compiled
def clipped_fault(s: Record, p: Record, elapsed: int) -> int:
    """FORCE_CLIPPED at the third sample in a row with a component at its limit."""
    if p.force_used == 0:
        return 0
    if elapsed > 0:
        s.clipped_ticks = s.clipped_ticks + 1 if _at_limit(s, p) else 0
    return _F_CLIPPED if s.clipped_ticks >= IN_A_ROW else 0


@compiled
def off_axis_fault(s: Record, p: Record, elapsed: int) -> int:
    """OFF_AXIS at the third sample in a row with more force or moment across the joints than is allowed."""
    if not (p.off_axis_n > 0.0 or p.off_axis_nm > 0.0):
        return 0
    if elapsed > 0:
        across = p.off_axis_n > 0.0 and not beside(s, 0) <= p.off_axis_n
        across = across or (p.off_axis_nm > 0.0 and not beside(s, 3) <= p.off_axis_nm)
        s.across_ticks = s.across_ticks + 1 if across else 0
    return _F_OFF_AXIS if s.across_ticks >= IN_A_ROW else 0


@compiled
def _average(s: Record, p: Record, axis: int, side: int, elapsed: int) -> None:
    """Take the friction seen of this direction in: a plain mean at first, one over `AVERAGED_S` of sliding
    later.

    Less what the load adds: a gear that is loaded one way has more friction against the load than with it,
    whatever the force sensor."""
    s.slid_ticks[axis, side] += elapsed
    s.stayed_ticks[axis, side] += elapsed
    share = elapsed / min(max(s.slid_ticks[axis, side], 1.0), AVERAGED_S / p.period_s)
    # see above: what the load adds differs between the directions by itself
    seen, mean = s.friction_seen_nm[axis, side] - s.friction_load_nm[axis], s.slid_friction_nm[axis, side]
    s.slid_friction_nm[axis, side] = mean + share * (seen - mean)


@inlined
def offset_fault(t: Record, s: Record, p: Record, axis: int, elapsed: int, powered: bool) -> int:
    """FORCE_OFFSET while the friction seen in both directions differs by too much; `force_offset_nm` of the
    tick."""
    t.force_offset_nm[axis] = math.nan
    if not powered or not p.friction_seen_alpha[axis] > 0.0:
        s.slid_ticks[axis, FORWARD] = s.slid_ticks[axis, BACKWARD] = s.offset_ticks[axis] = 0
        s.slid_friction_nm[axis, FORWARD] = s.slid_friction_nm[axis, BACKWARD] = 0.0
        return 0
    # a joint that stands with its bristles at their end shows the hand, and no friction
    sliding = slides(s, axis) and t.velocity_difference_rad_s[axis] != 0.0 and not is_resting(s, p, axis)
    if sliding:
        _average(s, p, axis, FORWARD if s.bristle_share[axis] > 0.0 else BACKWARD, elapsed)
    staying = s.same_ticks * p.period_s >= FROZEN_S
    ticks = s.stayed_ticks[axis] if staying else s.slid_ticks[axis]
    if min(ticks[FORWARD], ticks[BACKWARD]) * p.period_s < (STAYING_SLID_S if staying else SLID_S):
        return 0
    offset = 0.5 * (s.slid_friction_nm[axis, FORWARD] - s.slid_friction_nm[axis, BACKWARD])
    t.force_offset_nm[axis] = offset
    if staying:
        offset = 0.5 * (s.friction_seen_nm[axis, FORWARD] - s.friction_seen_nm[axis, BACKWARD])
    if abs(offset) <= p.force_offset_limit_nm[axis]:
        s.offset_ticks[axis] = 0
    elif sliding or offset != offset:  # in rest neither counted nor excused; NaN always
        s.offset_ticks[axis] += max(elapsed, 1)
    if s.offset_ticks[axis] * p.period_s < (STAYING_OFFSET_S if staying else OFFSET_S):
        return 0
    return _F_FROZEN if staying else _F_OFFSET  # a sensor that hangs is no matter of its zero
