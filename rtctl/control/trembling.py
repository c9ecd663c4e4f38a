"""A joint that goes on turning back more often than a hand can is not helped with friction: what shakes it is
no hand's wish.

    trembled <- trembled + h         at a turn that comes h <= 1/(2 SLOWEST_HZ) after the one before
    trembled <- trembled - FORGETTING T   where it has gone on by `ON_RAD` and for `ON_S` since its last turn
    share = clip((GONE_S - trembled)/(GONE_S - WHOLE_S), 0, 1)             of feed-forward and observer

Why. The certificates know the joint as one mass or two and the hand as a mass on a spring, and the account
knows energy. A gearbox with play, a mass held by a grip that hardly damps: what none of them knows may swing
on where help takes all friction and the sampled coupling all damping, for as long as the account breaks even.
Whatever it is, it is quicker than people move on purpose (4 to 7 Hz at most), and friction, which was there
to stop it, is better left to the joint then.

Why by time, not at once. A hand's own mass rings on its grip whenever the joint stops, for some tenths of a
second. Help that went each time and came back would kick such a hand. Why it does not come back at rest: what
shakes by itself would begin again. A hand that goes on has it back over half a second, after at most 1.5 s,
not at once: dry friction that lets go is a push by itself, and within 70 ms it was one of .8 F, on which a
hand that does not damp rang again at each stroke.

Only takes help away, so no proof is touched. Neither an encoder that flickers between two counts nor a joint
that bends its bristles a little turns: a turn is `TURN_COUNTS` or `REST_SHARE` of the credited presliding
length long. Without power nothing is remembered. A virtual mass has a watch of its own (docs/theory.md 14.5).
"""

from __future__ import annotations

from rtctl.control.display import is_admittance
from rtctl.control.handle import own_rad
from rtctl.control.jit import inlined
from rtctl.control.records import Record
from rtctl.control.resting import REST_SHARE
from rtctl.control.states import is_powered

TURN_COUNTS = 3.0
"""Encoder counts back that are a turn."""

SLOWEST_HZ = 8.0
"""Slower than this it is a hand's motion."""

WHOLE_S, GONE_S, MOST_S = 0.3, 0.5, 0.6
"""Trembling for so long changes nothing, takes all help, is remembered at most."""

ON_S, ON_RAD, FORGETTING = 0.25, 0.03, 0.4
"""A joint that has gone on for so long and so far is moved by a hand: a second of that forgets so much of
trembling, s."""

LONGEST_S = 0.5 / SLOWEST_HZ
"""Between two turns of a joint that trembles."""


@inlined
def calm_share(s: Record, p: Record, axis: int) -> float:
    """Advance what is remembered of trembling; return the share of the help that it leaves, 0 to 1. A
    position that is no number turns nothing."""
    s.turn_s[axis] += p.period_s
    way = -1.0 if s.turned[axis] != 0.0 else 1.0
    on = (s.position_rad[axis] - s.turn_rad[axis]) * way  # by position: a velocity would turn with each count
    if on > 0.0:
        s.turn_rad[axis] = s.position_rad[axis]
    elif on < -max(TURN_COUNTS * p.count_rad[axis], REST_SHARE * p.presliding_rad[axis]):
        if s.turn_s[axis] <= p.tremble_turn_s[axis]:  # 0 without a policy: nothing trembles
            # by the time of the half swing: quick ones count no faster
            s.trembled_s[axis] = min(s.trembled_s[axis] + s.turn_s[axis], MOST_S)
        s.turn_rad[axis], s.turned[axis], s.turn_s[axis] = s.position_rad[axis], 1.0 - s.turned[axis], 0.0
        s.turn_from_rad[axis] = s.position_rad[axis]
    if (
        on > 0.0
        and s.turn_s[axis] > ON_S
        and abs(s.turn_rad[axis] - s.turn_from_rad[axis]) > own_rad(p, axis, ON_RAD)
    ):
        s.trembled_s[axis] = max(s.trembled_s[axis] - FORGETTING * p.period_s, 0.0)
    if not is_powered(s.state):
        s.trembled_s[axis] = 0.0
    if s.trembled_s[axis] <= WHOLE_S or is_admittance(s, axis):  # asked last: what is remembered goes on
        return 1.0
    return max((GONE_S - s.trembled_s[axis]) / (GONE_S - WHOLE_S), 0.0)
