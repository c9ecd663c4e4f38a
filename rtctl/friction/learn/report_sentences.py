"""What a report says in words: each sentence follows from the rows of the tables below it, and from nothing
else."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rtctl.friction.kind_table import FORMULAS, is_machine
from rtctl.friction.learn import report_beside_speed, report_tables
from rtctl.friction.learn.report_evidence import Evidence
from rtctl.friction.learn.report_judge import Judgement, elsewhere, faults, headed, judge
from rtctl.friction.learn.report_judged_cause import cause
from rtctl.friction.learn.warmth import TEMPERATURE_SPAN_K, at_middle
from rtctl.friction.model import FrictionModel
from rtctl.friction.points import FrictionPoints

AGREES = 1.5
"""Factor within which an error on the test points is what the held-out error said."""

TOLD = {2: 51, 3: 64, 4: 76}
"""Share of simulated joints, %, by number of sessions, whose held-out error was within `AGREES` of what the
next sessions erred (decision 0123)."""

Row = Mapping[str, Any]


def headline(evidence: Evidence) -> list[str]:
    """Everything the page says first: how the model was chosen, and what the test points say of it."""
    held_out, chosen = report_tables.ladder_rows(evidence), evidence.chosen
    if evidence.model.selection:
        said = [evidence.model.selection]
    else:
        said = [f"One {chosen} per direction, not compared by a search.", *of_formulas(held_out, chosen)]
    if evidence.test is not None:
        rows = report_tables.overall_rows(evidence)
        told = bool(
            cause(evidence.model, evidence.test)
            or elsewhere(judge(evidence.model, evidence.test))
            or of_test_warmth(evidence)
        )
        said += [of_test(rows, chosen), of_test_formulas(rows)]
        # what a ladder expects of the next session is more than was held out where sessions are few, or wear
        expected_nm = evidence.ladder.expected_next_nm if evidence.ladder else 0.0
        said += [of_agreement(rows, held_out, chosen, evidence.folds, told=told, expected_nm=expected_nm)]
        said += [of_verdict(evidence.model, evidence.test), of_test_warmth(evidence)]
    left_out = evidence.points.left_out
    said += [
        # a ladder has said between what the next session errs
        "" if evidence.ladder else of_few_sessions(evidence.points, evidence.folds),
        of_bound(report_tables.model_rows(evidence)),
        of_left_out(0 if left_out is None else int(left_out.sum()), len(evidence.points.direction)),
    ]
    if evidence.beside is not None:
        said += report_beside_speed.sentences(*evidence.beside, deployed=evidence.model.load is not None)
    return [sentence for sentence in said if sentence]


def of_few_sessions(points: FrictionPoints, folds: str) -> str:
    """How far the held-out error of few sessions is to be trusted; empty where there are many, or where none
    was held out."""
    sessions = len(set(points.columns["log"])) if folds == "log" else 0
    if sessions not in TOLD:
        return ""
    return (
        f"{sessions} sessions say little of the next one: on {TOLD[sessions]} % of simulated joints with as "
        f"many, what the next sessions erred was within a factor {AGREES} of what was held out. Record more "
        "before you trust that figure."
    )


def of_formulas(held_out: Sequence[Row], chosen: str) -> list[str]:
    """Whether a formula errs less than a model that no search compared with it."""
    mine = _row(held_out, chosen)
    formulas = [row for row in held_out if row["family"] in FORMULAS and not row["refused"]]
    if mine is None or mine["refused"] or not formulas or chosen in FORMULAS:
        return []
    # by the held-out error alone: no search counted numbers or compared within a doubt
    best = min(formulas, key=lambda row: float(row["held_out_rmse_nm"]))
    figures = (
        f"{best['family']}, {mnm(best['held_out_rmse_nm'])} against {mnm(mine['held_out_rmse_nm'])} mN m "
        "held out"
    )
    if best["held_out_rmse_nm"] <= mine["held_out_rmse_nm"]:
        return [f"A formula errs no more: {figures}; compare them with --ladder."]
    return [f"No formula errs as little: the best is {figures}."]


def of_test(rows: Sequence[Row], chosen: str) -> str:
    """How the reported model does on the test points, beside the best model there."""
    mine = _row(rows, chosen)
    if mine is None:
        return f"On the test points nothing is said of {chosen}: it could not be trained on all points."
    best = min(rows, key=_test_nm)
    said = f"On the test points {chosen} errs {mnm(_test_nm(mine))} mN m RMS, "
    if best is mine or len(rows) == 1:
        return said + f"the least of {len(rows)} models."
    least = f"the least has {best['family']}, {mnm(_test_nm(best))} mN m"
    if _test_nm(mine) <= _test_nm(best) + best["prediction_se_nm"]:
        return said + f"within one standard error of the best of {len(rows)} models ({least})."
    return said + f"{_test_nm(mine) / _test_nm(best):.2g} times the best of {len(rows)} models: {least}."


def of_test_formulas(rows: Sequence[Row]) -> str:
    """Whether a formula is as good as the best learned curve on the test points; empty where there is none of
    either."""
    said = formula_or_machine(rows)[1]
    return f"There {said}" if said else ""


def formula_or_machine(rows: Sequence[Row]) -> tuple[str, str]:
    """Who errs less, "formula" (also where it is as good), "machine", or "" where one of them is missing; and
    that in words."""
    formulas = [row for row in rows if row["family"] in FORMULAS]
    machines = [row for row in rows if is_machine(row["family"])]
    if not formulas or not machines:
        return "", ""
    formula, machine = min(formulas, key=_test_nm), min(machines, key=_test_nm)
    figures = f"{mnm(_test_nm(formula))} against {mnm(_test_nm(machine))} mN m"
    if _test_nm(formula) <= _test_nm(machine):
        return "formula", f"a formula is the best: {formula['family']} beats {machine['family']}, {figures}."
    # the machine's own error: what it might have erred on other points of that session
    if _test_nm(formula) <= _test_nm(machine) + machine["prediction_se_nm"]:
        near = f"{formula['family']} is within one standard error of {machine['family']}"
        return "formula", f"a formula is as good: {near}, {figures}."
    times = f"{_test_nm(formula) / _test_nm(machine):.2g} times as much"
    return (
        "machine",
        f"no formula is as good: the best, {formula['family']}, errs {times} as {machine['family']}, "
        f"{figures}.",
    )


def of_agreement(
    rows: Sequence[Row],
    held_out: Sequence[Row],
    chosen: str,
    folds: str = "speed",
    *,
    told: bool = False,
    expected_nm: float = 0.0,
) -> str:
    """Whether the held-out error, of `folds`, or what was expected of the next session where that is more
    (N m), said what the test points brought; no more than by how much where it is `told` why it did not."""
    # a held-out error of 0 is one of points that a computer made: no factor of it is said
    mine, before = _row(rows, chosen), _row(held_out, chosen)
    if mine is None or before is None or not before["held_out_rmse_nm"]:
        return ""
    held_out_nm = float(before["held_out_rmse_nm"])
    before_nm = max(held_out_nm, expected_nm)
    of = "its held-out error" if held_out_nm >= expected_nm else "what was expected of the next session"
    times = _test_nm(mine) / before_nm
    said = f"That is {times:.2g} times {of} ({mnm(before_nm)} mN m)"
    if times > AGREES and told:
        return f"{said}."
    if times > AGREES:
        advice = "" if folds == "log" else ", and hold out whole logs"
        return f"{said}, which says too little of another session: trust the test points{advice}."
    if times < 1 / AGREES:
        return f"{said}: the test points are easier than the points it was learned from."
    return f"{said}: the two agree."


def of_verdict(model: FrictionModel, test: FrictionPoints) -> str:
    """What `rtctl fit --judge` says of the model on the test points; empty where nothing speaks against
    it."""
    found = judge(model, test)
    said = faults(found)
    if not said:
        return ""
    why = cause(model, test) or "; ".join(said)
    return f"The model {headed(found)} on the test points (rtctl fit --judge): {why}."


def of_test_warmth(evidence: Evidence) -> str:
    """Test points that are warmer or colder than those learned from, and what the model does with what a
    kelvin changes taken off them; empty where they are not, or where nobody measured it."""
    test, warmth, model = evidence.test, evidence.beside and evidence.beside[1], evidence.model
    if (
        test is None
        or warmth is None
        or not (evidence.points.temperature_range_c and test.temperature_range_c)
    ):
        return ""
    over_k = float(np.nanmean(test.columns["temperature_c"])) - warmth.middle_c
    if abs(over_k) < TEMPERATURE_SPAN_K:
        return ""
    said = f"The test points are {abs(over_k):.0f} K {'warmer' if over_k > 0 else 'colder'} on average"
    if warmth.reason:
        return f"{said} than those it was learned from, of which nobody knows what a kelvin changes."
    beyond = ", beyond the temperatures it was found at," if abs(over_k) > warmth.span_k else ""
    before, found = judge(model, test), judge(model, at_middle(model, test, warmth))
    left = f"{headed(found)}: {'; '.join(faults(found))}" if faults(found) else "holds"
    return (
        f"{said}: with what a kelvin changes{beyond} taken off, the model errs {mnm(_judged_nm(found))} mN m "
        f"there and not {mnm(_judged_nm(before))}, and {left}."
    )


def _judged_nm(found: Sequence[Judgement]) -> float:
    """RMS error of both directions together, N m."""
    judged = [(one.points - one.outside - one.slower, one.rmse_nm or 0.0) for one in found]
    return math.sqrt(sum(n * rmse**2 for n, rmse in judged) / max(sum(n for n, _ in judged), 1))


_BOUNDS = {
    "train_max_error_nm": "the points it was learned from",
    "validation_max_error_nm": "what was held out of them",
    "test_max_error_nm": "the test points",
    "single_max_error_nm": "single measurements, which the points are means of",
    # only then the largest: of many held out the largest lies beyond a band of 95 % of them
    "band_most_nm": "the band, which is stretched as there was little to hold out",
}


def of_bound(model: Mapping[str, Sequence[float | None]]) -> str:
    """The error that the recommended gain leaves room for, and what it was found on."""
    found = {name: max(known) for name in _BOUNDS if (known := _known(model.get(name, ())))}
    # the largest is what `error_max_nm` is: of that alone the bound is made
    at = max(found, key=lambda name: found[name])
    return (
        f"The largest known error, which gain and bound leave room for, is {mnm(found[at])} mN m, on "
        f"{_BOUNDS[at]}."
    )


def of_left_out(left_out: int, points: int) -> str:
    """How many points nothing was learned from; empty for none."""
    if not left_out:
        return ""
    return (
        f"{left_out} of {points} points {'is' if left_out == 1 else 'are'} left out: far from what the "
        "neighbours in speed say."
    )


def _known(values: Sequence[float | None]) -> list[float]:
    return [value for value in values if value is not None]


def _row(rows: Sequence[Row], family: str) -> Row | None:
    return next((row for row in rows if row["family"] == family), None)


def _test_nm(row: Row) -> float:
    return float(row["prediction_rmse_nm"])


def mnm(value: float) -> str:
    """An error in N m as mN m, three digits."""
    return f"{1e3 * value:.3g}"
