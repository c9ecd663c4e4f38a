"""The friction models themselves: curves, support vectors, errors (Bi, Figs. 2 to 5, Tables I and II)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.experiments import identification, models
from rtctl.experiments.order import Order
from rtctl.experiments.report import Outcome, Part
from rtctl.experiments.statistics import Estimate, estimate
from rtctl.friction.kind_table import is_machine
from rtctl.friction.learn import ladder as climbing
from rtctl.friction.learn import report_evidence, report_figures, report_tables
from rtctl.friction.learn.pool import workers
from rtctl.friction.learn.report_evidence import Evidence
from rtctl.friction.learn.report_page import Picture
from rtctl.friction.learn.report_tables import Table
from rtctl.friction.points import FrictionPoints
from rtctl.rig_file.config import LoadedConfig
from rtctl.simulation import mock_points

TITLE = "Friction models"
SHOWN = ("epsilon-rbf", "epsilon-spline", "nu-rbf")
TEST_LEVELS = 28


def run(order: Order) -> Outcome:
    """Learn every compared model from one set of points and judge it on others, measured once with every
    seed.

    Raises
    ------
    ConfigError, DataError
        Not a simulated rig; points that cannot be used."""
    order.require_simulated("friction-model")
    points, found = models.climb(order)
    # after the climb: what is tested on other points was chosen without them
    tests = _tests(order)
    model = climbing.learn(points, found, rig=order.loaded.config.rig.name)
    evidence = report_evidence.gather(points, model, found, tests[0], found.folds)
    order.progress(0.9, "drawing")
    outcome = _outcome(evidence, tests)
    order.progress(1.0, "friction models")
    return outcome


def _tests(order: Order) -> list[FrictionPoints]:
    """Other speeds, measured with another noise per seed: none of them that of the training points."""
    import joblib

    first = int(order.loaded.options.get("seed", 0)) + 1  # not the training points' own noise
    # one after the other, so that a page can be made anew: no seed is drawn
    seeds = range(first, first + order.seeds)
    found: list[FrictionPoints] = []
    order.progress(0.3, "measuring other points")
    with workers("loky", min(order.seeds, joblib.cpu_count())) as pool:
        for one in pool(joblib.delayed(other_points)(order.loaded, seed) for seed in seeds):
            found.append(one)
            order.progress(0.3 + 0.6 * len(found) / order.seeds, f"test points {len(found)} of {order.seeds}")
    return found


def other_points(loaded: LoadedConfig, seed: int) -> FrictionPoints:
    """Points of the simulated rig with this seed's noise, at speeds between those of the training points."""
    # `mock_points` turns a joint by whole turns
    if loaded.config.axis[0].motion == "linear":
        return identification.measured(loaded, seed).of("test")
    again = loaded.model_copy(update={"options": {**loaded.options, "seed": seed}})
    rows = [
        (p.velocity_rad_s, abs(p.friction_torque_nm), p.direction, p.std_nm, p.count)
        for p in mock_points.measure(again, levels=TEST_LEVELS)
    ]
    return FrictionPoints.from_rows(rows, f"measured on the simulated rig, seed {seed}", "")


def predicted(evidence: Evidence, tests: Sequence[FrictionPoints]) -> dict[str, dict[str, Estimate]]:
    """Mean absolute error (N m) of each family over both directions, and its ratio to training, over the test
    sets."""
    found = {}
    for family in evidence.families:
        both = evidence.of(family)
        # of all points, not the mean of two means: a direction may have fewer
        trained_nm = float(np.mean(np.abs(np.concatenate([one.trained.error_nm for one in both]))))
        means_nm = []
        for test in tests:
            sides = [(one.curve, *test.branch(one.direction)) for one in both]
            errors = [np.abs(curve(speed) - friction_nm) for curve, speed, friction_nm in sides]
            means_nm.append(float(np.mean(np.concatenate(errors))))
        found[family] = {
            "prediction_mean_error_nm": estimate(means_nm),
            "prediction_over_training": estimate(np.array(means_nm) / trained_nm),
        }
    return found


def _over_seeds(found: dict[str, dict[str, Estimate]], sets: int) -> Table:
    caption = (
        "Mean absolute prediction error over all speeds and both directions, and its ratio to the training "
        f"error: mean over {sets} sets of test points, each with its own noise, with the 95 % interval. The "
        "training points are one set."
    )
    rows = [
        (family, one["prediction_mean_error_nm"].text(1e3), one["prediction_over_training"].text())
        for family, one in found.items()
    ]
    return Table(caption, ("model", "prediction error, mN m", "prediction / training"), rows)


def _said(found: dict[str, dict[str, Estimate]]) -> str:
    """Say whether a support-vector machine predicts best, and by how much the best formula differs."""
    mean = {family: one["prediction_mean_error_nm"] for family, one in found.items()}
    machines = [family for family in mean if is_machine(family)]
    formulas = [family for family in mean if family not in machines]
    if not machines or not formulas:
        return ""
    machine, formula = (min(names, key=lambda name: mean[name].mean) for names in (machines, formulas))
    said = (
        f"{machine} predicts best of the support-vector machines ({mean[machine].text(1e3)} mN m), "
        f"{formula} of the formulas ({mean[formula].text(1e3)} mN m)"
    )
    # one set has no interval (half of it is 0), and would always tell
    if mean[machine].count < 2:
        return f"{said}: one set of test points cannot tell them apart."
    # intervals that do not meet: of a ratio of two means nothing less is said
    if mean[machine].high < mean[formula].low:
        return f"{said}: SVR wins here."
    if mean[formula].high < mean[machine].low:
        return f"{said}: SVR does not win here."
    return f"{said}: these test points cannot tell them apart."


def _outcome(evidence: Evidence, tests: Sequence[FrictionPoints]) -> Outcome:
    predictions = predicted(evidence, tests)
    families = [name for name in SHOWN if evidence.of(name)]
    curves = tuple(_curves(evidence, name) for name in families)
    vectors = tuple(report_tables.support_vectors(name, evidence.of(name)) for name in families)
    errors = (
        _over_seeds(predictions, len(tests)),
        report_tables.overall(evidence),
        report_tables.errors(evidence),
        Picture(
            "friction_ladder",
            "Held-out RMSE in mN m of every model, with 95 % confidence intervals.",
            report_figures.ladder(evidence),
        ),
        report_tables.ladder(evidence),
    )
    counts = {name: [len(one.limit) for one in evidence.of(name)] for name in families}
    said = ", ".join(f"{name} {' and '.join(map(str, count))}" for name, count in counts.items())
    text = (
        f"{len(evidence.points.branch(1)[0])} training and {len(tests[0].branch(1)[0])} other points in "
        f"each direction{_means(evidence.points)}. Support vectors (v >= 0 and v < 0): {said}. Bi "
        "found 29 and 27 with the RBF and 10 and 9 with the spline kernel, of 54; the values of its tables "
        "are not published in a form that can be compared."
    )
    numbers = {
        "ladder": report_tables.ladder_rows(evidence),
        "errors": report_tables.error_rows(evidence),
        "errors_overall": report_tables.overall_rows(evidence),
        "errors_over_seeds": predictions,
        "support_vectors": counts,
    }
    parts = (
        Part("Learned curves (Figs. 2 to 5)", (text,), curves),
        Part("Errors (Tables I and II)", (_said(predictions),), errors),
        Part("Support vectors", (), vectors),
    )
    return Outcome("friction-model", TITLE, evidence.model.selection, parts, (), numbers)


def _means(points: FrictionPoints) -> str:
    """How many measurements each point is the mean of; empty where the points do not say."""
    least, most = float(np.min(points.count)), float(np.max(points.count))
    # NaN, too: a file of points need not have the column
    if not least > 0:
        return ""
    return f", each the mean of {least:g}{f' to {most:g}' if most > least else ''} measurements"


def _curves(evidence: Evidence, name: str) -> Picture:
    caption = (
        f"{name}: friction in N m against speed in rad/s, points, learned curve, epsilon tube and support "
        f"vectors. Left: every speed; right: below {evidence.boundary_rad_s:.3g} rad/s."
    )
    return Picture(f"friction_{name}", caption, report_figures.curves(evidence, name))
