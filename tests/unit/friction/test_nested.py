"""The nested error: nothing of what judges a fit has chosen or trained it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.friction.learn import ladder, nested
from rtctl.friction.points import FrictionPoints

QUICK = ladder.Options(
    families=("coulomb_viscous", "gaussian"), symmetric="no", backend="sequential", n_jobs=1
)


def friction(v):
    return 0.25 + 0.1 * np.exp(-((v / 0.15) ** 2)) + 0.05 * v


def test_the_nested_error_is_that_of_another_session_and_the_ladders_own_is_not():
    """Sessions that differ: what was chosen by the sessions it saw errs more on the next."""
    sessions = [0.03, -0.02, 0.01, -0.03, 0.02]
    v = np.geomspace(0.01, 2, 20)
    both = np.concatenate([v, -v])
    parts = [friction(v)[None, :] + offset for offset in sessions]
    f = np.concatenate([np.tile(part[0], 2) for part in parts])
    rows = [(x, y, np.sign(x), np.nan, np.nan) for x, y in zip(np.tile(both, 5), f, strict=True)]
    points = FrictionPoints.from_rows(rows, "five", "0" * 64, {"log": np.repeat(np.arange(5.0), 40)})
    found = nested.generalisation(points, replace(QUICK, folds="log"))
    expected = np.sqrt(np.mean([(1.25 * offset) ** 2 for offset in sessions]))
    assert found.rmse_nm == pytest.approx(expected, rel=0.05)
    assert found.se_nm > 0
    assert len(found.chosen) == 5
    came = np.array([one.came_nm for one in found.sessions])
    assert came == pytest.approx(1.25 * np.abs(np.array(sessions) - np.mean(sessions)), rel=0.01)
    assert all(one.between_nm[0] < one.expected_nm < one.between_nm[1] for one in found.sessions)
    assert "Generalisation error (nested" in str(found)
    by_speed = ladder.ascend(points, QUICK).choice.chosen.rmse_nm
    assert found.rmse_nm > 1.15 * by_speed


def test_a_session_held_out_trains_nothing_even_where_it_has_the_fastest_point(monkeypatch):
    seen = []
    ascend = ladder.ascend
    monkeypatch.setattr(
        ladder, "ascend", lambda points, options: seen.append(points) or ascend(points, options)
    )
    v = np.geomspace(0.01, 2, 12)
    # each session has its own
    speeds = np.concatenate([np.r_[v, -v] * scale for scale in (1.2, 1.0, 0.9, 1.1)])
    f = friction(np.abs(speeds))
    rows = [(x, y, np.sign(x), np.nan, np.nan) for x, y in zip(speeds, f, strict=True)]
    log = np.repeat(np.arange(4.0), 24)
    points = FrictionPoints.from_rows(rows, "four", "0" * 64, {"log": log})
    nested.generalisation(points, replace(QUICK, folds="log"))
    assert [sorted(set(log[~one.left_out])) for one in seen] == [
        [k for k in range(4) if k != out] for out in range(4)
    ]


def test_sessions_that_share_a_fold_are_told_one_by_one():
    told = SimpleNamespace(expected_next_nm=0.5, next_range_nm=(0.1, 2.0))
    found = nested._sessions(told, np.array([1.0, -1.0, 3.0, 3.0]), np.array([7, 7, 8, 8]))
    assert found == [nested.NextSession(1.0, 0.5, (0.1, 2.0)), nested.NextSession(3.0, 0.5, (0.1, 2.0))]
