"""Rows of what the device of an axis does to what it is told."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from rtctl.check.verdict import Outcome, Subject, Verdict
from rtctl.check.verdicts_of_observer import observes
from rtctl.check.verdicts_of_units import amperes_of
from rtctl.control.proofs import stability
from rtctl.rig_file.axis_tables import OVERSHOOT_UNTOLD
from rtctl.rounded import up


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


def pulse_in_steps(s: Subject) -> list[Verdict]:
    """Whether the arming test is large enough for the steps in which the current is measured."""
    from rtctl.check import axis_plan  # the names of a report must not load the compiler
    from rtctl.control.proofs.stability import lag_ticks

    step_a, table, between = s.shown.current_step_a, s.table, s.axis.between
    # nothing is known of the steps, or nothing is sent
    if not (s.passivity and step_a and step_a[0] > 0 and table.arming_share > 0):
        return []
    T = s.period_s
    part_s = T * axis_plan.arming_ticks([between], T, axis_plan.ARMING_PART_S)
    times = T, part_s, T * (between.delay + lag_ticks(between.lag_hz, T))
    step_nm = table.torque_limit_nm / amperes_of(s) * step_a[0]

    def steps(budget_j: float) -> float:
        return axis_plan.gentle_pulse(table, s.joint, times, budget_j)[1] / step_nm

    found, least = steps(s.passivity.budget_j), 0.5 / table.drive.current_gain_error
    told = (
        f"the current is measured in steps of {step_a[0]:.3g} A, {step_nm:.3g} N m: half of one is more than "
        f"drive.current_gain_error allows of so small a test pulse, which may be refused (CURRENT, WIRING); "
        + _budget_that_does(steps, least)
    )
    return [
        s.row(
            "test pulse of arming in steps of the current",
            f"{found:.3g}",
            f">= {least:.3g}",
            Outcome.PASS if found >= least else Outcome.WARN,
            "torque of the arming test over a step of the current" if found >= least else told,
            least / found,
            "" if found >= least else f"{s.where}: axis {s.axis.name}: {told}",
        )
    ]


def _budget_that_does(steps: Callable[[float], float], least: float) -> str:
    """Remedy of a test pulse that its account makes too small: the least budget with so many steps."""
    most_j = 100.0  # of the rig file
    if steps(most_j) < least:
        return "a current of finer steps, or a larger arming_share"
    low, high = 1e-6, most_j
    for _ in range(40):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if steps(middle) >= least else (middle, high)
    return f"passivity.budget_j = {up(high)} makes it large enough"


def overshoot(s: Subject) -> list[Verdict]:
    """A current that exceeds its steps, or may, is counted on in the proof of the coupling, and there
    alone."""
    over, lag_hz = s.table.drive.current_overshoot, s.axis.current_loop_hz
    # without a lag nothing can exceed anything, and a loop that is surely of first order has no row
    if over == 0 or (lag_hz == 0 and over <= OVERSHOOT_UNTOLD):
        return []
    others = observes(s) or s.table.may_show("admittance")
    outcome = Outcome.FAIL if lag_hz == 0 else Outcome.NOT_PROVED if others else Outcome.PASS
    told = "drive.current_overshoot without a lag: set drive.current_loop_hz to 1/(2 pi) of the loop's lag"
    alone = "the coupling is proved with it; observer and admittance are for a loop of first order"
    if over == OVERSHOOT_UNTOLD:
        alone += "; the test pulse sees no less: current_overshoot = 0 where `rtctl probe --pulses` tells it"
    return [
        s.row(
            "current that overshoots",
            f"{over:.2g} of a step",
            "of the coupling's proof",
            outcome,
            told if lag_hz == 0 else alone,
            over,
            f"{s.where}: axis {s.axis.name}: {told}" if lag_hz == 0 else "",
        )
    ]


def of_first_order(s: Subject) -> str:
    """Remedy of a coupling that would pass behind a current loop of first order, where the file does not say
    of which it is; else nothing."""
    axis, b, b_c = s.axis, s.axis.device_damping_nms_rad, s.axis.damping_nms_rad
    if s.table.drive.current_overshoot != OVERSHOOT_UNTOLD or axis.current_loop_hz == 0:
        return ""
    plain, counted = (
        stability.k_max_between(b, b_c, s.period_s, replace(axis.between, overshoot=over))
        for over in (0.0, OVERSHOOT_UNTOLD)
    )
    if axis.stiffness_nm_rad * counted > axis.sampled_data_k_max_nm_rad * plain:
        return ""
    return (
        "; it passes with drive.current_overshoot = 0, behind a current loop of first order: "
        "`rtctl probe --pulses 50` tells whether it is one"
    )
