"""Row of the help with friction in the hand that moves the joint: measured, as nothing is proved."""

from __future__ import annotations

from rtctl.check.verdict import Outcome, Subject, Verdict

SHAKEN = {"hybrid": (26, 588), "observer": (18, 217)}
"""By policy: hands of the box that were shaken beyond both references, of so many that moved certified rigs
on joints of another make (`tests/foreign_shaken.py`, decision 0094)."""


def moved(s: Subject) -> list[Verdict]:
    """No figure of a rig file tells which hand is shaken, so that no rig passes, and none is refused."""
    policy = s.table.friction.policy
    if not s.axis.compensates or policy not in SHAKEN:
        return []
    shaken, hands = SHAKEN[policy]
    return [
        s.row(
            "help in the hand that moves the joint",
            f"{shaken / hands:.1%} of hands",
            "none shaken",
            Outcome.NOT_PROVED,
            f"{shaken} of {hands} random hands on certified rigs with this policy were shaken by 20 mrad/s "
            "(2 after the motion) more than without help, and with hardly any friction; no figure of a rig "
            "file tells which; half of gain and observer.gain shakes a fifth as many",
        )
    ]
