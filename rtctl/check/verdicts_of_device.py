"""Rows of what the device of an axis does to what it is told."""

from __future__ import annotations

import math

from rtctl.check.verdict import Outcome, Subject, Verdict
from rtctl.check.verdicts_of_observer import observes
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


def remembered(s: Subject) -> list[Verdict]:
    """A torque that acts later than the law remembers is taken for a younger one by every account: no row
    that rests on them then speaks of this rig."""
    from rtctl.control.proofs.stability import lag_ticks  # the names of a report must not load the compiler
    from rtctl.control.take_back import LATE_MOST

    acting = s.axis.delay_ticks + lag_ticks(s.axis.current_loop_hz, s.period_s)
    if acting <= LATE_MOST:
        return []
    # fewer and longer ticks: the same time is remembered in less of them
    hz = math.floor(LATE_MOST / (acting * s.period_s))
    told = (
        f"delay and lag of {acting:.3g} ticks: the accounts of energy and the observer take the torque for "
        f"at most {LATE_MOST} ticks late; loop.rate_hz = {hz} at most, or a quicker drive"
    )
    return [
        s.row(
            "torque that acts late, remembered",
            f"{acting:.3g} ticks",
            f"<= {LATE_MOST}",
            Outcome.NOT_PROVED,
            told,
            acting / LATE_MOST,
            f"{s.where}: axis {s.axis.name}: {told}",
        )
    ]


def overshoot(s: Subject) -> list[Verdict]:
    """A current that exceeds its steps is counted on in the proof of the coupling, and there alone."""
    over, lag_hz = s.axis.current_overshoot, s.axis.current_loop_hz
    if over == 0:
        return []
    others = observes(s) or s.table.may_show("admittance")
    outcome = Outcome.FAIL if lag_hz == 0 else Outcome.NOT_PROVED if others else Outcome.PASS
    told = "drive.current_overshoot without a lag: set drive.current_loop_hz to 1/(2 pi) of the loop's lag"
    return [
        s.row(
            "current that overshoots",
            f"{over:.2g} of a step",
            "of the coupling's proof",
            outcome,
            told
            if lag_hz == 0
            else "the coupling is proved with it; observer and admittance are for a loop of first order",
            over,
            f"{s.where}: axis {s.axis.name}: {told}" if lag_hz == 0 else "",
        )
    ]
