"""Many points: machines trained by a factor of low rank are those of LIBSVM, and the ladder's early rounds
look at fewer points.
"""

from dataclasses import replace

import numpy as np
import pytest

from rtctl.friction.kind_table import KERNELS
from rtctl.friction.learn import gram, grids, interior, machines, search
from rtctl.friction.learn.machines import Candidate, FailedFitError, train

N = 400


@pytest.fixture(scope="module")
def data():
    rng = np.random.default_rng(3)
    v = np.sort(rng.uniform(0.005, 2.0, N))
    v[0] = 0.0
    f = 0.25 + 0.1 * np.exp(-((v / 0.15) ** 1.4)) + 0.05 * v + rng.normal(0, 0.005, N)
    weight = np.where(v == 0, 3.0, 1.0)
    return search.Side(1, v, f, weight, np.arange(N) % 5)


ONES = [
    Candidate("epsilon", "spline", 10.0, 0.006),
    Candidate("epsilon", "rbf", 1.0, 0.008, {"sigma_rad_s": 0.1}),
    Candidate("epsilon", "polynomial", 0.3, 0.02, {"degree": 5.0}),
    Candidate("nu", "spline", 3.0, 0.1),
    Candidate("nu", "rbf", 1.0, 0.3, {"sigma_rad_s": 0.4}),
]


def _objective(found, data):
    """What the machine minimises (docs/theory.md 8.2); nu's tube is its own."""
    curve = found.curve
    beta = curve.dual_coef
    at = np.searchsorted(data.speed, curve.support_vectors)
    kernel = KERNELS[curve.kind].matrix(curve.parameters, curve.support_vectors, curve.support_vectors)
    return 0.5 * beta @ kernel @ beta - data.friction_nm[at] @ beta + found.epsilon_nm * np.abs(beta).sum()


@pytest.mark.parametrize("one", ONES, ids=lambda one: one.family)
def test_a_machine_of_many_points_is_that_of_libsvm(data, one, monkeypatch):
    ours = train(one, data.speed, data.friction_nm, data.weight)
    assert ours.converged
    assert ours.weights is not None
    monkeypatch.setattr(gram, "MANY", N + 1)
    theirs = train(
        one, data.speed, data.friction_nm, data.weight, tolerance_nm=1e-6, max_iterations=3_000_000
    )
    assert theirs.weights is None
    assert theirs.converged
    assert one.machine == "nu" or _objective(ours, data) <= _objective(theirs, data) + 1e-6
    at = np.linspace(0, 2, 301)
    assert np.abs(ours.curve(at) - theirs.curve(at)).max() < 1e-4
    assert ours.epsilon_nm == pytest.approx(theirs.epsilon_nm, abs=3e-5)
    assert ours.curve.n_terms == pytest.approx(theirs.curve.n_terms, rel=0.03)


def test_what_libsvm_gives_up_is_solved(data, monkeypatch):
    hard = Candidate("nu", "polynomial", 30.0, 0.1, {"degree": 5.0})
    ours = train(hard, data.speed, data.friction_nm, data.weight)
    assert ours.converged
    residual = ours.curve(data.speed) - data.friction_nm
    monkeypatch.setattr(gram, "MANY", N + 1)
    theirs = train(hard, data.speed, data.friction_nm, data.weight, max_iterations=20_000)
    assert not theirs.converged
    assert np.std(residual) < np.std(theirs.curve(data.speed) - data.friction_nm)


def test_the_optimum_is_one_by_its_own_conditions(data):
    one = ONES[1]
    found = train(one, data.speed, data.friction_nm, data.weight)
    beta = np.zeros(N)
    beta[np.isin(data.speed, found.curve.support_vectors)] = found.curve.dual_coef
    off = found.curve(data.speed) - data.friction_nm
    bound = one.c * data.weight
    assert abs(beta.sum()) < 1e-6
    assert (np.abs(beta) <= bound * (1 + 1e-9)).all()
    assert np.abs(off[beta == 0]).max() <= one.tube + 1e-5
    inside = (np.abs(beta) > 1e-6 * bound) & (np.abs(beta) < bound * (1 - 1e-6))
    assert np.abs(np.abs(off[inside]) - one.tube).max() < 1e-5
    assert (np.sign(off[beta != 0]) == -np.sign(beta[beta != 0])).all()


def test_a_coarse_factor_is_made_finer_where_the_curve_would_notice(data):
    steep = Candidate("epsilon", "spline", 3000.0, 0.006)
    whole = gram.Gram.of("spline", {}, data.speed)
    rough = replace(whole, factor=gram.pivoted(whole.matrix, 1e-6))
    found = train(steep, data.speed, data.friction_nm, data.weight, gram=rough)
    fine = train(steep, data.speed, data.friction_nm, data.weight)
    assert found.converged
    assert len(found.weights) > rough.factor.shape[1]
    assert np.abs(found.curve(data.speed) - fine.curve(data.speed)).max() < 3e-5


def test_a_factor_misses_no_more_than_it_says(data):
    for kind, parameters in (("spline", {}), ("rbf", {"sigma_rad_s": 0.1}), ("polynomial", {"degree": 5.0})):
        matrix = KERNELS[kind].matrix(parameters, data.speed, data.speed)
        factor = gram.pivoted(matrix, 1e-8)
        assert np.abs(factor @ factor.T - matrix).max() <= 1.01e-8 * matrix.max()
        assert factor.shape[1] < 0.4 * N


def test_a_solver_that_is_stopped_says_so(data, monkeypatch):
    monkeypatch.setattr(interior, "_STEPS", 3)
    assert not train(ONES[0], data.speed, data.friction_nm, data.weight).converged


def test_numbers_that_are_not_finite_are_a_failed_fit(data, monkeypatch):
    lost = interior.Solution(np.full(N, np.nan), 0.0, 0.01, converged=True)
    monkeypatch.setattr(interior, "solve", lambda *_, **__: lost)
    with pytest.raises(FailedFitError, match="not finite"):
        train(ONES[0], data.speed, data.friction_nm, data.weight)


def test_early_rounds_train_on_fewer_points_that_span_the_speeds_and_rank_as_all_do(data, monkeypatch):
    seen = []

    def spy(candidate, speed, friction_nm, weight, **more):
        seen.append((len(speed), speed.min(), speed.max(), weight.sum()))
        return machines.train(candidate, speed, friction_nm, weight, **more)

    monkeypatch.setattr(search, "train", spy)
    some = grids.candidates("epsilon-rbf", data.speed, data.friction_nm)[::9]
    early = search.Effort(5_000, 2, 100)
    few = [search.cross_validate(one, data, None, early) for one in some]
    assert {n for n, *_ in seen} == {100}
    kept = data.fold != 0
    assert all(
        low == data.speed[kept].min() or low == data.speed[data.fold != 1].min() for _, low, _, _ in seen
    )
    assert max(high for _, _, high, _ in seen) == data.speed.max()
    monkeypatch.undo()
    every = [search.cross_validate(one, data) for one in some]
    best = min(range(len(some)), key=lambda i: every[i].rmse_nm)
    third = sorted(range(len(some)), key=lambda i: few[i].rmse_nm)[: -(-len(some) // search.KEEP)]
    assert min(every[i].rmse_nm for i in third) <= 1.02 * every[best].rmse_nm


def test_few_points_are_trained_as_ever(data):
    few = slice(0, gram.MANY - 1)
    assert gram.Gram.of("spline", {}, data.speed[few]).factor is None
    assert train(ONES[0], data.speed[few], data.friction_nm[few], data.weight[few]).weights is None
