"""The whole way on the simulated rig, as a user goes it: identify, learn, compare with the truth."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from rtctl.cli import cli

CONFIG = Path(__file__).parents[2] / "configs" / "mock-identify.toml"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    folder = tmp_path_factory.mktemp("identified") / "set"
    done = CliRunner().invoke(cli, ["identify", str(CONFIG), "--simulate", "--out", str(folder), "--json"])
    assert done.exit_code == 0, done.output
    return folder, json.loads(done.stdout)


@pytest.fixture(scope="module")
def fitted(dataset, tmp_path_factory):
    folder, out = dataset[0], tmp_path_factory.mktemp("fitted")
    arguments = [
        "fit", folder / "points_train.csv", "--rig", "mock", "--out", out / "m.json", "--config", CONFIG,
        "--test", folder / "points_test.csv", "--report", out / "report", "--kernel", "spline",
        "--search", "full", "--json",
    ]  # fmt: skip
    done = CliRunner().invoke(cli, [str(argument) for argument in arguments])
    assert done.exit_code == 0, done.output
    body = json.loads(done.stdout)
    return body, json.loads((out / "report" / "report.json").read_text())


def test_the_points_are_within_two_percent_of_coulomb_friction(dataset):
    summary = dataset[1]
    assert summary["complete"]
    assert (summary["train"], summary["test"]) == (2 * 55, 2 * 28)
    assert [one["direction"] for one in summary["truth"]] == [1, -1]
    assert all(one["rms_share"] <= 0.005 and abs(one["break_away_share"]) <= 0.01 for one in summary["truth"])


def test_the_curve_is_within_two_percent_of_coulomb_friction(fitted):
    assert [one["direction"] for one in fitted[0]["truth"]] == [1, -1]
    assert all(one["rms_share"] <= 0.02 for one in fitted[0]["truth"])


@pytest.mark.parametrize("family", ["epsilon-spline", "nu-spline"])
def test_it_predicts_other_speeds_as_well_as_those_it_saw(fitted, family):
    row = next(row for row in fitted[1]["errors_overall"] if row["family"] == family)
    assert row["prediction_over_training"] <= 1.15


@pytest.mark.parametrize("family", ["epsilon-spline", "nu-spline"])
def test_a_spline_needs_at_most_twelve_support_vectors(fitted, family):
    vectors = fitted[1]["support_vectors"][family]
    assert max(len(one["speed_rad_s"]) for one in vectors) <= 12


def test_residuals_against_position_and_time_are_in_the_report(fitted):
    assert fitted[1]["residuals_against"] == ["speed", "position_rad", "time_s"]
