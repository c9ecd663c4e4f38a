"""Sessions foretold by those before them: friction that wears on is told, friction that comes and goes is
not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rtctl.friction.learn import bands, certainty, foretold, ladder, search
from rtctl.friction.learn.machines import Candidate
from rtctl.friction.points import FrictionPoints

QUICK = ladder.Options(families=("coulomb_viscous",), backend="sequential", folds="log")


def sessions(factors: list[float]) -> FrictionPoints:
    """Ten speeds each way in each session, whose friction is a factor of 0.3 + 0.1 v."""
    rng = np.random.default_rng(2)
    v = np.linspace(0.1, 2, 10)
    rows, log = [], []
    for at, factor in enumerate(factors):
        for sign in (1, -1):
            for x in v:
                f = factor * (0.3 + 0.1 * x) + 1e-4 * rng.normal()
                rows.append((sign * x, f, sign, np.nan, np.nan))
                log.append(float(at))
    return FrictionPoints.from_rows(rows, "made", "0" * 64, {"log": np.array(log)})


def of(points: FrictionPoints) -> foretold.Foretold | None:
    return foretold.foretold([(Candidate("formula", "coulomb"), search.side(points, 1, folds="log"))])


def test_each_is_learned_from_those_before_it_alone() -> None:
    found = of(sessions([1.0, 1.0, 2.0, 1.0]))
    assert found is not None
    assert set(found.block) == {2, 3}
    third, fourth = (found.error_nm[found.block == at].mean() for at in (2, 3))
    assert third == pytest.approx(-0.405, rel=0.01)  # .405 N m on average, twice that came
    assert fourth == pytest.approx(0.135, rel=0.01)  # a third of the way to the one that was twice as much


def test_three_sessions_foretell_nothing_and_speeds_are_no_sessions() -> None:
    assert of(sessions([1.0, 1.1, 1.2])) is None
    data = search.side(sessions([1.0, 1.1, 1.2, 1.3]), 1, folds="speed")
    assert foretold.foretold([(Candidate("formula", "coulomb"), data)]) is None


def test_a_formula_that_has_more_numbers_than_two_short_sessions_have_points_foretells_nothing() -> None:
    """Such a fit was refused: "gaussian: 4 points for 4 parameters; add points"."""
    whole = sessions([1.0, 1.1, 1.2, 1.3])
    at = np.arange(len(whole.direction)) % 10
    # two speeds each way in each session, each session at others
    points = replace(whole, left_out=at % 5 != whole.columns["log"])
    assert of(points) is not None
    gaussian = [(Candidate("formula", "gaussian"), search.side(points, 1, folds="log"))]
    assert foretold.foretold(gaussian) is None


def test_two_points_of_two_sessions_foretell_by_what_they_are() -> None:
    """Their noise was no number, the tube neither, and the curve 0: all of the friction was the error."""
    whole = sessions([1.0, 1.0, 1.0, 1.0])
    at, log = np.arange(len(whole.direction)) % 10, whole.columns["log"]
    points = replace(whole, left_out=np.where(log < 2, at != 9 * log, False))
    data = search.side(points, 1, folds="log")
    found = foretold.foretold([(Candidate("epsilon", "spline", 5.0, 0.005), data)])
    assert found is not None
    assert np.abs(found.error_nm).max() < 0.02


def test_wear_is_told_and_widens_the_band_and_days_are_not() -> None:
    worn, days = sessions([1.0, 0.95, 0.9, 0.85, 0.8, 0.75]), sessions([1.0, 0.8, 1.0, 0.8, 1.0, 0.8])
    wearing, coming = ladder.ascend(worn, QUICK), ladder.ascend(days, QUICK)
    # sessions, from the mean of those before to the one foretold
    lags = np.sqrt(np.mean(np.square([2.0, 2.5, 3.0])))
    size = np.sqrt(np.mean((0.3 + 0.1 * np.linspace(0.1, 2, 10)) ** 2))
    assert wearing.expected_next_nm == pytest.approx(0.05 * lags * size, rel=0.05)
    assert wearing.expected_next_nm > 1.25 * wearing.choice.chosen.rmse_nm
    assert "expect that of the next" in wearing.explanation
    assert coming.expected_next_nm == pytest.approx(coming.choice.chosen.rmse_nm, rel=0.15)
    for found in (wearing, coming):
        assert found.next_range_nm is not None
        assert found.next_range_nm[0] < found.expected_next_nm < found.next_range_nm[1]
        assert "Of the next session expect" in found.explanation
        assert "that is what 6 sessions know" in found.explanation
    among = foretold.next_nm(*held_out(worn, wearing), None)
    times = wearing.expected_next_nm / wearing.choice.chosen.rmse_nm
    assert wearing.next_range_nm == pytest.approx([times * one for one in among])
    band = ladder.learn(worn, wearing, rig="made").branches[0].band
    assert band is not None
    assert band.units == 3  # of the sessions that were foretold, since the errors there are the larger ones
    # of the last one: three steps of a friction of up to .5 N m
    assert band.widest_nm > 0.95 * 0.05 * 3 * 0.5


def held_out(points: FrictionPoints, found: ladder.Ladder) -> tuple[foretold.Foretold, np.ndarray]:
    rung = found.symmetric_rung if found.symmetric and found.symmetric_rung else found.choice.chosen
    return bands.held_out(points, found.sides, rung.scores)


@pytest.mark.parametrize("count", [2, 3, 5])
def test_eight_of_ten_next_sessions_err_what_is_told_however_few_are_known(count: int) -> None:
    rng = np.random.default_rng(count)
    lies = 0.02 * rng.normal(size=(1500, count + 1))
    known, came = lies[:, :count], np.abs(lies[:, count] - lies[:, :count].mean(axis=1))
    # each is held against the mean of the others
    left = known - (known.sum(axis=1, keepdims=True) - known) / (count - 1)
    block, directions = np.repeat(np.arange(count), 8), np.tile(np.repeat([1, -1], 4), count)
    told = [certainty.next_session(np.repeat(one, 8), block, directions, 0.8) for one in left]
    low, high = np.array(told).T
    assert np.mean(came < low) == pytest.approx(0.1, abs=0.025)
    assert np.mean(came > high) == pytest.approx(0.1, abs=0.025)


def test_what_is_each_errors_own_is_known_by_many_and_less_of_the_next() -> None:
    rng = np.random.default_rng(4)
    block, directions = np.repeat([0, 1], 4000), np.tile(np.repeat([1, -1], 2000), 2)
    low, high = certainty.next_session(rng.normal(size=8000), block, directions, 0.8)
    # the next one is held against the mean of two, and not against the other one: root of .75
    assert low < 0.75**0.5 < high < 0.91
    assert low > 0.82


def test_one_session_knows_of_no_other() -> None:
    assert certainty.next_session(np.ones(8), np.zeros(8), np.ones(8), 0.8) == (0.0, np.inf)
    one = sessions([1.0])
    found = ladder.ascend(one, replace(QUICK, folds="speed"))
    assert "One session does not know what the next differs by" in found.explanation
    low, high = found.next_range_nm or (np.nan, np.nan)
    assert low == found.expected_next_nm
    assert high == pytest.approx(0.25 * np.sqrt(np.mean(one.friction_nm**2)), rel=0.01)
    assert "if by nothing, and" in found.explanation
    # several of them, and none held out: nobody knows, and nobody says
    several = ladder.ascend(sessions([1.0, 1.1]), replace(QUICK, folds="speed"))
    assert several.next_range_nm is None
    assert "next session" not in several.explanation


def test_where_a_solver_stopped_foretells_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    trained = foretold.train
    monkeypatch.setattr(foretold, "train", lambda *a, **k: replace(trained(*a, **k), converged=False))
    assert of(sessions([1.0, 1.0, 2.0, 1.0])) is None


def test_what_stretches_of_one_session_differ_by_is_expected_of_the_next() -> None:
    apart = {"between_parts_nm": np.full(20, 0.02)}
    one = replace(sessions([1.0]), columns=apart)
    found = ladder.ascend(one, replace(QUICK, folds="speed"))
    assert found.expected_next_nm == pytest.approx(np.hypot(0.02, found.choice.chosen.rmse_nm), rel=1e-3)
    assert found.next_range_nm is not None
    assert found.next_range_nm[0] == found.expected_next_nm
    assert "20 mN m if by as much as stretches of this one do, and" in found.explanation


def test_a_log_of_which_no_point_is_used_is_no_session() -> None:
    """Learned without one of two, nothing was said of the next session, and the band was of its ends
    alone."""
    two = sessions([1.0, 1.1])
    found = ladder.ascend(replace(two, left_out=two.columns["log"] == 1), replace(QUICK, folds="speed"))
    assert found.next_range_nm is not None
    assert "One session does not know" in found.explanation
