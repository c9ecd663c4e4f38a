"""Sessions of one joint that differ by an offset: what they differ by tells no rung from another, and is
told and held by the band all the same.
"""

import numpy as np
import pytest
from stribeck_points import options, stribeck

from rtctl.friction.learn import certainty, ladder, search
from rtctl.friction.learn.machines import Candidate
from rtctl.friction.points import FrictionPoints

OFFSETS_NM = (-0.02, 0.003, 0.017)
SPEEDS = tuple(np.geomspace(0.02, 2, 14) for _ in OFFSETS_NM)
FORMULAS = ("coulomb", "coulomb_viscous", "gaussian", "lorentzian")


def sessions(offsets=OFFSETS_NM, speeds=SPEEDS, seed=3):
    rng = np.random.default_rng(seed)
    rows, log = [], []
    for number, (offset, v) in enumerate(zip(offsets, speeds, strict=True)):
        for sign in (1, -1):
            measured = stribeck(v) + offset + rng.normal(0, 0.003, len(v))
            rows += [(sign * x, f, sign, np.nan, 50.0) for x, f in zip(v, measured, strict=True)]
            log += [float(number)] * len(v)
    return FrictionPoints.from_rows(rows, "sessions.csv", "0" * 64, {"log": np.array(log)})


@pytest.fixture(scope="module")
def found():
    return ladder.ascend(sessions(), options(families=FORMULAS, symmetric="no", folds="log"))


def test_what_sessions_differ_by_is_taken_off_and_what_all_err_by_stays():
    rng = np.random.default_rng(0)
    own, session = rng.normal(size=30), np.repeat([0, 1, 2], 10)
    off = np.array([5.0, -3.0, 1.0])[session]
    np.testing.assert_allclose(
        certainty.less_shared(own + off, session), certainty.less_shared(own, session) + off.mean()
    )
    assert certainty.less_shared(own + 7.0, session).mean() == pytest.approx(own.mean() + 7.0)


def test_the_shape_is_told_though_sessions_differ_by_more(found):
    candidate = found.choice.chosen.scores[0].candidate
    shares = {part.family: share for share, part in candidate.parts} or {candidate.family: 1.0}
    assert shares.get("gaussian", 0.0) > 0.8
    assert not {"coulomb", "coulomb_viscous"} & shares.keys()
    assert "without what the sessions differ by" in found.explanation


def test_the_error_that_is_told_and_the_band_keep_what_sessions_differ_by(found):
    assert found.choice.chosen.rmse_nm > 0.015
    assert found.choice.chosen.telling_nm < 0.006
    assert found.choice.chosen.se_nm > found.choice.chosen.doubt_nm
    band = ladder.learn(sessions(), found, rig="mock").branches[0].band
    assert band is not None
    assert min(band.half_width_nm) > max(OFFSETS_NM)


def test_without_sessions_rungs_are_compared_by_their_errors_as_they_are():
    data = search.side(sessions(), 1, folds="speed")
    score = search.cross_validate(Candidate("formula", "gaussian"), data)
    assert not data.sessions_alike
    assert score.telling is score.errors


def test_the_mean_of_a_session_of_some_speeds_alone_is_not_taken_off():
    slow, fast = np.geomspace(0.02, 0.2, 12), np.geomspace(0.1, 2, 12)
    data = search.side(sessions((0.0, 0.0), (slow, fast)), 1, folds="log")
    score = search.cross_validate(Candidate("formula", "coulomb"), data)
    assert not data.sessions_alike
    assert score.telling is score.errors
    assert search.side(sessions(), 1, folds="log").sessions_alike
