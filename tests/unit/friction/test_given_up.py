"""What scikit-learn's solver gives up has an optimum all the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtctl.friction.learn import machines, search
from rtctl.friction.learn.machines import Candidate, train
from tests.bench import outliers


def given_up() -> tuple[Candidate, search.Side]:
    """The candidate of few numbers on the joint of one outlier, which LIBSVM gives up in one fold."""
    data = search.side(outliers.joint(), -1)
    return Candidate("nu", "spline", 3 * float(data.friction_nm.max()), 0.2), data


def test_a_fit_that_is_given_up_is_ended_by_the_interior_point_method(monkeypatch) -> None:  # type: ignore[no-untyped-def]
    one, data = given_up()
    wanted = train(one, data.speed, data.friction_nm, data.weight)
    assert wanted.converged
    monkeypatch.setattr(machines, "_by_libsvm", lambda *_: None)
    again = train(one, data.speed, data.friction_nm, data.weight)
    assert again.converged
    np.testing.assert_allclose(again.curve(data.speed), wanted.curve(data.speed), atol=2e-4)


def test_a_round_that_stops_early_on_purpose_is_left_as_it_stopped() -> None:
    one, data = given_up()
    stopped = train(one, data.speed, data.friction_nm, data.weight, max_iterations=5)
    assert not stopped.converged


def test_no_candidate_is_lost_for_one_fold(monkeypatch) -> None:  # type: ignore[no-untyped-def]
    one, data = given_up()
    real, ended = machines._by_libsvm, []

    def fewer(*given):  # type: ignore[no-untyped-def]
        found = real(*given)
        ended.append(found is not None and found.converged)
        return replace(found, converged=False) if len(ended) == 2 else found  # one fold of five is given up

    monkeypatch.setattr(machines, "_by_libsvm", fewer)
    assert search.cross_validate(one, data).failed is None
    assert len(ended) == 6
