"""Every kind of curve keeps what its interface promises; none is named here, so that a new one is held to it
too.
"""

import math

import numpy as np
import pytest

from rtctl.friction import kind, kind_table
from rtctl.friction.kind_compile import cell_bounds, compile_curve
from rtctl.friction.kind_curve import Curve
from rtctl.friction.kind_table import FORMULAS, KERNELS, KINDS
from rtctl.friction.learn import grids
from tests.documents.parts import rungs

SPEED_MAX = 2.0
NUMBERS = {"coulomb_nm": 0.25, "viscous_nms_rad": 0.05, "breakaway_nm": 0.35, "stribeck_rad_s": 0.1}


def curve(name, n=12):
    """A curve of the kind: a formula of `NUMBERS`, or a sum of kernels with small coefficients."""
    of = KINDS[name]
    if of is kind_table.MEAN:
        others = [each for each in KINDS if each != name]
        return Curve.mean([(1 / len(others), curve(each, n)) for each in others])
    if of.is_formula:
        return Curve.formula(name, {each: NUMBERS[each] for each in of.names})
    rng = np.random.default_rng(7)
    beta = rng.uniform(-0.1, 0.1, n)
    return Curve(name, of.grid(SPEED_MAX)[-1], rng.uniform(0, SPEED_MAX, n), beta - beta.mean(), 1.0)


def away_from_breaks(one, h=1e-3):
    v = np.linspace(0.01, SPEED_MAX - 0.01, 173)
    breaks = np.append(one.of.breaks(one), one.exact.knots if one.exact else [])
    return v[np.abs(v[:, None] - breaks).min(axis=1, initial=np.inf) > 2 * h]


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("order", [0, 1, 2])
def test_each_derivative_is_that_of_the_one_before(name, order):
    one, h = curve(name), 1e-5
    v = away_from_breaks(one)
    difference = (one.derivative(v + h, order) - one.derivative(v - h, order)) / (2 * h)
    exact = one.derivative(v, order + 1)
    assert np.allclose(difference, exact, rtol=1e-4, atol=1e-4 * (np.abs(exact).max() + 1e-6))
    assert np.allclose(one.derivative(v, 0), one(v), rtol=1e-12)


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("order", [4, 8, 12])
def test_its_bound_holds_between_the_breaks(name, order):
    one = curve(name)
    v = away_from_breaks(one)
    bound = one.derivative_bound(order, v)
    assert bound.shape == v.shape
    assert (np.abs(one.derivative(v, order)) <= bound * (1 + 1e-9)).all()


@pytest.mark.parametrize("name", KINDS)
def test_it_compiles_to_what_is_proved(name):
    one = curve(name)
    found, bound = compile_curve(one, SPEED_MAX)
    v = np.linspace(0, SPEED_MAX, 20_001)
    assert np.abs(found(v) - one(v)).max() <= bound <= 2e-6 * np.abs(one(v)).max()


@pytest.mark.parametrize("name", KINDS)
def test_its_parameters_are_those_of_its_grid_and_bad_ones_are_refused(name):
    of = KINDS[name]
    for each in of.grid(SPEED_MAX) if name in KERNELS else []:
        needed = [parameter for parameter in of.parameters if not parameter.optional]
        assert tuple(each) == tuple(parameter.name for parameter in needed)
        assert of.has_parameters(each)
        assert not of.has_parameters({**each, "other": 1.0})
        assert not any(parameter.refusal(each[parameter.name]) for parameter in needed)
    for parameter in of.parameters:
        if parameter.positive or parameter.whole_to:
            assert parameter.name in parameter.refusal(0.0)


def test_every_kind_is_a_rung_and_stands_in_the_document():
    speed = np.linspace(0.01, 2, 20)
    for name in FORMULAS:
        assert [one.kind for one in grids.candidates(name, speed, 0.2 + speed)] == [name]
    for name, of in KERNELS.items():
        for machine in kind_table.MACHINES:
            tried = grids.candidates(f"{machine}-{name}", speed, 0.2 + speed)
            assert {one.c for one in tried} == {2.2 * share for share in of.c_shares}
    assert all(f"`{family}`" in rungs() for family in (*kind_table.FAMILIES, kind_table.MEAN.name))


class Kinked(kind.Kernel):
    """abs(u - v)^5: its fifth derivative jumps at each support vector."""

    name = "kinked"
    c_shares = (1.0,)

    def matrix(self, parameters, u, v):
        return np.abs(u[:, None] - v[None, :]) ** 5

    def derivative(self, c, v, order):
        apart = v[..., None] - c.support_vectors
        size = math.perm(5, order) * np.abs(apart) ** max(5 - order, 0) * np.sign(apart) ** order
        return size @ c.dual_coef + (c.intercept if order == 0 else 0.0)

    def derivative_bound(self, c, order, v):
        return np.full(v.shape, 0.0 if order > 5 else math.inf)

    def breaks(self, c):
        return np.unique(c.support_vectors)


def test_cells_end_where_a_derivative_jumps_and_nothing_is_proved_across(monkeypatch):
    monkeypatch.setitem(KINDS, "kinked", Kinked())
    one = Curve("kinked", {}, np.array([0.313, 1.1]), np.array([1.0, -0.9]), 0.3)
    found, bound = compile_curve(one, SPEED_MAX)
    v = np.linspace(0, SPEED_MAX, 20_001)
    assert {0.313, 1.1} <= set(found.knots)
    assert np.abs(found(v) - one(v)).max() <= bound < 2e-6 * one(v).max()
    across, within = cell_bounds(one, np.array([0.2, 0.4, 0.5]))
    assert across == math.inf
    assert within < 1e-3
