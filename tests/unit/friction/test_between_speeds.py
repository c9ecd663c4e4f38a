"""Sessions at the same speeds: a curve that goes off between them is not chosen, what sessions differ by is
told and not compared, and the curve lies in the middle of them.
"""

import numpy as np
import pytest

from rtctl.friction.learn import hold_out, ladder, search
from rtctl.friction.learn.machines import Candidate
from rtctl.friction.points import FrictionPoints

SPEEDS = np.geomspace(0.03, 1.0, 12)


def sessions(factors, speeds=SPEEDS, noise_nm=5e-4):
    """A peak and a slope, times a factor of each session."""
    rng, rows, log = np.random.default_rng(8), [], []
    for number, factor in enumerate(factors):
        for sign in (1, -1):
            for v in speeds if isinstance(speeds, np.ndarray) else speeds[number]:
                f = factor * (0.3 + 0.15 * np.exp(-v / 0.1) + 0.05 * v) + noise_nm * rng.normal()
                rows.append((sign * v, f, sign, np.nan, np.nan))
                log.append(float(number))
    return FrictionPoints.from_rows(rows, "made", "0" * 64, {"log": np.array(log)})


def test_what_a_session_lies_above_the_others_is_taken_off_and_of_its_ends_alone_nothing():
    level, session = np.tile(np.arange(6), 2), np.repeat([0, 1], 6)
    shape = np.array([5.0, 4.0, 3.0, 3.0, 4.0, 5.0])
    friction = np.concatenate([shape + 0.2, shape - 0.2])
    assert hold_out.less_offsets(friction, level, session) == pytest.approx(np.tile(shape, 2))
    ends = (session == 0) | np.isin(level, [0, 5])
    left = hold_out.less_offsets(friction[ends], level[ends], session[ends])
    assert left == pytest.approx(friction[ends])


def test_a_session_that_is_held_out_does_not_tell_where_it_lies():
    data = search.side(sessions([0.9, 1.1], noise_nm=1e-5), 1, folds="log")
    found = search.cross_validate(Candidate("formula", "tustin"), data)
    whole = 0.2 * np.sqrt(np.mean(data.friction_nm**2))
    assert found.rmse_nm == pytest.approx(whole, rel=0.1)  # its ends train, and say a little
    assert found.compared_nm < 0.2 * found.rmse_nm


def test_sessions_at_speeds_of_their_own_are_held_out_as_they_were():
    data = search.side(sessions([0.9, 1.1], [SPEEDS, 1.09 * SPEEDS[:-1]]), 1, folds="log")
    assert data.level is None
    assert data.between is None
    found = search.cross_validate(Candidate("formula", "tustin"), data)
    assert np.array_equal(found.compared, found.errors)


def test_whole_speeds_of_all_sessions_are_held_out_beside_whole_sessions(monkeypatch):
    data, trained_on = search.side(sessions([0.98, 1.0, 1.02]), 1, folds="log"), []
    right = search.train

    def spy(candidate, speed, *more, **options):
        trained_on.append(np.unique(speed))
        return right(candidate, speed, *more, **options)

    monkeypatch.setattr(search, "train", spy)
    found = search.cross_validate(Candidate("formula", "tustin"), data)
    assert len(found.between) == 3 * 10  # of three sessions the ten speeds between the ends
    for speed in SPEEDS[1:-1]:
        assert any(np.abs(one - speed).min() > 1e-3 * speed for one in trained_on)
    for at in (0, -1):
        assert all(np.abs(one - SPEEDS[at]).min() < 1e-9 for one in trained_on)


def test_a_curve_that_goes_off_between_the_speeds_is_not_as_good():
    data = search.side(sessions([0.96, 1.0, 1.04], np.linspace(0.05, 1.0, 10)), 1, folds="log")
    narrow = Candidate("epsilon", "rbf", 100.0, 1e-4, {"sigma_rad_s": 0.02})
    wide = Candidate("epsilon", "rbf", 100.0, 1e-4, {"sigma_rad_s": 0.3})
    off, right = (search.cross_validate(one, data) for one in (narrow, wide))
    assert off.rmse_nm < 1.2 * right.rmse_nm  # what sessions differ by is most of either
    assert off.compared_nm > 3 * right.compared_nm


@pytest.mark.parametrize("factors", [(0.92, 1.08), (0.9, 1.1, 1.1)])
def test_the_curve_lies_in_the_middle_of_the_sessions(factors):
    points = sessions(factors, noise_nm=1e-4)
    options = ladder.Options(families=("epsilon-spline",), folds="log", backend="sequential")
    model = ladder.learn(points, ladder.ascend(points, options), rig="made")
    for branch in model.branches:
        v = SPEEDS[1:-1]
        middle = np.mean(factors) * (0.3 + 0.15 * np.exp(-v / 0.1) + 0.05 * v)
        assert branch.magnitude(v) == pytest.approx(middle, rel=0.02)


def test_the_choice_says_what_it_was_compared_by():
    points = sessions([0.96, 1.0, 1.04])
    options = ladder.Options(families=("coulomb", "tustin"), folds="log", backend="sequential", mean=False)
    said = ladder.ascend(points, options).explanation
    assert "but for what sessions differ by" in said
    assert "Chosen: tustin" in said
