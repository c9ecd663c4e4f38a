"""Sessions that differ a little, each at its own temperature: the standard error knows how few they are."""

import numpy as np
import pytest

from rtctl.friction.learn.beside_speed import LoadVerdict
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.learn.report_beside_speed import body, sentences
from rtctl.friction.learn.warmth import judge_temperature
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


def test_two_sessions_tell_no_error_and_say_so():
    found = warmth(sessions(1, 2))
    said = sentences(LoadVerdict(0.0, reason="x"), found)[1]
    assert "+- unknown % per K" in said
    assert "record a third" in said
    assert body(LoadVerdict(0.0), found)["temperature"]["dry_per_k"][1] is None
