"""The friction-model experiment: a set of test points per seed, and what is said of them."""

from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.experiments import friction_model
from rtctl.experiments.order import Order
from rtctl.friction.learn.report_evidence import Errors
from rtctl.friction.points import FrictionPoints
from rtctl.rig_file.config import load
from rtctl.simulation.mock_points import Point

CONFIG = Path(__file__).parents[3] / "configs/mock.toml"


def points(offset_nm):
    rows = [(d * v, 0.3 + offset_nm, d, 0.01, 100) for d in (1, -1) for v in (0.1, 0.5, 1.0)]
    return FrictionPoints.from_rows(rows, "made up", "")


def learned(direction, level_nm, error_nm=0.001):
    speed = np.array([0.1, 0.5])
    return SimpleNamespace(
        direction=direction,
        curve=lambda v: np.full(len(v), level_nm),
        trained=Errors(speed, np.full(2, error_nm)),
    )


def evidence(**levels_nm):
    of = {name: [learned(1, level), learned(-1, level)] for name, level in levels_nm.items()}
    return SimpleNamespace(families=list(of), of=of.__getitem__)


def test_each_seed_measures_test_points_of_its_own_noise(monkeypatch):
    seen = []

    @contextmanager
    def in_turn(*_arguments):
        yield lambda calls: (call(*given, **named) for call, given, named in calls)

    def measured(loaded, levels):
        seen.append(loaded.options["seed"])
        return [Point(d * v, d * 0.3, 0.01, 100, d) for d in (1, -1) for v in np.linspace(0.1, 1, levels)]

    monkeypatch.setattr(friction_model, "workers", in_turn)
    monkeypatch.setattr(friction_model.mock_points, "measure", measured)
    order = Order(load(CONFIG), seeds=4)
    assert len(friction_model._tests(order)) == 4
    assert len(set(seen)) == 4
    assert order.loaded.options["seed"] not in seen


def test_errors_are_means_over_the_sets_with_an_interval():
    sets = [points(0.001), points(0.003)]
    found = friction_model.predicted(evidence(tustin=0.3), sets)["tustin"]
    error = found["prediction_mean_error_nm"]
    assert error.mean == pytest.approx(0.002)
    assert error.count == 2
    assert error.half == pytest.approx(12.706 * 0.001, rel=1e-3)
    assert found["prediction_over_training"].mean == pytest.approx(2.0)


def test_how_many_measurements_a_point_is_of_is_what_the_points_say():
    told = points(0.0)
    assert friction_model._means(told) == ", each the mean of 100 measurements"
    told.count[0] = 90
    assert friction_model._means(told) == ", each the mean of 90 to 100 measurements"
    told.count[:] = np.nan
    assert friction_model._means(told) == ""


@pytest.mark.parametrize(
    ("machine_nm", "formula_nm", "said"),
    [(0.3, 0.4, "SVR wins"), (0.4, 0.3, "does not win"), (0.2995, 0.3005, "cannot tell")],
)
def test_the_text_says_who_predicts_best(machine_nm, formula_nm, said):
    sets = [points(offset) for offset in (-0.002, 0.001, 0.002)]
    levels = {"epsilon-spline": machine_nm, "tustin": formula_nm}
    assert said in friction_model._said(friction_model.predicted(evidence(**levels), sets))
    assert "cannot tell" in friction_model._said(friction_model.predicted(evidence(**levels), sets[:1]))
