"""The choice: smallest expected error within one standard error, then fewest numbers, and the reason in
words.
"""

from dataclasses import replace

import numpy as np
import pytest

from rtctl.errors import DataError
from rtctl.friction.learn import certainty, search, selection
from rtctl.friction.learn.machines import Candidate
from rtctl.friction.learn.score import Score


def score(family, rmse, terms, direction=1, se_share=0.1):
    machine, _, kind = family.rpartition("-")
    # hard places of their own
    sign = np.where(np.arange(50) % 2 == bool(machine), 1 + se_share, 1 - se_share)
    return Score(Candidate(machine or "formula", kind), direction, rmse * sign, terms)


def test_of_scores_within_one_standard_error_the_one_with_fewest_numbers_is_chosen():
    best, sparse, worse = (score("nu-rbf", r, n) for r, n in ((1.0, 20), (1.005, 8), (1.2, 2)))
    assert sparse.rmse_nm < best.rmse_nm + best.se_nm < worse.rmse_nm
    assert selection.as_good([best, sparse, worse]) == [sparse, best]
    failed = Score(Candidate("nu", "rbf"), 1, np.zeros(0), np.inf, "not finite")
    assert selection.as_good([failed]) == []
    assert failed.rmse_nm == np.inf


def test_errors_below_the_tolerance_are_equal_so_that_the_fewest_numbers_decide():
    best, sparse, worse = (score("nu-rbf", r, n) for r, n in ((0.4e-3, 20), (1.1e-3, 9), (1.8e-3, 2)))
    assert selection.as_good([best, sparse, worse]) == [best]
    assert selection.as_good([best, sparse, worse], 1.75e-3) == [sparse, best]
    assert selection.as_good([worse], 1.75e-3) == [worse]


def test_a_tolerance_below_the_best_error_changes_nothing():
    rungs = [selection.Rung(f, (score(f, r, n),)) for f, r, n in (
        ("gaussian", 0.0101, 4), ("epsilon-spline", 0.01, 9), ("coulomb", 0.03, 1)
    )]  # fmt: skip
    assert selection.choose(rungs, 0.002).explanation == selection.choose(rungs).explanation


def test_among_rungs_the_tolerance_is_said_and_a_formula_within_it_is_as_good():
    rungs = [selection.Rung(f, (score(f, r, n),)) for f, r, n in (
        ("nu-spline", 0.0004, 20), ("epsilon-spline", 0.0012, 9), ("lorentzian", 0.0016, 4)
    )]  # fmt: skip
    assert selection.choose(rungs).chosen.family == "nu-spline"
    choice = selection.choose(rungs, 0.00175)
    assert choice.chosen.family == "lorentzian"
    assert "the fewest numbers of 3 below 1.75 mN m" in choice.explanation
    assert "A parametric model is as good: lorentzian, 1.61 mN m, is below 1.75 mN m" in choice.explanation


def test_a_bound_no_machine_keeps_names_the_sparsest_and_the_remedy():
    failed = [
        Score(Candidate("nu", "spline"), 1, np.zeros(0), n, "more than 3 support vectors") for n in (9, 6)
    ]
    data = search.Side(1, np.arange(5.0), np.ones(5), np.ones(5), np.arange(5))
    rung = selection.climb("nu-spline", failed, [data])
    assert rung.refused == "more than 3 support vectors, the sparsest has 6"
    with pytest.raises(DataError, match="sparsest has 6; raise --max-support-vectors"):
        selection.choose([rung])


def test_rungs_are_compared_point_by_point():
    """What is hard for both does not hide which one is better."""
    hard = np.geomspace(0.1, 3, 50)

    def rung(family, error, terms):
        machine, _, kind = family.rpartition("-")
        return selection.Rung(family, (Score(Candidate(machine or "formula", kind), 1, 1e-3 * error, terms),))

    better, worse = rung("nu-spline", hard, 12), rung("gaussian", 1.1 * hard, 4)
    assert worse.rmse_nm < better.rmse_nm + better.se_nm, "either error alone is known badly"
    assert selection.choose([better, worse]).chosen is better
    alike = rung("gaussian", 1.02 * np.random.default_rng(1).permutation(hard), 4)
    assert alike.rmse_nm < worse.rmse_nm
    assert selection.choose([better, alike]).chosen is alike


def lucky(candidates: int, seed: int, n=30, folds=5):
    """Candidates of one true error, none better than another; the rung takes the least."""
    rng = np.random.default_rng(seed)
    fold = np.r_[-1, np.arange(n) % folds, -1]
    data = search.Side(1, np.arange(n + 2.0), np.ones(n + 2), np.ones(n + 2), fold)
    common = rng.normal(size=n)
    scores = [
        Score(Candidate("nu", "rbf", c=k), 1, 0.6 * common + 0.8 * rng.normal(size=n), 9)
        for k in range(candidates)
    ]
    return min(scores, key=lambda one: one.rmse_nm), scores, data


def test_the_luck_of_the_least_of_many_is_given_back():
    seen, expected, alone = [], [], []
    for seed in range(100):
        best, scores, data = lucky(20, seed)
        seen.append(best.rmse_nm**2)
        expected.append(best.rmse_nm**2 + selection.luck(best, scores, data))
        alone.append(selection.luck(best, [best], data))
    assert np.mean(seen) < 0.75, "the least of twenty looks better than any is (mean square 1)"
    assert 0.9 < np.mean(expected) < 1.25
    assert not np.any(alone)


def test_what_a_curve_of_few_numbers_errs_more_is_not_taken_for_luck():
    """Chosen for its numbers among errors that count as equal: it is no luckier than the best."""
    fold = np.r_[-1, np.arange(30) % 5, -1]
    data = search.Side(1, np.arange(32.0), np.ones(32), np.ones(32), fold)
    exact, sparse = (
        Score(Candidate("nu", "rbf", c=c), 1, np.full(30, 1e-3 * error), n)
        for c, error, n in ((1, 1.0, 20), (2, 1.7, 9))
    )
    rung = selection.climb("nu-rbf", [exact, sparse], [data], tolerance_share=0.002)
    assert rung.scores == (sparse,)
    assert rung.luck_nm2 < 1e-12
    assert rung.expected_nm == pytest.approx(1.7e-3)
    assert selection.luck(sparse, [exact, sparse], data) == pytest.approx(1.7e-3**2 - 1e-3**2)


def test_two_rungs_that_count_as_equal_are_told_by_their_numbers_whatever_their_best_candidates_err():
    fold = np.r_[-1, np.arange(30) % 5, -1]
    data = search.Side(1, np.arange(32.0), np.ones(32), np.ones(32), fold)

    def rung(family, *candidates):
        machine, _, kind = family.partition("-")
        scores = [
            Score(Candidate(machine, kind, c=k), 1, np.full(30, 1e-3 * error), n)
            for k, (error, n) in enumerate(candidates)
        ]
        return selection.climb(family, scores, [data], tolerance_share=0.002)

    few, many = rung("epsilon-spline", (1.0, 20), (1.7, 9)), rung("nu-spline", (1.6, 25))
    assert selection.choose([few, many], 0.002).chosen is few


def test_a_formula_is_taken_before_the_luckiest_of_many_machines():
    taken = []
    for seed in range(60):
        _, scores, data = lucky(20, seed)
        errors = np.random.default_rng(1000 + seed).normal(size=30)
        formula = selection.Rung("gaussian", (Score(Candidate("formula", "gaussian"), 1, errors, 4),))
        machine = selection.climb("nu-rbf", scores, [data])
        bare = replace(machine, luck_nm2=0.0)
        taken.append([selection.choose([formula, one]).chosen is formula for one in (machine, bare)])
    judged, as_seen = np.mean(taken, axis=0)
    assert judged > 0.75
    assert as_seen < judged - 0.2


def test_the_standard_error_is_that_of_repeated_draws():
    rng = np.random.default_rng(1)
    draws = rng.normal(0, 2, (4000, 60))
    spread = np.sqrt((draws**2).mean(axis=1)).std()
    assert np.mean([certainty.standard_error(draw) for draw in draws[:200]]) == pytest.approx(
        spread, rel=0.05
    )
    assert certainty.standard_error(np.zeros(5)) == 0.0


def test_the_explanation_names_choice_and_runner_up_and_says_when_a_formula_is_as_good():
    rungs = [selection.Rung(f, (score(f, r, n),)) for f, r, n in (
        ("gaussian", 0.00101, 4), ("epsilon-spline", 0.001, 9), ("coulomb", 0.03, 1)
    )]  # fmt: skip
    choice = selection.choose(rungs)
    assert choice.chosen.family == "gaussian"
    assert choice.runner_up.family == "epsilon-spline"
    assert "gaussian" in choice.explanation
    assert "Runner-up: epsilon-spline" in choice.explanation
    assert "A parametric model is as good" in choice.explanation
    without = selection.choose(rungs[1:])
    assert without.chosen.family == "epsilon-spline"
    assert "No parametric model is as good: the best, coulomb, errs 30 times" in without.explanation


def test_a_ladder_whose_every_rung_is_refused_is_a_data_error():
    with pytest.raises(DataError, match="nu-rbf: not finite"):
        selection.choose([selection.Rung("nu-rbf", (), "not finite")])
