"""Sessions that differ a little, each at its own temperature: the standard error knows how few they are."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.friction.learn.beside_speed import LoadVerdict
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.learn.report_beside_speed import body, sentences
from rtctl.friction.learn.report_evidence import gather
from rtctl.friction.learn.report_sentences import headline, of_test_warmth
from rtctl.friction.learn.warmth import Warmth, judge_temperature
from rtctl.friction.points import FrictionPoints

DRY, VISCOUS, PER_K, VISCOUS_PER_K = 0.3, 0.2, -0.003, -0.012


def sessions(seed, number=8, differ=0.02, viscous=0.03, speeds=None, viscous_per_k=0.0):
    """Friction of each is `differ` off, and goes by its temperature; `speeds` of a session are drawn."""
    rng = np.random.default_rng(seed)
    celsius = rng.permutation(np.linspace(20, 40, number))
    rows, log, heat = [], [], []
    for session in range(number):
        factor = 1 + differ * rng.normal()
        drawn = np.geomspace(0.02, 2, 12) if speeds is None else np.exp(rng.uniform(-3, 1, speeds))
        for v in drawn:
            for sign in (1, -1):
                now = celsius[session] + 0.3 * rng.normal()
                friction = DRY * factor * (1 + PER_K * (now - 30)) + 0.002 * rng.normal()
                friction += viscous * v * np.exp(viscous_per_k * (now - 30))
                rows.append((sign * v, friction, sign, np.nan, np.nan))
                log.append(float(session))
                heat.append(now)
    columns = {"log": np.array(log), "temperature_c": np.array(heat)}
    return FrictionPoints.from_rows(rows, "made", "0" * 64, columns)


def warmth(points):
    return judge_temperature(fit_points(points, rig="mock", c=10.0, folds="log"), points)


@pytest.mark.parametrize("number", [4, 5])
def test_the_truth_lies_within_two_standard_errors_of_few_sessions(number):
    value, error = np.array([warmth(sessions(seed, number)).dry_per_k for seed in range(12)]).T
    assert (np.abs(value - PER_K) < 2 * error).sum() >= 11
    assert np.median(error) < 0.004, "wide enough for anything says nothing"


def test_a_curve_that_goes_through_few_points_takes_no_warmth_away():
    """The learned curve did, where each session has speeds of its own: viscous friction was a third."""
    found = [warmth(sessions(seed, 4, 0.005, VISCOUS, 10, VISCOUS_PER_K)).viscous_per_k for seed in range(6)]
    assert np.mean(found, axis=0)[0] == pytest.approx(VISCOUS_PER_K, rel=0.25)


def test_oil_that_thins_is_not_dry_friction_that_falls():
    found = [warmth(sessions(seed, 8, 0.0, 0.03, None, -0.03)) for seed in range(4)]
    assert all(one.viscous_per_k is None for one in found)
    assert np.mean([one.dry_per_k[0] for one in found]) == pytest.approx(PER_K, rel=0.15)


@pytest.fixture(scope="module")
def learned():
    """Points of six sessions, the model and what a kelvin changes."""
    points = sessions(3, 6, 0.005)
    model = fit_points(points, rig="mock", c=10.0, folds="log")
    return points, model, (LoadVerdict(0.0, reason="x"), judge_temperature(model, points))


def warmer(over_k, celsius):
    """Test points of a joint that is so much warmer than on average, and what its sensor says."""
    speeds = np.outer(np.geomspace(0.03, 1.8, 20), (1, -1)).ravel()
    friction = DRY * (1 + PER_K * over_k) + 0.03 * np.abs(speeds)
    rows = [(v, f, np.sign(v), np.nan, np.nan) for v, f in zip(speeds, friction, strict=True)]
    return FrictionPoints.from_rows(rows, "test", "1" * 64, {"temperature_c": np.full(len(speeds), celsius)})


def test_test_points_that_are_warmer_are_judged_with_what_a_kelvin_changes_taken_off(learned):
    """They were 31 K warmer, and the verdict named a unit, a gear or another joint."""
    points, model, beside = learned
    said = " ".join(headline(gather(points, model, None, warmer(31.0, 61.0), "log", beside)))
    assert "does not hold on the test points" in said
    taken = said[said.index("The test points are 31 K warmer on average: ") :]
    assert "beyond the temperatures it was found at" in taken
    assert "and holds." in taken
    assert "says too little of another session" not in said


@pytest.mark.parametrize(
    ("celsius", "says"),
    [(34.0, ""), (np.nan, ""), (0.0, ""), (61.0, "and does not hold: "), (-10.0, "colder")],
)
def test_what_is_said_of_warmth_is_of_what_the_sensor_says(learned, celsius, says):
    points, model, beside = learned
    # friction of a joint 60 K warmer, whatever the sensor says
    about = SimpleNamespace(points=points, model=model, test=warmer(60.0, celsius), beside=beside)
    said = of_test_warmth(about)
    assert says in said
    assert bool(says) == bool(said)


def test_points_of_one_temperature_tell_no_kelvin(learned):
    points, model, (load, _) = learned
    beside = (load, Warmth(1.0, 30.0, reason="temperature spans 1.0 K"))
    about = SimpleNamespace(points=points, model=model, test=warmer(31.0, 61.0), beside=beside)
    assert "of which nobody knows what a kelvin changes" in of_test_warmth(about)


def test_two_sessions_tell_no_error_and_say_so():
    found = warmth(sessions(1, 2))
    said = sentences(LoadVerdict(0.0, reason="x"), found)[1]
    assert "+- unknown % per K" in said
    assert "record a third" in said
    assert body(LoadVerdict(0.0), found)["temperature"]["dry_per_k"][1] is None
