"""The friction models themselves: curves, support vectors, errors (Bi, Figs. 2 to 5, Tables I and II)."""

from __future__ import annotations

from rtctl.experiments import models
from rtctl.experiments.order import Order
from rtctl.experiments.report import Outcome, Part
from rtctl.friction import ladder as climbing
from rtctl.friction import mock_points, report_evidence, report_figures, report_tables
from rtctl.friction.points import FrictionPoints
from rtctl.friction.report_evidence import Evidence
from rtctl.friction.report_page import Picture

TITLE = "Friction models"
SHOWN = ("epsilon-rbf", "epsilon-spline", "nu-rbf")
TEST_LEVELS = 28
TEST_SEED = 7


def run(order: Order) -> Outcome:
    """Learn every compared model from measured points and judge it on others, measured by another noise.

    Raises
    ------
    ConfigError, DataError
        Not a simulated rig; points that cannot be used.
    """
    order.require_simulated("friction-model")
    points, found = models.climb(order)
    order.progress(0.5, "measuring other points")
    test = _test_points(order)
    model = climbing.learn(points, found, rig=order.loaded.config.rig.name)
    evidence = report_evidence.gather(points, model, found, test, found.folds)
    order.progress(0.9, "drawing")
    outcome = _outcome(evidence)
    order.progress(1.0, "friction models")
    return outcome


def _test_points(order: Order) -> FrictionPoints:
    again = order.loaded.model_copy(update={"options": {**order.loaded.options, "seed": TEST_SEED}})
    rows = [
        (p.velocity_rad_s, abs(p.friction_torque_nm), p.direction, p.std_nm, p.count)
        for p in mock_points.measure(again, levels=TEST_LEVELS)
    ]
    return FrictionPoints.from_rows(rows, "measured on the simulated rig by another noise", "")


def _outcome(evidence: Evidence) -> Outcome:
    families = [name for name in SHOWN if evidence.of(name)]
    curves = tuple(_curves(evidence, name) for name in families)
    vectors = tuple(report_tables.support_vectors(name, evidence.of(name)) for name in families)
    errors = (
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
        f"{len(evidence.points.branch(1)[0])} training and {TEST_LEVELS + 1} other points in each direction, each the mean of "
        f"100 measurements. Support vectors (v >= 0 and v < 0): {said}. Bi found 29 and 27 with the RBF and 10 and 9 with the "
        "spline kernel, of 54; the values of its tables are not published in a form that can be compared."
    )
    numbers = {
        "ladder": report_tables.ladder_rows(evidence),
        "errors": report_tables.error_rows(evidence),
        "errors_overall": report_tables.overall_rows(evidence),
        "support_vectors": counts,
    }
    parts = (
        Part("Learned curves (Figs. 2 to 5)", (text,), curves),
        Part("Errors (Tables I and II)", (), errors),
        Part("Support vectors", (), vectors),
    )
    return Outcome("friction-model", TITLE, evidence.model.selection, parts, (), numbers)


def _curves(evidence: Evidence, name: str) -> Picture:
    caption = (
        f"{name}: friction in N m against speed in rad/s, points, learned curve, epsilon tube and support vectors. Left: "
        f"every speed; right: below {evidence.boundary_rad_s:.3g} rad/s."
    )
    return Picture(f"friction_{name}", caption, report_figures.curves(evidence, name))
