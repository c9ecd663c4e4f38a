"""Test of a compensation that goes by the torque through the gear."""

from __future__ import annotations

import math

from rtctl.check.verdict import Outcome, Subject, Verdict
from rtctl.friction.load import LOOP_MOST


def load(s: Subject) -> list[Verdict]:
    """What the compensation of load adds to the load is a small share of it: the sum settles, and a hand's
    torque comes back smaller."""
    found, gain = s.axis.friction, s.table.friction.load_gain
    # NaN, too: nothing is compensated
    if not gain > 0:
        return []
    by_load = found is not None and found.load_share > 0
    share = found.load_share if found is not None else 0.0  # without a model nothing is added
    # what it adds to itself in a tick: below 1 the sum settles, and half of that is room
    passed, most = share <= LOOP_MOST, LOOP_MOST
    # the share is linear in the gain; rounded down: what is advised passes
    bound = math.floor(1e3 * gain * most / share) / 1e3 if share > 0 else gain
    if not by_load:
        meaning = (
            "goes by no load: that takes a feed-forward, and a model that knows load (`rtctl fit --by-load`)"
        )
    elif passed:
        meaning = (
            "N m that the compensation adds for each N m through the gear; the coupling is judged as so "
            "much stiffer as the motor's part of it is, and friction is credited as without load"
        )
    else:
        meaning = f"what it adds comes back as load, and as the hand's torque: load_gain up to {bound:g}"
    return [
        s.row(
            "compensation of load",
            f"{share:.3g}",
            f"<= {most:g}",
            (Outcome.PASS if passed else Outcome.FAIL) if by_load else Outcome.WARN,
            meaning,
            share / most,
            ""
            if passed
            else f"{s.where}.friction.load_gain: axis {s.axis.name}: {gain:g} adds {share:.3g} N m for each "
            f"N m through the gear, the bound is {most:g}: load_gain up to {bound:g}",
        )
    ]
