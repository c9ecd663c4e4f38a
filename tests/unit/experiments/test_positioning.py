"""The position controller and its figures, the worst hand, and what the texts say of SVR."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import click
import numpy as np
import pytest

from rtctl.cli.experiment import _known
from rtctl.control.jit import records
from rtctl.control.position import friction_toward, reference_at
from rtctl.control.proofs import stability
from rtctl.control.records import MODEL
from rtctl.control.vocabulary import Shape
from rtctl.errors import ConfigError, DataError
from rtctl.experiments import models, point_to_point, positioning, tracking, worst_delay, worst_hand
from rtctl.experiments.models import Compared
from rtctl.experiments.order import Order
from rtctl.experiments.positioning import Followed
from rtctl.friction import artefact
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"
J, B, T = 0.012, 0.05, 1e-3


@pytest.fixture(scope="module")
def order():
    return Order(load(CONFIGS / "mock.toml"), seeds=2)


@pytest.fixture(scope="module")
def shipped():
    return Compared("shipped", artefact.load(CONFIGS / "friction" / "mock.json").record(), 0.0, "")


def test_a_comparison_without_a_support_vector_model_is_refused_before_anything_moves(order, monkeypatch):
    """The page says what the best of them saves: without one it ended in a traceback, after all runs."""
    with pytest.raises(click.BadParameter, match="name one of these, too"):
        _known(("Coulomb",))
    assert _known(("Coulomb", "nu-SVR, RBF")) == ("Coulomb", "nu-SVR, RBF")
    assert _known(()) == ()
    rungs = [SimpleNamespace(family="coulomb", refused="", scores=[], rmse_nm=0.0)]
    climbed = SimpleNamespace(choice=SimpleNamespace(rungs=rungs))
    monkeypatch.setattr(models, "climb", lambda _: (SimpleNamespace(source="points.csv"), climbed))
    learned = SimpleNamespace(record=lambda: np.zeros(1, MODEL))
    monkeypatch.setattr(models.ladder, "learn", lambda *_, **__: learned)
    with pytest.raises(DataError, match=r"points\.csv: no support-vector model could be learned"):
        models.compared(order)


NONE = Compared("none", np.zeros(1, MODEL), 0.0, "")


def followed(case, share):
    return Followed(share * case.reference[-1, 0], np.ones(len(share)), case.reference)


def test_the_figures_of_a_step_are_those_of_its_curve(order):
    case = point_to_point._case(order, 0.1)
    t = np.arange(len(case.reference)) * T
    got = point_to_point.judge(case, followed(case, 1 - np.exp(-t / 0.1)))
    assert got["rise_s"] == pytest.approx(0.1 * math.log(9), abs=2 * T)
    assert got["settling_s"] == pytest.approx(0.1 * math.log(20), abs=2 * T)
    assert got["overshoot"] == 0
    assert got["steady_error_rad"] < 1e-6
    assert got["effort_nm"] == 1


def test_a_step_that_never_gets_there_has_no_rise_and_no_settling_time(order):
    case = point_to_point._case(order, -0.1)
    got = point_to_point.judge(case, followed(case, np.full(len(case.reference), 0.5)))
    assert math.isnan(got["rise_s"])
    assert math.isnan(got["settling_s"])
    assert got["steady_error_rad"] == pytest.approx(0.05)


def test_overshoot_is_a_share_of_the_step_in_either_direction(order):
    case = point_to_point._case(order, -0.1)
    share = np.ones(len(case.reference))
    share[100] = 1.2
    assert point_to_point.judge(case, followed(case, share))["overshoot"] == pytest.approx(0.2)


def test_references_are_their_own_derivatives(order):
    for case in tracking.cases_of(order):
        x, v, a = case.reference.T
        assert abs(x[0]) + abs(v[0]) * ("sine" in case.name) < 1e-12
        smooth = np.abs(np.diff(v)) < 0.02 if "sine" in case.name else np.diff(v) == 0
        assert np.allclose((np.diff(x) / T)[smooth], (0.5 * (v[1:] + v[:-1]))[smooth], atol=2e-3)
        if "sine" in case.name:
            assert np.allclose(np.diff(v) / T, 0.5 * (a[1:] + a[:-1]), atol=2e-2)


def test_the_friction_torque_follows_the_reference_while_it_moves_and_the_error_while_it_stands(shipped):
    model = records(shipped.record)
    assert friction_toward(model[0], 1.0, -0.5, 1.0, 1.0, 1e-3) < -0.2
    assert friction_toward(model[0], 1.0, 0.0, 0.0, 0.5e-3, 1e-3) == pytest.approx(0.5 * 0.35, rel=0.05)
    assert friction_toward(model[0], 1.0, 0.0, 0.0, -1.0, 1e-3) == pytest.approx(-0.35 * 1.06, rel=0.05)
    assert friction_toward(records(NONE.record)[0], 1.0, 1.0, 0.0, 1.0, 1e-3) == 0.0


@pytest.mark.parametrize("name", ["sine 0.5 Hz", "triangle 0.1 rad/s"])
def test_the_law_makes_the_references_that_the_simulation_follows(order, name):
    case = next(case for case in tracking.cases_of(order) if case.name == name)
    again = [
        reference_at(int(case.shape), case.amplitude_rad, case.rate, k * T)
        for k in range(len(case.reference))
    ]
    assert np.allclose(again, case.reference, atol=1e-9)
    assert reference_at(int(Shape.STEP), -0.1, 0.0, 5.0) == (-0.1, 0.0, 0.0)


def test_the_joint_stays_short_of_its_goal_without_a_model_and_reaches_it_with_one(order, shipped):
    case = point_to_point._case(order, 0.1)
    errors = [
        point_to_point.judge(case, positioning.follow_once(order, 0, "PD", case, model))["steady_error_rad"]
        for model in (NONE, shipped)
    ]
    assert errors[0] > 0.02
    assert errors[1] < 0.1 * errors[0]


def test_at_rest_the_joint_does_not_hunt_about_its_goal(order, shipped):
    case = point_to_point._case(order, 0.03)
    end = positioning.follow_once(order, 0, "PD", case, shipped)
    assert np.ptp(end.position_rad[-200:]) < 1e-4
    assert np.abs(end.torque_nm).max() <= 2.0


def test_only_the_cases_asked_for_are_run_and_an_unknown_one_is_answered_with_those_there_are(order):
    asked = replace(order, cases=("triangle 0.5 rad/s", "sine 1 Hz"))
    assert [case.name for case in tracking.EXPERIMENT.chosen(asked)] == ["sine 1 Hz", "triangle 0.5 rad/s"]
    assert len(tracking.EXPERIMENT.chosen(order)) == len(tracking.cases_of(order))
    with pytest.raises(ConfigError, match=r"'step 10 mrad'.*'step -100 mrad'"):
        point_to_point.EXPERIMENT.chosen(asked)


def test_a_page_of_one_case_draws_that_case(order, shipped, monkeypatch):
    monkeypatch.setattr(
        positioning.models, "compared", lambda _order: [NONE, replace(shipped, name="nu-SVR, RBF")]
    )
    made = tracking.run(replace(order, seeds=1, cases=("sine 1 Hz",)))
    assert next(picture.name for picture in made.pictures()) == "tracking_sine_1_Hz"
    assert list(made.numbers["controllers"]["PD"]) == ["sine 1 Hz"]


def found_of(**means):
    rows = {name: {"e": np.array([mean, 1.01 * mean])} for name, mean in means.items()}
    return {"PD": {"case": rows}}


def test_the_text_says_where_svr_does_not_win():
    names = {"none": 10.0, "Coulomb": 1.0, "Tustin": 3.0, "nu-SVR, RBF": 2.0}
    models = [Compared(name, NONE.record, 0.0, "") for name in names]
    text = positioning.verdict(found_of(**names), "PD", "e", models, "error")
    assert "MORE than with Coulomb: SVR does not win there" in text
    assert "33.3 % less than with Tustin" in text
    assert "better in 1 of 1 cases: case (Coulomb)" in text


def over_seeds(**values):
    return {"PD": {"case": {name: {"e": np.array(value)} for name, value in values.items()}}}


def test_a_case_that_the_seeds_cannot_tell_is_not_counted_as_lost():
    values = {"none": [9.0, 9.1, 8.9], "Coulomb": [1.0, 1.3, 0.6], "nu-SVR, RBF": [1.1, 1.0, 1.2]}
    models = [Compared(name, NONE.record, 0.0, "") for name in values]
    text = positioning.verdict(over_seeds(**values), "PD", "e", models, "error")
    assert "no difference from Coulomb that 3 seeds can tell" in text
    assert "No formula is better in any case. In 1 more the seeds cannot tell: case (Coulomb)." in text


@pytest.mark.parametrize(
    ("second", "said"),
    [
        ([1.5, 1.6, 1.55], "Best of all: nu-SVR, RBF, with 1.1 ± 0.2 N m, 28.9 ± 19 % less than the next "
                           "(Tustin)."),
        ([1.5, 1.0, 1.0], "Best of all: nu-SVR, RBF, with 1.1 ± 0.2 N m; 3 seeds cannot tell it from the "
                          "next (Tustin, 1.17 ± 0.7 N m)."),
    ],
)  # fmt: skip
def test_the_best_of_all_is_named_with_whether_it_can_be_told_from_the_next(second, said):
    found = over_seeds(**{"none": [9.0, 9.1, 8.9], "Tustin": second, "nu-SVR, RBF": [1.1, 1.0, 1.2]})
    assert positioning.best_of_all(found, "PD", "e", 1.0, "N m") == said


def test_the_best_of_one_run_is_named_beside_the_next():
    found = over_seeds(**{"none": [9.0], "nu-SVR, RBF": [1.1]})
    said = "Best of all: nu-SVR, RBF, with 1.1 N m; next none, 9 N m, each run once."
    assert positioning.best_of_all(found, "PD", "e", 1.0, "N m") == said


@pytest.mark.parametrize("b_c", [0.0, 0.01, 0.03])
@pytest.mark.parametrize("modes", [1, 2, 5, 14, 30])
def test_the_worst_hand_is_unstable_exactly_where_theory_says(b_c, modes):
    # docs/theory.md 2.11: k = (2 b / T) / S_N - 2 b_c / T
    s_n = 8 / math.pi**2 * sum(1 / (2 * n - 1) ** 2 for n in range(1, modes + 1))
    edge = worst_hand.first_unstable(worst_hand.worst(J, B, T, modes), b_c, T, 400.0)
    assert edge == pytest.approx(2 * B / T / s_n - 2 * b_c / T, rel=1e-4)
    assert edge > stability.k_max_sampled_data(B, b_c, T)


def test_in_time_the_same_hand_grows_above_its_edge_and_decays_below():
    hand = worst_hand.worst(J, B, T, 3)
    edge = worst_hand.first_unstable(hand, 0.01, T, 400.0)
    for share, grows in ((0.95, False), (1.05, True)):
        ratio = worst_hand.growth(
            hand.step, hand.push, hand.angle, hand.speed, share * edge, 0.01, T, 4000, 0.1
        )
        assert (ratio > 1) is grows


def test_a_loop_that_runs_off_the_numbers_grows():
    hand, parts = worst_hand.worst(J, B, T, 3), worst_hand.worst(J, B, T, 2, 4)
    known, cut = (vars(hand).values(), vars(parts).values())
    assert worst_hand.growth(*known, 1e8, 0.01, T, 4000, 0.1) == math.inf
    assert worst_hand.peak_with_friction(*cut, J, 0.25, 0.25, 1e8, 0.01, T, 4, 1000, 10.0) == math.inf


def test_a_hand_conserves_energy_where_the_joint_has_no_damping():
    hand = worst_hand.worst(J, 0.0, T, 6)
    assert np.allclose(hand.step @ hand.step.T, np.eye(12), atol=1e-9)


def test_the_mean_over_cases_is_per_seed():
    found = {"PD": {"a": {"m": {"e": np.array([1.0, 3.0])}}, "b": {"m": {"e": np.array([3.0, 5.0])}}}}
    assert positioning.over_cases(found, "PD", "m", "e").tolist() == [2.0, 4.0]


@pytest.mark.parametrize(("delay", "b_c"), [(0, 0.01), (1, 0.0), (1, 0.01), (1, 0.03), (2, 0.02)])
def test_with_delay_the_worst_hand_and_environment_are_unstable_just_above_the_bound(delay, b_c):
    angles = np.geomspace(0.02, math.pi / 2 - 1e-3, 13)
    least = worst_delay.first_unstable_share(J, B, T, b_c, delay, 8, angles)
    assert 1.0 < least <= 1.10


def test_without_delay_and_with_a_rigid_wall_both_ways_to_the_poles_agree():
    hand = worst_hand.worst(J, B, T, 3)
    edge = worst_hand.first_unstable(hand, 0.01, T, 400.0)
    wall = worst_delay.Environment(0.0, 0.0)
    assert worst_delay.largest_pole(hand, 0.99 * edge, 0.01, T, 0, wall) <= 1 + 1e-7
    assert worst_delay.largest_pole(hand, 1.01 * edge, 0.01, T, 0, wall) > 1 + 1e-7


@pytest.mark.parametrize("gain", [0.0, 0.9, 1.0])
def test_dry_friction_compensated_with_a_late_sign_does_not_grow_on_the_bound(gain):
    part = worst_hand.worst(J, B, T, 2, 64)
    known = (part.step, part.push, part.angle, part.speed, J, 0.25)
    bound = stability.k_max_sampled_data(B, 0.01, T)
    assert worst_hand.peak_with_friction(*known, gain * 0.25, bound, 0.01, T, 64, 1000, 0.1) <= 1.0
    free = (*known[:-1], 0.0, 0.0)
    assert worst_hand.peak_with_friction(*free, 1.6 * bound, 0.01, T, 64, 4000, 0.1) > 1.5
