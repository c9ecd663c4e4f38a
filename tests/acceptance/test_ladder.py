"""The papers' comparison on the simulated rig: learned curves against its true static friction."""

from pathlib import Path

import numpy as np
import pytest

from hw.simulators.jit import records
from hw.simulators.mock_bristles import static_friction
from hw.simulators.mock_records import plant_records
from rtctl.friction.learn import ladder
from rtctl.friction.point_reader import read_points
from rtctl.friction.points import FrictionPoints
from rtctl.rig_file.config import load
from rtctl.simulation import mock_points

CONFIGS = Path(__file__).parents[2] / "configs"
FORMULAS = ("coulomb", "coulomb_viscous", "tustin", "gaussian", "lorentzian")
MACHINES = ("epsilon-spline", "epsilon-rbf")
COULOMB_NM = 0.25


@pytest.fixture(scope="module")
def loaded():
    return load(CONFIGS / "mock.toml")


@pytest.fixture(scope="module")
def points():
    return read_points(CONFIGS / "friction" / "mock_points.csv")


@pytest.fixture(scope="module")
def found(points):
    return ladder.ascend(
        points, ladder.Options(families=FORMULAS + MACHINES, strategy="full", backend="sequential")
    )


@pytest.fixture(scope="module")
def models(points, found):
    return {
        rung.family: ladder.learn(points, found, rig="mock", rung=rung)
        for rung in found.choice.rungs
        if not rung.refused
    }


@pytest.fixture(scope="module")
def test_set(loaded):
    """14 other speeds and break-away of both directions, measured by another noise."""
    again = loaded.model_copy(update={"options": {**loaded.options, "seed": 7}})
    return mock_points.measure(again, levels=14)


@pytest.mark.parametrize("family", MACHINES)
def test_the_learned_curve_is_within_2_percent_of_the_true_friction(loaded, models, family):
    params = records(plant_records(loaded.options, loaded.config.hardware())[0])
    params["modulation_share"] = 0  # points average over the whole turn
    speed = np.linspace(0.005, 2, 2000)
    for direction, branch in zip((1, -1), models[family].branches, strict=True):
        true_nm = np.array([abs(static_friction(direction * v, 0.0, params[0], 0)) for v in speed])
        assert np.sqrt(np.mean((branch.magnitude(speed) - true_nm) ** 2)) <= 0.02 * COULOMB_NM


@pytest.mark.parametrize("family", MACHINES)
def test_the_mean_prediction_error_is_about_the_mean_training_error(models, test_set, family):
    model = models[family]
    velocity = np.array([p.velocity_rad_s or p.direction * 1e-12 for p in test_set])
    measured_nm = np.abs([p.friction_torque_nm for p in test_set])
    prediction = np.mean(np.abs(model.magnitude(velocity) - measured_nm))
    training = np.mean([branch.train_mean_error_nm for branch in model.branches])
    assert len(test_set) == 2 * 15
    assert prediction <= 1.15 * training


def test_the_spline_kernel_needs_a_fifth_of_the_points_and_the_rbf_about_half(models):
    assert max(len(branch.support_vectors) for branch in models["epsilon-spline"].branches) <= 12
    assert max(len(branch.support_vectors) for branch in models["epsilon-rbf"].branches) <= 30
    assert models["epsilon-spline"].branches[0].n_points == 55


def test_no_formula_is_the_shape_of_the_rig_and_a_spline_is_chosen(found):
    held_out = {rung.family: rung.rmse_nm for rung in found.choice.rungs}
    assert found.choice.chosen.family == "epsilon-spline"
    assert "No parametric model is as good" in found.explanation
    assert not found.symmetric
    assert min(held_out[family] for family in FORMULAS) > 2 * held_out["epsilon-spline"]
    assert min(held_out[family] for family in FORMULAS) > 1.5 * found.tolerance_nm


def test_of_a_rig_that_is_gaussian_the_formula_is_said_to_be_as_good(loaded):
    """So the test before says something of the rig, not of the ladder: one peak, nothing that thins out."""
    axis = loaded.options["axis"][0]
    plain = {"stribeck_rad_s": 0.1, "second_share": 0.0, "thinning_nms_rad": 0.0}
    options = {**loaded.options, "axis": [{**axis, "friction": {**axis["friction"], **plain}}]}
    rows = mock_points.measure(loaded.model_copy(update={"options": options}), levels=14, measurements=50)
    measured = [(p.velocity_rad_s, abs(p.friction_torque_nm), p.direction, p.std_nm, p.count) for p in rows]
    points = FrictionPoints.from_rows(measured, "a Gaussian joint", "")
    options = ladder.Options(
        families=("gaussian", "epsilon-spline"), strategy="halving", backend="sequential"
    )
    found = ladder.ascend(points, options)
    assert found.choice.chosen.family == "gaussian"
    assert "A parametric model is as good" in found.explanation
    parameters = ladder.learn(points, found, rig="mock").branches[0].parameters
    assert parameters["stribeck_rad_s"] == pytest.approx(0.1, rel=0.02)
    assert parameters["breakaway_nm"] == pytest.approx(0.35, rel=0.01)
    assert parameters["coulomb_nm"] == pytest.approx(0.25, rel=0.01)


def test_every_compiled_winner_is_within_a_millionth_of_full_scale(models):
    for model in models.values():
        assert max(branch.rounding_bound_nm for branch in model.branches) <= 1.01e-6 * model.friction_max_nm


def test_the_halving_search_finds_the_same_winner_or_one_within_a_standard_error(points, found):
    quick = ladder.ascend(
        points,
        ladder.Options(
            families=FORMULAS + MACHINES, strategy="halving", backend="sequential", symmetric="no"
        ),
    ).choice
    full = found.choice
    same = quick.chosen.family == full.chosen.family
    assert same or quick.chosen.rmse_nm <= full.chosen.rmse_nm + full.chosen.se_nm
    splines = [next(r for r in choice.rungs if r.family == "epsilon-spline") for choice in (quick, full)]
    assert splines[0].rmse_nm <= splines[1].rmse_nm + splines[1].se_nm
