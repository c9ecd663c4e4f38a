"""Least squares of friction by load that give up."""

from types import SimpleNamespace

import numpy as np
from test_load import plant

from rtctl.friction.learn import beside_speed
from rtctl.friction.learn.load_terms import fit_terms
from tests import loaded_gear


def test_a_solver_that_gives_up_is_a_reason_and_no_traceback(monkeypatch):
    def gives_up(*_):
        raise RuntimeError("Maximum number of iterations reached.")

    values, load_nm, fastest = plant("servo", "m4")
    made, _ = loaded_gear.points(values, load_nm, fastest, 1e-3 * load_nm, seed=1, speeds=10)
    monkeypatch.setattr("scipy.optimize.nnls", gives_up)
    model = SimpleNamespace(temperature_range_c=None)
    found, _ = beside_speed.judge(model, made, "speed")
    assert found.chosen is None
    assert "no least squares of these loads" in found.reason


def test_a_solver_that_gives_up_once_begins_elsewhere(monkeypatch):
    from scipy.optimize import nnls

    calls = iter(range(10**6))

    def gives_up_once(*args):
        if next(calls) == 0:
            raise RuntimeError("Maximum number of iterations reached.")
        return nnls(*args)

    values, load_nm, fastest = plant("servo", "m4")
    rows, _ = beside_speed.rows_of(loaded_gear.points(values, load_nm, fastest, 1e-3, seed=1, speeds=10)[0])
    monkeypatch.setattr("scipy.optimize.nnls", gives_up_once)
    assert np.isfinite(fit_terms("load_stribeck", rows).values).all()
