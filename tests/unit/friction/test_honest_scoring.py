"""What is held out together, how sure an error is, and that one bad point changes nothing."""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from rtctl.cli.fit import command
from rtctl.errors import DataError
from rtctl.friction.learn import certainty, fit, grids, ladder, search
from rtctl.friction.learn.hold_out import TRAINS, describe, folds_of, units_of, way_for
from rtctl.friction.learn.laps import laps_of
from rtctl.friction.learn.machines import Candidate
from rtctl.friction.learn.point_evidence import with_evidence
from rtctl.friction.learn.report_evidence import interval_nm
from rtctl.friction.learn.report_judge import judge
from rtctl.friction.logs.logs import FrictionSamples, level_points
from rtctl.friction.outliers import without_outliers
from rtctl.friction.points import FrictionPoints
from tests.bench import outliers

QUICK = ladder.Options(
    families=("coulomb_viscous", "gaussian"), symmetric="no", backend="sequential", n_jobs=1
)


def friction(v):
    return 0.25 + 0.1 * np.exp(-((v / 0.15) ** 2)) + 0.05 * v


def log(v, seed=1, noise=0.004, offset=0.0, **columns):
    """Samples of a log with signed velocities v."""
    rng = np.random.default_rng(seed)
    f = friction(np.abs(v)) + rng.normal(0, noise, len(v)) + offset
    rows = [(x, y, np.sign(x), np.nan, np.nan) for x, y in zip(v, f, strict=True)]
    return FrictionPoints.from_rows(rows, "log.csv", "0" * 64, columns)


def wandering(n=600, seed=3, **columns):
    rng = np.random.default_rng(seed)
    v = rng.uniform(0.02, 2, n) * np.where(np.arange(n) % 2, 1, -1)
    return log(v, seed, time_s=0.01 * np.arange(n), **columns)


# ---- whole logs, laps, turns


def test_whole_logs_are_held_out_where_there_are_several():
    points = wandering(log=np.repeat([3.0, 5.0, 9.0], [100, 200, 300]))
    assert way_for(points) == "log"
    assert way_for(replace(points, count=np.full(600, 50.0))) == "log"
    for direction in (1, -1):
        fold = folds_of(points, (direction,), "log")
        of_point = points.columns["log"][points.rows_of(direction)]
        for k in set(fold) - {TRAINS}:
            assert len(set(of_point[fold == k])) == 1
        assert (fold == TRAINS).sum() == 2
    assert "3 folds of whole logs (3 of them)" in describe(points, "log")


def test_logs_without_both_directions_are_not_held_out_by_themselves():
    points = wandering(log=np.tile([0.0, 1.0], 300))  # by turns, as the directions are
    assert way_for(points) == "time"
    with pytest.raises(DataError, match="one log only"):
        way_for(wandering(log=np.zeros(600)), "log")


def test_many_logs_become_folds_of_about_equally_many_samples():
    sizes = np.array([10, 10, 10, 10, 200, 10, 150, 10, 10, 180])
    points = wandering(log=np.repeat(np.arange(10.0), sizes))
    fold = folds_of(points, (1, -1), "log")
    counts = [int((fold == k).sum()) for k in sorted(set(fold) - {TRAINS})]
    assert len(counts) >= 3
    assert max(counts) <= 250, "no fold has much more than its share and the largest log"


def test_stretches_of_time_hold_equally_many_samples_whatever_the_pauses():
    points = wandering()
    points.columns["time_s"][300:] += 1000.0
    fold = folds_of(points, (1,), "time")
    counts = [int((fold == k).sum()) for k in range(5)]
    assert max(counts) - min(counts) <= 3


def lapping(laps, drift=0.0, n=1500):
    """A motion of two harmonics that repeats itself; with `drift` its laps differ."""
    t = np.linspace(0, 10, n)
    phase = 2 * np.pi * laps * t / 10
    x = np.sin(phase) + 0.4 * np.sin(2 * phase + 1) * (1 + drift * np.sin(1.7 * t))
    v = np.gradient(x, t)
    keep = np.abs(v) > 0.05
    return log(v[keep], time_s=t[keep], position_rad=x[keep])


def test_laps_of_a_motion_that_repeats_itself_are_found_and_held_out_whole():
    points = lapping(7)
    assert way_for(points) == "lap"
    laps = laps_of(points)
    assert laps.max() == 6
    true = np.minimum((points.time_s - points.time_s.min()) * 0.7, 6).astype(int)
    assert np.mean(laps != true) < 0.01, "but for a row or two where a lap begins"
    fold, rows = folds_of(points, (1,), "lap"), points.rows_of(1)
    for lap in range(7):
        assert len(set(fold[(laps[rows] == lap) & (fold != TRAINS)])) == 1
    assert laps_of(lapping(3)).max() == 2, "the fewest that show a repeat"


def test_motion_that_does_not_repeat_itself_has_no_laps():
    assert laps_of(lapping(2)) is None, "two are no repeat"
    assert laps_of(lapping(7, drift=3.0)) is None
    assert laps_of(wandering(position_rad=np.cumsum(np.random.default_rng(1).normal(size=600)))) is None
    with pytest.raises(DataError, match="no motion repeats itself"):
        way_for(lapping(7, drift=3.0), "lap")


def test_whole_turns_are_held_out_when_asked():
    points = wandering(position_rad=np.linspace(0, 6 * 2 * np.pi - 0.01, 600))
    np.testing.assert_array_equal(units_of(points, "turn"), np.repeat(np.arange(6), 100))
    with pytest.raises(DataError, match="less than two turns"):
        way_for(wandering(position_rad=np.linspace(0.1, 6, 600)), "turn")
    with pytest.raises(DataError, match="column position_rad"):
        way_for(wandering(), "turn")


def test_several_logs_keep_their_numbers_when_they_are_averaged():
    points = wandering(n=1800)
    samples = FrictionSamples(
        points.time_s, points.velocity_rad_s, points.friction_nm * points.direction, "a, b, c", "0" * 64,
        {"log": np.repeat([0.0, 1.0, 2.0], 600)},
    )  # fmt: skip
    averaged = level_points(samples)
    assert np.isfinite(averaged.columns["log"]).all()
    assert way_for(averaged) == "log"
    assert np.nansum(averaged.count) == 1800


# ---- how sure an error is


def test_the_standard_error_by_blocks_is_that_of_repeated_draws_and_that_of_single_errors_is_not():
    rng = np.random.default_rng(4)
    draws = np.repeat(rng.normal(0, 1, (4000, 20)), 15, axis=1) + rng.normal(0, 0.3, (4000, 300))
    blocks = np.repeat(np.arange(20), 15)
    spread = np.sqrt((draws**2).mean(axis=1)).std()
    by_block = np.mean([certainty.standard_error(draw, blocks) for draw in draws[:300]])
    assert by_block == pytest.approx(spread, rel=0.1)
    assert np.mean([certainty.standard_error(draw) for draw in draws[:300]]) < 0.5 * spread
    assert certainty.standard_error(draws[0], np.arange(300)) == certainty.standard_error(draws[0])


def test_a_ladder_by_logs_is_less_sure_than_one_by_speed_where_the_logs_differ():
    parts = [wandering(n=200, seed=k) for k in range(4)]
    offsets = (0.02, -0.015, 0.01, -0.02)
    v = np.concatenate([part.velocity_rad_s for part in parts])
    f = np.concatenate([part.friction_nm + off for part, off in zip(parts, offsets, strict=True)])
    rows = [(x, y, np.sign(x), np.nan, np.nan) for x, y in zip(v, f, strict=True)]
    points = FrictionPoints.from_rows(rows, "logs", "0" * 64, {"log": np.repeat(np.arange(4.0), 200)})
    by_log, by_speed = (
        ladder.ascend(points, replace(QUICK, folds=way)).choice.chosen for way in ("log", "speed")
    )
    assert by_log.se_nm > 2 * by_speed.se_nm
    low, high = interval_nm(by_log)
    assert high - by_log.rmse_nm == pytest.approx(3.182446 * by_log.se_nm), "Student's t of four logs"
    assert low < by_speed.rmse_nm * 1.2


def test_no_held_out_point_sets_the_scales_of_its_own_fold(monkeypatch):
    v = np.geomspace(0.01, 2, 40)
    points = log(np.concatenate([v, -v]), log=np.tile([0.0, 1.0], 40))
    loud = np.where(points.columns["log"] == 1, 3.0, 1.0) * points.friction_nm
    data = search.side(replace(points, friction_nm=loud), 1, folds="log")
    asked, right = [], search.train

    def spy(one, speed, friction_nm, *more, **options):
        session = np.searchsorted(data.speed, speed)  # of one log all points, or of both
        session = data.session[session]
        asked.append((one.c / friction_nm.max(), one.tube / grids.unit_nm(speed, friction_nm, session)))
        return right(one, speed, friction_nm, *more, **options)

    monkeypatch.setattr(search, "train", spy)
    top, unit = float(data.friction_nm.max()), grids.unit_nm(data.speed, data.friction_nm, data.session)
    search.cross_validate(Candidate("epsilon", "spline", 10 * top, 2 * unit), data)
    assert len(asked) == 3
    np.testing.assert_allclose(asked, [(10, 2)] * 3)


# ---- one bad point


def test_one_bad_point_of_140_changes_no_choice():
    found = outliers.run(8, QUICK, outliers.joint())
    assert found.unchanged >= 0.95
    assert found.error_95 <= 1.2


def test_a_bad_point_decided_before(monkeypatch):
    monkeypatch.setattr(outliers, "without_outliers", lambda points: (points, ()))
    found = outliers.run(2, QUICK, outliers.joint())
    assert found.error_95 > 1.2


@pytest.mark.parametrize(("stribeck", "breakaway"), [(0.15, 0.35), (0.01, 0.6), (0.003, 0.6), (0.5, 0.3)])
def test_a_stribeck_peak_is_no_mistake(stribeck, breakaway):
    v = np.concatenate([[0.0], np.geomspace(0.005, 2, 54)])
    f = 0.25 + (breakaway - 0.25) * np.exp(-((v / stribeck) ** 2)) + 0.05 * v
    rows = [(sign * x, y, sign, np.nan, np.nan) for sign in (1, -1) for x, y in zip(v, f, strict=True)]
    points = FrictionPoints.from_rows(rows, "sharp", "0" * 64)
    assert without_outliers(points) == (points, ())


@pytest.mark.parametrize(("seed", "bad"), [(48, 4), (74, 23), (113, 26), (145, 12)])
def test_a_bad_point_makes_none_of_its_neighbours_bad(seed, bad):
    speed = np.geomspace(0.02, 2, 30)
    friction = 0.2 * (1 + 0.1 * speed) * (1 + 0.05 * np.random.default_rng(seed).standard_t(2.5, 30))
    rows = [(x, y, 1, np.nan, np.nan) for x, y in zip(speed, friction, strict=True)]
    rows += [(-x, y, -1, np.nan, np.nan) for x, y in zip(speed, friction, strict=True)]
    points = FrictionPoints.from_rows(rows, "it scatters", "0" * 64)
    assert without_outliers(points) == (points, ())
    spoilt = points.friction_nm.copy()
    spoilt[points.rows_of(1)[bad]] *= 3
    kept, notes = without_outliers(replace(points, friction_nm=spoilt))
    assert kept.left_out is not None, notes
    assert list(np.flatnonzero(kept.left_out)) == [points.rows_of(1)[bad]]


def test_two_bad_points_of_50_are_mistakes():
    points = outliers.joint(per_direction=50)
    friction = points.friction_nm.copy()
    friction[[12, 31]] *= 3
    kept, notes = without_outliers(replace(points, friction_nm=friction))
    assert kept.left_out is not None, notes
    assert list(np.flatnonzero(kept.left_out)) == [12, 31]


def test_many_bad_points_are_how_the_joint_is():
    points = outliers.joint()
    f = points.friction_nm.copy()
    f[5:60:9] *= 3
    kept, notes = without_outliers(replace(points, friction_nm=f))
    assert kept.left_out is None
    assert "too many for mistakes" in notes[0]


def test_the_command_names_what_it_leaves_out_and_keeps_it_when_told(tmp_path):
    points = outliers.joint()
    signed = points.friction_nm * points.direction
    signed[33] *= 3
    lines = ["velocity_rad_s,friction_torque_nm,direction"]
    lines += [
        f"{v!r},{f!r},{int(d)}"
        for v, f, d in zip(points.velocity_rad_s.tolist(), signed.tolist(), points.direction, strict=True)
    ]
    (tmp_path / "p.csv").write_text("\n".join(lines) + "\n")
    words = ["fit", str(tmp_path / "p.csv"), "--out", str(tmp_path / "m.json"), "--C", "100", "--json"][1:]
    done = CliRunner().invoke(command, words)
    assert done.exit_code == 0, done.output
    assert "is left out: its neighbours in speed say" in done.stderr
    (row,) = json.loads(done.stdout)["left_out"]
    assert row["friction_torque_nm"] == pytest.approx(signed[33])
    kept = json.loads(CliRunner().invoke(command, [*words, "--keep-outliers"]).stdout)
    assert kept["left_out"] == []
    worst = [one["directions"][0]["train_max_error_nm"] for one in (json.loads(done.stdout), kept)]
    assert worst[1] > 10 * worst[0]


# ---- the bound


@pytest.fixture(scope="module")
def bounds():
    """Largest known errors of the same samples, as they are and averaged by more and fewer levels."""
    points = wandering(n=3000)
    samples = FrictionSamples(
        points.time_s, points.velocity_rad_s, points.friction_nm * points.direction, "log", "0" * 64
    )
    found = []
    for averaged in (points, level_points(samples, 60), level_points(samples, 20)):
        model = fit.fit_points(averaged, rig="bench", c=10.0, epsilon_nm=0.004)
        found.append([float(one.error_max_nm.max()) for one in (model, with_evidence(model, averaged))])
    return found


def test_averaging_does_not_make_the_bound_smaller(bounds):
    (single, same), (of_means, many), (_, few) = bounds
    assert same == single
    assert of_means < 0.7 * single, "what the means alone would say"
    assert many == pytest.approx(single, rel=0.25)
    assert few > 0.9 * single, "less is known of 20 levels than of 60"


def test_the_bound_knows_the_test_points():
    points = wandering()
    model = fit.fit_points(points, rig="bench", c=10.0)
    weaker = replace(points, friction_nm=0.7 * points.friction_nm)
    tested = with_evidence(model, points, test=weaker)
    assert (tested.error_max_nm > model.error_max_nm + 0.05).all()
    assert [one.over_bound for one in judge(model, weaker)] != [0, 0]
    assert [one.over_bound for one in judge(tested, weaker)] == [0, 0]
