"""Prediction against training error and support vectors over ten identifications: one alone says little.

The same figures by hand: rtctl experiment identification configs/mock-identify.toml --simulate --out DIR
"""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from rtctl.cli import cli

CONFIG = Path(__file__).parents[2] / "configs" / "mock-identify.toml"
MACHINES = ("epsilon-spline", "nu-spline", "epsilon-rbf", "nu-rbf")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    out = tmp_path_factory.mktemp("repeated") / "report"
    done = CliRunner().invoke(
        cli, ["experiment", "identification", str(CONFIG), "--simulate", "--out", str(out), "--json"]
    )
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)["experiments"]["identification"]["models"]


@pytest.mark.parametrize("name", [*MACHINES, "lorentzian", "chosen"])
def test_no_model_errs_more_on_other_speeds_than_the_figure_allows(models, name):
    assert models[name]["runs"] == 10
    assert models[name]["prediction_over_training"]["mean"] <= 1.15


@pytest.mark.parametrize("name", MACHINES)
def test_no_machine_needs_more_support_vectors_than_the_figure_allows(models, name):
    assert models[name]["support_vectors"]["mean"] <= (12 if name.endswith("spline") else 30)


def test_the_chosen_curve_is_near_the_true_friction_in_every_run(models):
    assert models["chosen"]["off_share"] <= 0.02
