"""The mean of rungs: a kind like the others, its shares, its file, and when the ladder takes it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rtctl.errors import ModelError
from rtctl.friction import artefact
from rtctl.friction.document import checksum, render
from rtctl.friction.kind_compile import compile_curve, sampled_error
from rtctl.friction.kind_curve import Curve
from rtctl.friction.learn import fit, grids, ladder, mean, search
from rtctl.friction.learn.machines import Candidate, train
from rtctl.friction.learn.score import Score
from rtctl.friction.learn.selection import Rung
from rtctl.friction.model import FrictionModel
from rtctl.friction.points import FrictionPoints

PEAK = {"coulomb_nm": 0.2, "viscous_nms_rad": 0.03, "breakaway_nm": 0.35, "stribeck_rad_s": 0.08}
TOP = 2.0
V = np.linspace(0, TOP, 4001)


def spline() -> Curve:
    return Curve("spline", {}, np.array([0.1, 0.4, 1.5]), np.array([0.3, -0.5, 0.2]), 0.25)


def rbf() -> Curve:
    return Curve("rbf", {"sigma_rad_s": 0.3}, np.array([0.1, 0.9]), np.array([0.1, -0.1]), 0.3)


PARTS = [(0.5, spline()), (0.3, rbf()), (0.2, Curve.formula("lorentzian", PEAK))]


def points(law: object = None, noise: float = 0.004, n: int = 24) -> FrictionPoints:
    rng = np.random.default_rng(3)
    v = np.linspace(0.05, 2, n)
    f = 0.2 + 0.08 * np.arcsinh(v / 0.1)
    rows = [
        (sign * x, share * y + noise * rng.normal(), sign, np.nan, np.nan)
        for sign, share in ((1, 1.0), (-1, 1.2))
        for x, y in zip(v, f, strict=True)
    ]
    return FrictionPoints.from_rows(rows, "made", "0" * 64)


def options(**more: object) -> ladder.Options:
    families = ("coulomb_viscous", "tustin", "lorentzian", "epsilon-spline")
    return ladder.Options(**{"families": families, "backend": "sequential", **more})  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def climbed() -> ladder.Ladder:
    return ladder.ascend(points(), options())


@pytest.fixture(scope="module")
def model(climbed: ladder.Ladder) -> FrictionModel:
    return ladder.learn(points(), climbed, rig="made")


def test_it_is_the_mean_of_its_parts_in_every_derivative() -> None:
    whole = Curve.mean(PARTS)
    np.testing.assert_allclose(whole(V), sum(share * part(V) for share, part in PARTS), atol=1e-14)
    for order in (1, 4, 7):
        wanted = sum(share * part.derivative(V, order) for share, part in PARTS)
        np.testing.assert_allclose(whole.derivative(V, order), wanted, rtol=1e-12)
    seen = np.abs(whole.derivative(V, 6))
    assert (seen <= whole.derivative_bound(6, V)).all()
    assert (whole.n_terms, whole.n_support_vectors) == (3 + 2 + 4, 3 + 2)


def test_its_table_is_proved_and_has_the_knots_of_a_spline_among_its_own() -> None:
    whole = Curve.mean(PARTS)
    table, bound = compile_curve(whole, TOP)
    assert sampled_error(whole, table, TOP) <= bound < 1e-6
    assert set(spline().support_vectors) <= set(table.knots)
    assert np.abs(table(V) - whole(V)).max() <= bound


def test_of_exact_parts_it_is_exact_but_for_rounding() -> None:
    line = Curve.formula("coulomb_viscous", {"coulomb_nm": 0.2, "viscous_nms_rad": 0.1})
    table, bound = compile_curve(Curve.mean([(0.25, spline()), (0.75, line)]), TOP)
    assert bound < 1e-11
    assert len(table.knots) == 1 + len(spline().support_vectors)


def test_a_mean_that_bends_too_finely_says_what_to_do() -> None:
    fine = Curve("rbf", {"sigma_rad_s": 1e-3}, np.array([0.1, 0.9]), np.array([0.1, -0.1]), 0.3)
    with pytest.raises(ModelError, match="--no-mean"):
        compile_curve(Curve.mean([(0.5, fine), (0.5, rbf())]), 20.0)


def rung(family: str, errors: np.ndarray, luck_nm2: float = 0.0, refused: str | None = None) -> Rung:
    scores = tuple(Score(Candidate("formula", family), way, errors, 2.0) for way in (1, -1))
    return Rung(family, scores, refused, luck_nm2=luck_nm2)


def test_shares_fall_with_what_a_rung_is_expected_to_err_not_with_what_it_was_lucky_to() -> None:
    one = np.ones(4)
    found = mean.shares([rung("tustin", one), rung("gaussian", 2**0.5 * one), rung("coulomb", 3 * one)])
    assert found.keys() == {"tustin", "gaussian"}  # three times the error has 1/6561 of the weight
    assert found["tustin"] / found["gaussian"] == pytest.approx(16)
    assert sum(found.values()) == pytest.approx(1)
    lucky = mean.shares([rung("tustin", one), rung("gaussian", one, luck_nm2=1.0)])
    assert lucky["tustin"] / lucky["gaussian"] == pytest.approx(16)


def test_a_refused_rung_leaves_its_share_to_the_others() -> None:
    one = np.ones(4)
    rungs = [rung("tustin", one), rung("gaussian", -one), rung("coulomb", one, refused="not positive")]
    made = mean.mean_of(rungs, {"tustin": 0.3, "gaussian": 0.3, "coulomb": 0.4})
    assert made is not None
    np.testing.assert_allclose(made.errors, 0.0)
    assert [share for share, _ in made.scores[0].candidate.parts] == [0.5, 0.5]
    assert mean.mean_of(rungs[1:], {"gaussian": 0.5, "coulomb": 0.5}) is None


def test_what_is_held_out_of_it_is_what_a_cross_validation_holds_out(climbed: ladder.Ladder) -> None:
    for score, side in zip(climbed.choice.chosen.scores, climbed.sides, strict=True):
        again = search.cross_validate(score.candidate, side)
        np.testing.assert_allclose(score.errors, again.errors, atol=1e-6)
        assert score.n_terms == again.n_terms


def test_the_ladder_takes_it_where_errors_are_no_longer_equal_and_says_so(climbed: ladder.Ladder) -> None:
    choice = climbed.choice
    assert choice.chosen.family == "mean"
    assert choice.runner_up is not None
    assert climbed.explanation.startswith("Chosen: the mean of ")
    assert f"One rung alone would be {choice.runner_up.family}" in climbed.explanation
    assert "parametric model" in climbed.explanation


def test_a_formula_that_is_refused_for_its_numbers_alone_has_a_share_as_a_curve() -> None:
    """A peak whose tail is all that was measured: Coulomb + viscous alone stood, and erred with it."""
    rng = np.random.default_rng(1)
    v = np.geomspace(0.1, 2, 16)
    few = options(families=("coulomb_viscous", "tustin"), symmetric="no", tolerance_share=0.0)

    def climbed(noise: float, **more: str) -> ladder.Ladder:
        rows = [
            (sign * x, 0.2 + 0.3 * np.exp(-x / 0.08) + noise * rng.normal(), sign, np.nan, np.nan)
            for sign in (1, -1)
            for x in v
        ]
        return ladder.ascend(FrictionPoints.from_rows(rows, "made", "0" * 64), replace(few, **more))

    for found in (climbed(0.03), climbed(0.03, symmetric="yes")):
        tustin = next(rung for rung in found.choice.rungs if rung.family == "tustin")
        assert (tustin.refused or "").startswith("no_points_below_stribeck_speed")
        assert "tustin" in [part.family for _, part in found.choice.chosen.scores[0].candidate.parts]
    # the others err so much more that they have no share
    for found in (climbed(0.002), climbed(0.002, symmetric="auto")):
        assert found.choice.chosen.family == "tustin"
        assert "as a curve, for its numbers are not told" in found.explanation
        assert found.choice.chosen in found.choice.rungs
    assert found.symmetric


def test_errors_that_count_as_equal_leave_the_fewest_numbers() -> None:
    found = ladder.ascend(points(), options(tolerance_share=0.2))
    assert [one.family for one in found.choice.rungs].count("mean") == 0
    assert found.choice.chosen.family == "coulomb_viscous"


@pytest.mark.parametrize("more", [{"mean": False}, {"max_support_vectors": 40}])
def test_one_rung_stands_where_it_is_asked_for(more: dict[str, object]) -> None:
    found = ladder.ascend(points(), options(**more))
    assert "mean" not in [one.family for one in found.choice.rungs]


def test_directions_that_are_the_same_share_one_mean() -> None:
    one = points()
    both = replace(one, friction_nm=one.friction_nm / np.where(one.direction > 0, 1.0, 1.2))
    found = ladder.ascend(both, options(symmetric="yes"))
    assert (found.choice.chosen.family, found.symmetric) == ("mean", True)
    learned = ladder.learn(both, found, rig="made")
    np.testing.assert_array_equal(learned.magnitude(V[1:]), learned.magnitude(-V[1:]))


def test_its_file_holds_every_part(model: FrictionModel, tmp_path: Path) -> None:
    artefact.save(model, tmp_path / "m.json")
    read = artefact.load(tmp_path / "m.json")
    assert read.kind == "mean"
    np.testing.assert_array_equal(read.magnitude(V), model.magnitude(V))
    for one, other in zip(read.branches, model.branches, strict=True):
        assert [share for share, _ in one.parts] == [share for share, _ in other.parts]
        np.testing.assert_array_equal(one.source(V), other.source(V))
        assert fit.compile_error_nm(one) <= one.rounding_bound_nm


def spoilt(path: Path, change: object) -> None:
    document = json.loads(path.read_text())
    change(document["branches"]["forward"])  # type: ignore[operator]
    document["sha256"] = checksum(document)
    path.write_text(render(document))


def one_share_more(branch: dict) -> None:  # type: ignore[type-arg]
    branch["parts"][0]["share"] *= 1.01


def one_part_less(branch: dict) -> None:  # type: ignore[type-arg]
    branch["parts"].pop()


def another_number(branch: dict) -> None:  # type: ignore[type-arg]
    branch["parts"][0]["parameters"]["coulomb_nm"] += 1e-4


def another_parameter(branch: dict) -> None:  # type: ignore[type-arg]
    branch["parts"][0]["parameters"]["sigma_rad_s"] = 1.0


def of_itself(branch: dict) -> None:  # type: ignore[type-arg]
    branch["parts"][0] |= {"kind": "mean", "parameters": {}}


def with_vectors(branch: dict) -> None:  # type: ignore[type-arg]
    branch["support_vectors"], branch["dual_coef"] = [0.1], [0.2]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (one_share_more, "shares are 1 together"),
        (one_part_less, "shares are 1 together"),
        (another_number, "forward"),
        (another_parameter, "parts.0.parameters"),
        (of_itself, "parts"),
        (with_vectors, "no support vectors"),
    ],
)
def test_a_file_that_is_no_mean_is_refused(
    model: FrictionModel, tmp_path: Path, change: object, said: str
) -> None:
    path = tmp_path / "m.json"
    artefact.save(model, path)
    spoilt(path, change)
    with pytest.raises(ModelError, match=said):
        artefact.load(path)


def test_a_curve_of_one_kind_has_no_parts(tmp_path: Path) -> None:
    path = tmp_path / "m.json"
    learned = ladder.learn(points(), ladder.ascend(points(), options(mean=False)), rig="made")
    artefact.save(learned, path)
    part = {"share": 1.0, "kind": "coulomb", "parameters": {"coulomb_nm": 0.2}, "intercept": 0.0}
    spoilt(path, lambda branch: branch.update(parts=[{**part, "support_vectors": [], "dual_coef": []}]))
    with pytest.raises(ModelError, match="parts"):
        artefact.load(path)


def test_a_fold_of_fewer_points_has_every_part_in_its_own_scale() -> None:
    v, f = points().branch(1)
    some = np.arange(len(v)) % 2 == 0
    part = grids.candidates("epsilon-spline", v, 3 * f)[0]
    whole = Candidate.mean([(0.5, part), (0.5, Candidate("formula", "coulomb"))])
    scaled = grids.in_scale_of(whole, v, 3 * f, some)
    assert scaled.parts[0][1] == grids.in_scale_of(part, v, 3 * f, some) != part
    assert train(scaled, v[some], f[some], np.ones(some.sum())).curve.kind == "mean"


def test_what_sessions_differ_by_is_no_noise() -> None:
    rng = np.random.default_rng(1)
    v = np.tile(np.linspace(0.1, 2, 200), 2)
    session = np.repeat([0, 1], 200)
    f = 0.3 + 0.1 * v + 0.05 * session + 0.002 * rng.normal(size=400)
    assert grids.noise_nm(v, f) > 0.01
    assert grids.noise_nm(v, f, session) == pytest.approx(0.002, rel=0.2)
    few = np.arange(len(v)) % 200 < 2
    assert grids.noise_nm(v[few], f[few], session[few]) == grids.noise_nm(v[few], f[few])


def test_a_tube_is_as_wide_for_all_sessions_as_without_one() -> None:
    one = points(noise=0.001)
    log = np.arange(len(one.direction)) % 2.0
    apart = replace(one, friction_nm=one.friction_nm + 0.03 * log, columns={"log": log})
    data = search.side(apart, 1, folds="log")
    candidate = grids.candidates("epsilon-spline", data.speed, data.friction_nm, session=data.session)[0]
    assert data.session is not None
    alone = grids.in_scale_of(candidate, data.speed, data.friction_nm, data.session == 0, data.session)
    assert alone.tube == pytest.approx(candidate.tube, rel=0.5)
