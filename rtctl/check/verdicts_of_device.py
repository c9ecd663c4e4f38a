"""Rows of what the device of an axis does to what it is told."""

from __future__ import annotations

import math

from rtctl.check.verdict import Outcome, Subject, Verdict
from rtctl.check.verdicts_of_units import amperes_of


def cut(s: Subject) -> list[Verdict]:
    """What the device cuts off is a torque that the law believes in, until the current measured says no."""
    # nothing is known of what it cuts: no row, rather than one that passes
    if math.isinf(s.cut_a):
        return []
    share, name = amperes_of(s) / s.cut_a, "current that the device lets through"
    reached_nm = s.table.torque_limit_nm / share
    told = (
        f"current_max_a: the device cuts larger commands to {s.cut_a:g} A, which is {reached_nm:.3g} N m, "
        f"and torque_limit_nm is {s.table.torque_limit_nm:g}: lower torque_limit_nm, or raise "
        "current_max_a where motor and drive may have it"
    )
    fits = share <= 1 + 1e-9  # 2 N m of 2 N m is not cut by rounding
    return [
        s.row(
            name,
            f"{share:.3g}",
            "up to 1",
            # no FAIL: a current that is measured tells it (ACTUATOR_LAG)
            Outcome.PASS if fits else Outcome.WARN,
            "current at the torque limit over current_max_a of the device" if fits else told,
            share,
            "" if fits else f"{s.where}: axis {s.axis.name}: {told}",
        )
    ]
