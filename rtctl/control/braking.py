"""A hand that brakes the joint it moves is not helped with friction: friction brakes with it.

    brake <- LP clip((-(tau_h + tau_c) sgn(h) - deadband)/brake_nm, 0, 1)
            brake_nm: `BRAKE_GATES` gate_nm;  h: the bristles of `dry_friction` at their end
    share = 1 - brake                                        of feed-forward and observer that is sent

Why. A heavy hand that hangs on a spring and is hardly damped swings out on a joint whose friction is
compensated, for seconds. Its torque is that of a person who moves the joint: J dv/dt, and both do the work
that friction takes. But whoever swings out brakes the joint for half of each swing, and a person who brakes
wants the joint slower. So friction is left to the joint then, and takes the joint's energy twice in a swing.
A person's motion needs less torque by it, since friction does what the hand would have to.

Why no sooner. The push is known through two low-passes, so that the help is least some hundredths of a second
after the hand brakes most: a one-sided spring of F k/brake_nm that lags. At half the width of the gate a
twentieth of the friction took all help, and every hand that hardly damps was swung by it: at 3 Hz by twice,
on a joint whose ring turns it at 8 Hz by four times what it does without help. A heavy hand that swings out
brakes with that much and more.

tau_c is the torque of the coupling: a hand that lets a spring of the virtual world push the joint back brakes
nothing, and what both ask of the joint is its inertia and what is left of its friction. On bent bristles the
direction of the motion is not known, and nothing is changed. A joint that stands is braked by nobody: dry
friction that holds without bending leaves h at the end of the last motion, and a hand that pulled back was
left unhelped until all of the friction gave way, and helped whole an instant later, with its spring bent by
so much. A virtual mass is braked by its hand through the law itself, and its joint must follow: it is helped
as ever. Less help never breaks a proof: the account, the two lines and the observer's eigenvalues bound it
from above."""

from __future__ import annotations

from rtctl.control.display import is_admittance
from rtctl.control.jit import compiled
from rtctl.control.pace import BRAKE_TIMES, MEAN_TIMES, eased
from rtctl.control.records import Record
from rtctl.control.resting import slides_on

BRAKE_GATES = 8.0
"""The push beyond the dead band that takes all help back, in widths of the gate: four fifths of the
friction."""


@compiled
def unbraked_share(t: Record, s: Record, p: Record, axis: int) -> float:
    """Advance `friction_brake` of the state; return the share of the help that is left, 0 to 1. A torque that
    is no number brakes nothing."""
    # a hand that gives way to a virtual spring brakes nothing
    pushed = t.hand_torque_nm[axis] + t.coupling_torque_nm[axis]
    # low-passed, then clipped: the other order brakes at each half ring (5.7)
    push = s.friction_push_nm[axis] = eased(p, axis, s.friction_push_nm[axis], pushed, BRAKE_TIMES)
    wanted = 0.0
    # else h is where the joint slid to, not where it goes
    if slides_on(s, p, axis) and not is_admittance(s, axis):
        against = -push if s.bristle_share[axis] > 0.0 else push
        beyond = against - p.friction_gate_deadband_nm[axis]
        if beyond > 0.0 and p.friction_brake_nm[axis] > 0.0:
            wanted = min(beyond / p.friction_brake_nm[axis], 1.0)
    # quicker, it came and went with a ring of 16 Hz (5.7)
    alpha = min(p.friction_gate_alpha[axis], MEAN_TIMES * p.rest_alpha[axis])
    s.friction_brake[axis] += alpha * (wanted - s.friction_brake[axis])
    return 1.0 - s.friction_brake[axis]
