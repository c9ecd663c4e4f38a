"""Search, choice and learning: blocked folds, survived failures, one answer whatever the backend."""

import sys

import numpy as np
import pytest
from stribeck_points import V, ascended, options, points, stribeck

from rtctl.errors import DataError
from rtctl.friction import artefact
from rtctl.friction.kind_table import FAMILIES, KERNELS
from rtctl.friction.learn import grids, ladder, search
from rtctl.friction.learn.hold_out import TRAINS, folds_by_speed, folds_by_time
from rtctl.friction.learn.machines import Candidate, train
from rtctl.friction.points import FrictionPoints
from tests.bench.choice import joint

# ---- folds


def test_all_points_of_one_speed_share_a_fold_and_both_ends_always_train():
    speed = np.repeat(np.linspace(0, 1, 12), 3)
    fold = folds_by_speed(speed)
    for level in np.unique(speed):
        assert len(np.unique(fold[speed == level])) == 1
    assert (fold[(speed == 0) | (speed == 1)] == TRAINS).all()
    assert set(fold) == {TRAINS, 0, 1, 2, 3, 4}


def test_folds_by_time_are_five_stretches_of_the_log():
    time_s = np.linspace(10, 20, 1000)
    fold = folds_by_time(time_s)
    assert (np.diff(fold) >= 0).all()
    assert np.bincount(fold).tolist() == pytest.approx([200] * 5, abs=1)
    for bad in (np.full(9, 1.0), np.array([0.0, np.nan, 1.0]), np.array([0.0, 0.01, 9.99, 10.0])):
        with pytest.raises(DataError):
            folds_by_time(bad)


def test_the_search_holds_out_whole_speeds_so_that_a_repeat_cannot_vouch_for_itself():
    # repeats at each speed share an offset that no smooth curve of other speeds can know
    speed = np.repeat(np.linspace(0.1, 1.0, 15), 4)
    offset = np.where(np.arange(15) % 2, 0.05, -0.05)
    friction_nm = 0.3 + np.repeat(offset, 4)
    wiggly = Candidate("epsilon", "rbf", 1e3, 1e-3, {"sigma_rad_s": 0.02})
    blocked = search.Side(1, speed, friction_nm, np.ones(60), folds_by_speed(speed))
    shuffled = search.Side(1, speed, friction_nm, np.ones(60), np.arange(60) % 5)
    assert search.cross_validate(wiggly, shuffled).rmse_nm < 0.003  # what shuffled folds would have believed
    assert search.cross_validate(wiggly, blocked).rmse_nm > 0.04


def test_no_point_is_predicted_by_a_curve_that_saw_its_speed(monkeypatch):
    data = search.side(points(v=np.repeat(V, 2)), 1)
    seen = []

    def spy(candidate, speed, *rest, **more):
        seen.append(set(speed))
        return train(candidate, speed, *rest, **more)

    monkeypatch.setattr(search, "train", spy)
    search.cross_validate(Candidate("epsilon", "spline", 100.0, 0.003), data)
    *folds, whole = seen  # the last one counts the support vectors and predicts nothing
    assert len(folds) == 5
    assert whole == set(data.speed)
    for k, speeds in enumerate(folds):
        assert speeds.isdisjoint(data.speed[data.fold == k])
        assert {0.0, 2.0} <= speeds


# ---- machines


def test_break_away_points_weigh_more():
    data = search.side(points(), 1, break_away_weight=4.0)
    assert data.weight[data.speed == 0].tolist() == [4.0]
    assert set(data.weight[data.speed > 0]) == {1.0}
    stiff = Candidate("epsilon", "polynomial", 0.01, 1e-3, {"degree": 2.0})
    off = [
        abs(
            train(stiff, data.speed, data.friction_nm, np.where(data.speed == 0, w, 1.0)).curve(np.zeros(1))[
                0
            ]
            - data.friction_nm[0]
        )
        for w in (1.0, 20.0)
    ]
    assert off[1] < 0.5 * off[0]


def test_break_away_of_one_direction_alone_weighs_as_much_in_what_is_deployed():
    moving = V[1:]
    own = [(way * v, 0.3, way, np.nan, np.nan) for v in moving for way in (1, -1)]
    one = FrictionPoints.from_rows([*own, (0.0, 0.6, -1, np.nan, np.nan)], "one", "0" * 64)
    asked = ladder.Options(
        families=("coulomb",), symmetric="no", backend="sequential", n_jobs=1, break_away_weight=4.0
    )
    model = ladder.learn(one, ladder.ascend(one, asked), rig="mock")
    learned = [float(branch.magnitude(np.array([1.0]))[0]) for branch in model.branches]
    assert learned == pytest.approx([0.3, 0.3 + 4 * 0.3 / (len(moving) + 4)])


def test_a_nu_machine_reports_the_tube_it_found():
    data = search.side(points(), 1)
    found = train(Candidate("nu", "spline", 100.0, 0.3), data.speed, data.friction_nm, np.ones(25))
    again = train(
        Candidate("epsilon", "spline", 100.0, found.epsilon_nm), data.speed, data.friction_nm, np.ones(25)
    )
    assert 0 < found.epsilon_nm < 0.01
    assert np.abs(found.curve(V) - again.curve(V)).max() < 2e-4


@pytest.mark.parametrize(("family", "strategy"), [("epsilon-rbf", "full"), ("nu-spline", "halving")])
def test_no_curve_has_more_support_vectors_than_asked(family, strategy):
    measured = points()
    few = {"families": (family,), "strategy": strategy, "symmetric": "no"}
    free, bound = (
        [len(branch.support_vectors) for branch in ladder.learn(measured, found, rig="mock").branches]
        for found in (
            ladder.ascend(measured, options(**few, tolerance_share=0.0)),
            ladder.ascend(measured, options(**few, max_support_vectors=8)),
        )
    )
    assert max(bound) <= 8 < max(free)


def test_the_number_that_is_chosen_by_is_that_of_the_model_as_it_is_written():
    found = ascended("epsilon-rbf")
    model = ladder.learn(points(), found, rig="mock")
    counts = [score.n_terms for score in found.choice.chosen.scores]
    assert counts == [len(branch.support_vectors) for branch in model.branches]


def test_quiet_points_do_not_buy_support_vectors_with_an_error_below_the_tolerance(monkeypatch):
    monkeypatch.setattr(KERNELS["spline"], "c_shares", (300.0, 1e3, 3e3))
    quiet = points(noise=2e-4)
    few = {"families": ("nu-spline",), "strategy": "full", "symmetric": "no"}
    strict, default = (
        ladder.ascend(quiet, options(**few, **more)) for more in ({"tolerance_share": 0.0}, {})
    )
    assert default.tolerance_nm == pytest.approx(0.005 * max(quiet.friction_nm))
    assert strict.choice.chosen.rmse_nm < default.choice.chosen.rmse_nm <= default.tolerance_nm
    assert default.choice.chosen.n_terms < 0.7 * strict.choice.chosen.n_terms
    assert "count as equal" in default.explanation
    assert "count as equal" not in strict.explanation


def test_directions_alike_share_one_curve_and_directions_that_differ_do_not():
    families = ("gaussian", "epsilon-spline")
    alike = ladder.ascend(points(backward=stribeck), options(families=families))
    assert alike.symmetric
    assert "as good" in alike.explanation
    model = ladder.learn(points(backward=stribeck), alike, rig="mock")
    assert model.magnitude(0.7) == model.magnitude(-0.7)
    differ = ladder.ascend(points(), options(families=families))
    assert not differ.symmetric
    assert "Each direction has its own: one symmetric curve errs" in differ.explanation
    model = ladder.learn(points(), differ, rig="mock")
    assert model.magnitude(-0.7) == pytest.approx(1.1 * model.magnitude(0.7), rel=0.02)


def test_directions_that_differ_by_little_share_no_curve_that_is_expected_to_err_more():
    """Three percent apart: within one standard error of its own a shared curve was as good, and it errs 1.7
    times as much.
    """
    _, made, truth, _ = joint(4)
    found = ladder.ascend(made, options(families=("lorentzian",)))
    assert not found.symmetric
    apart = ladder.learn(made, found, rig="made")
    shared = ladder.learn(made, found, rig="made", rung=found.symmetric_rung)
    speed, friction = truth.branch(-1)
    off = [
        float(np.sqrt(np.mean((model.branches[1].magnitude(speed) - friction) ** 2)))
        for model in (apart, shared)
    ]
    assert off[0] < 0.7 * off[1]


def test_symmetric_by_order_is_one_curve_however_wrong():
    found = ladder.ascend(points(), options(families=("epsilon-spline",), symmetric="yes"))
    model = ladder.learn(points(), found, rig="mock")
    assert found.symmetric
    assert model.magnitude(1.0) == model.magnitude(-1.0)
    assert model.branches[0].hyper_parameters["symmetric"] == 1.0


@pytest.mark.parametrize("backend", ["threading", "loky"])
def test_every_backend_finds_the_same(backend):
    few = {"families": ("gaussian", "epsilon-spline"), "symmetric": "no"}
    one = ascended(*few["families"])
    other = ladder.ascend(points(),
        options(**few, backend=backend) if backend == "threading" else ladder.Options(
        **few, backend=backend, n_jobs=2
    ))  # fmt: skip
    assert one.explanation == other.explanation
    for a, b in zip(one.choice.rungs, other.choice.rungs, strict=True):
        assert np.array_equal(a.errors, b.errors)
        assert [s.candidate for s in a.scores] == [s.candidate for s in b.scores]


def test_progress_is_told_up_to_the_end():
    told = []
    ladder.ascend(
        points(),
        options(families=("epsilon-spline",), symmetric="no"),
        lambda done, of: told.append((done, of)),
    )
    assert told[-1][0] == told[-1][1]
    assert len(told) > 3


@pytest.mark.parametrize("family", FAMILIES)
def test_the_winner_of_every_rung_can_be_saved_read_and_run(family, tmp_path):
    measured = points()
    found = ascended(family)
    model = ladder.learn(measured, found, rig="mock")
    artefact.save(model, tmp_path / "m.json")
    again = artefact.load(tmp_path / "m.json")
    assert np.array_equal(again.record(), model.record())
    assert again.kind == family.split("-")[-1]
    assert again.selection == found.explanation
    v = np.linspace(-2, 2, 4001)
    side = (v < 0).astype(int)
    source = np.where(side, again.branches[1].kernel_sum(np.abs(v)), again.branches[0].kernel_sum(np.abs(v)))
    assert np.abs(again.magnitude(v) - source).max() <= max(b.rounding_bound_nm for b in again.branches)
    assert max(b.rounding_bound_nm for b in again.branches) <= 1.01e-6 * again.friction_max_nm


def test_the_grids_have_the_papers_sizes():
    sizes = {f: len(grids.candidates(f, V, stribeck(V))) for f in FAMILIES}
    assert sizes["epsilon-rbf"] == sizes["nu-rbf"] == 105
    assert sizes["epsilon-spline"] == sizes["nu-spline"] == 40
    with pytest.raises(ValueError, match="unknown family"):
        grids.candidates("epsilon-magic", V, stribeck(V))


def test_the_noise_of_points_is_estimated_from_them_alone():
    v = np.sort(np.random.default_rng(2).uniform(0, 2, 400))
    f = stribeck(v) + np.random.default_rng(3).normal(0, 0.004, 400)
    assert grids.noise_nm(v, f) == pytest.approx(0.004, rel=0.15)
    assert grids.noise_nm(v, np.full(400, 0.3)) == pytest.approx(3e-4)


@pytest.mark.parametrize("processes", [False, True], ids=["threads", "processes"])
def test_a_real_dask_cluster_finds_the_same(processes):
    distributed = pytest.importorskip("distributed", reason="the extra rtctl[dask] is not installed")
    dask = pytest.importorskip("dask")
    few = {"families": ("gaussian", "epsilon-spline"), "symmetric": "no"}
    one = ascended(*few["families"])
    busy = {"distributed.comm.timeouts.connect": "120s", "distributed.comm.timeouts.tcp": "120s"}
    with (
        dask.config.set(busy),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=processes, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster),
    ):
        other = ladder.ascend(points(), ladder.Options(**few, backend="dask", n_jobs=2))
    assert one.explanation == other.explanation
    for a, b in zip(one.choice.rungs, other.choice.rungs, strict=True):
        assert np.array_equal(a.errors, b.errors)


def test_dask_without_its_extra_is_refused_with_the_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(DataError, match=r"rtctl\[dask\]"):
        ladder.ascend(points(), ladder.Options(families=("coulomb",), backend="dask"))
