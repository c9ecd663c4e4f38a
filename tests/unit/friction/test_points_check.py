"""Points in wrong units are refused against the rig file; copies are refused by themselves."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rtctl.errors import DataError
from rtctl.friction.logs.logs import FrictionSamples, level_points
from rtctl.friction.logs.points_check import doubtful_points, require_held_out, require_plausible_points
from rtctl.friction.point_reader import read_points
from rtctl.friction.points import FrictionPoints
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"
POINTS = CONFIGS / "friction" / "mock_points.csv"


@pytest.fixture(scope="module")
def loaded():
    return load(CONFIGS / "mock.toml")


@pytest.fixture(scope="module")
def points():
    return read_points(POINTS)


def test_points_of_the_rig_are_plausible(points, loaded):
    require_plausible_points(points, loaded)


@pytest.mark.parametrize(
    ("column", "factor", "said"),
    [
        ("velocity_rad_s", 57.3, r"velocity_rad_s: 114\.6 rad/s is not plausible \(at most 7\.5 .*degrees"),
        ("friction_nm", 1e3, r"friction_torque_nm: 39\d\.?\d* N m is not plausible \(at most 2\.5 .*mN m"),
        ("friction_nm", 1e-3, r"no friction above 0\.00039\d N m.*motor's side"),
    ],
)
def test_a_wrong_unit_is_named_with_the_bound(points, loaded, column, factor, said):
    with pytest.raises(DataError, match=said):
        require_plausible_points(replace(points, **{column: factor * getattr(points, column)}), loaded)


def test_points_need_to_fit_one_axis_only(points, loaded):
    small = loaded.config.axis[0].model_copy(update={"torque_limit_nm": 0.01})
    config = loaded.config.model_copy(update={"axis": (small, loaded.config.axis[0])})
    require_plausible_points(points, loaded.model_copy(update={"config": config}))


def test_the_order_of_the_rows_does_not_matter(points, tmp_path):
    header, *rows = POINTS.read_text().splitlines()
    path = tmp_path / "p.csv"
    path.write_text("\n".join([header, *reversed(rows)]))
    for direction in (1, -1):
        for one, other in zip(read_points(path).branch(direction), points.branch(direction), strict=True):
            assert (one == other).all()


def test_a_file_that_holds_its_rows_twice_is_refused_and_a_chance_repeat_is_not(tmp_path):
    header, *rows = POINTS.read_text().splitlines()
    path = tmp_path / "p.csv"
    path.write_text("\n".join([header, *rows, *rows]))
    with pytest.raises(
        DataError, match=r"row 112 repeats row 2 to the last digit, and 109 more.*remove the copies"
    ):
        read_points(path)
    path.write_text("\n".join([header, *rows, rows[3]]))
    read_points(path)


def test_a_fit_is_not_judged_by_the_points_it_was_made_of(points):
    require_held_out(replace(points, sha256="another"), points)
    with pytest.raises(DataError, match="points not trained on"):
        require_held_out(points, points)


def log(**wrong):
    """Points of the rows of a log above .3 rad/s, whose friction is .18 + .03 v, with something else in the
    torque.
    """
    given = {"zero_nm": 0.0, "gravity_nm": 0.0, "inertia_kgm2": 0.0, "noise_nm": 0.01, **wrong}
    t = np.arange(0, 60, 0.01)
    x, v, a = 0.8 * np.sin(2 * t), 1.6 * np.cos(2 * t), -3.2 * np.sin(2 * t)
    torque = np.sign(v) * (0.18 + 0.03 * np.abs(v)) + given["zero_nm"] + given["gravity_nm"] * np.sin(x)
    torque += given["inertia_kgm2"] * a + np.random.default_rng(1).normal(0, given["noise_nm"], len(t))
    kept = np.abs(v) > 0.3
    return level_points(FrictionSamples(t[kept], v[kept], torque[kept], "log.csv", "0" * 64, {}))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"zero_nm": 0.06}, r"differs by 0\.12 N m between the directions, 5\d% of it: "
         r"a torque whose zero is off by 0\.0(6|59)"),
        ({"gravity_nm": 0.15}, "rows of one speed scatter by .*gravity"),
        ({"inertia_kgm2": 0.045}, "rows of one speed scatter by .*acceleration"),
    ],
)  # fmt: skip
def test_what_is_no_friction_in_points_of_a_log_is_named(wrong, said):
    assert not doubtful_points(log(), known=False)
    told = doubtful_points(log(**wrong), known=True)
    assert len(told) == 1
    assert re.search(said, told[0])


def test_units_that_no_hand_held_joint_has_are_named_unless_a_rig_file_knows_better():
    clean = log()
    rpm = replace(clean, velocity_rad_s=clean.velocity_rad_s * 30)
    milli = replace(clean, friction_nm=clean.friction_nm * 1e3)
    assert "in rpm or deg/s, or of the motor before the gear" in doubtful_points(rpm, known=False)[0]
    assert "in mN m, or a current" in doubtful_points(milli, known=False)[0]
    slow = replace(clean, velocity_rad_s=clean.velocity_rad_s * 1e-9)
    assert "is the velocity in another unit?" in doubtful_points(slow, known=False)[0]
    assert not [told for one in (rpm, milli, slow) for told in doubtful_points(one, known=True)]


def table_of(velocity, friction):
    rows = zip(
        velocity,
        np.abs(friction),
        np.sign(velocity),
        np.full(len(velocity), np.nan),
        np.full(len(velocity), np.nan),
        strict=True,
    )
    return FrictionPoints.from_rows(rows, "table.csv", "0")


def test_points_given_twice_of_few_digits_and_that_scatter_are_named():
    speed = np.geomspace(0.02, 5.0, 40)
    v = np.concatenate([speed, -speed])
    f = np.sign(v) * (0.3 + 0.07 * np.abs(v)) * (1 + 0.004 * np.random.default_rng(4).normal(size=80))
    assert not doubtful_points(table_of(v, f), known=True)
    for table, said in (
        (table_of(np.tile(v, 2), np.tile(f, 2)), "80 of 160 points repeat another one"),
        (table_of(v, np.round(f, 1)), r"few digits: steps of 0\.1 N m"),
        (
            table_of(v, f * (1 + 0.3 * np.random.default_rng(5).normal(size=80)).clip(0.1)),
            r"scatters by \d\d%",
        ),
    ):
        (told,) = doubtful_points(table, known=True)
        assert re.search(said, told)


@pytest.mark.parametrize("copies", [1, 2])
def test_points_at_set_speeds_agree_by_chance_and_are_no_copies(copies):
    """Friction of three digits, ten runs at each of twenty speeds: a third agrees with another."""
    rng = np.random.default_rng(0)
    speed = np.tile(np.round(np.geomspace(0.02, 5.0, 20), 3), 10)
    v = np.concatenate([speed, -speed])
    f = (0.3 + 0.07 * np.abs(v)) * (1 + 0.02 * rng.normal(size=len(v)))
    coarse = table_of(np.tile(v, copies), np.tile(np.round(f, 3), copies))
    assert not doubtful_points(coarse, known=True)
    fine = doubtful_points(table_of(np.tile(v, copies), np.tile(f, copies)), known=True)
    assert [said for said in fine if "repeat another" in said] == fine
    assert len(fine) == copies - 1
    # whatever else was measured tells them apart, but for the number of the file that they stand in
    timed = FrictionPoints.from_rows(
        np.column_stack([v, f, np.sign(v), np.full((len(v), 2), np.nan)]).repeat(2, axis=0),
        "table.csv", "0", {"time_s": np.arange(2.0 * len(v)), "log": np.tile([0.0, 1.0], len(v))},
    )  # fmt: skip
    assert not doubtful_points(timed, known=True)
    both = replace(timed, columns={"log": timed.columns["log"]})
    assert "400 of 800 points repeat" in doubtful_points(both, known=True)[0]


def test_a_zero_that_wanders_from_run_to_run_scatters_however_quiet_each_run_is():
    """Each run's own standard deviation was taken for what a point may be off."""
    speed = np.geomspace(0.02, 5.0, 24)
    v = np.concatenate([speed, -speed])
    off = np.random.default_rng(7).normal(0, 0.06, 48)
    runs = table_of(v, np.sign(v) * (0.3 + 0.07 * np.abs(v)) + off)
    runs = replace(runs, std_nm=np.full(48, 0.006), count=np.full(48, 500.0))
    (told,) = doubtful_points(runs, known=True)
    assert re.search(r"scatters by \d\d% .*a zero that wanders from run to run", told)


def test_what_sessions_differ_by_is_no_scatter():
    speed = np.geomspace(0.02, 5.0, 12)
    v = np.tile(np.concatenate([speed, -speed]), 5)
    log = np.repeat(np.arange(5.0), 24)
    f = np.sign(v) * (0.3 + 0.07 * np.abs(v)) * (0.8 + 0.1 * (2 * log % 5))  # warm, cold
    # quicker by a little in each: else they are repeats of a speed
    together = table_of(v * (1 + 0.02 * log), f)
    sessions = replace(together, columns={"log": log})
    assert "scatters by" in doubtful_points(together, known=True)[0]
    assert not doubtful_points(sessions, known=True)
    noisy = replace(sessions, friction_nm=sessions.friction_nm * np.where(np.arange(120) % 2, 1.3, 0.8))
    assert "scatters by" in doubtful_points(noisy, known=True)[0]


def test_acceleration_in_laps_that_repeat_themselves_scatters_and_is_named():
    t = np.arange(0, 60, 0.05)  # whole laps: every speed occurs in each lap, speeding up and slowing down
    v, a = 1.5 * np.cos(np.pi * t / 3 + 0.1), -1.5 * np.pi / 3 * np.sin(np.pi * t / 3 + 0.1)
    friction = np.sign(v) * (0.3 + 0.07 * np.abs(v))
    assert not any("scatters" in one for one in doubtful_points(table_of(v, friction), known=True))
    told = doubtful_points(
        table_of(v, np.sign(v) * np.maximum(0.01, np.sign(v) * (friction + 0.1 * a))), known=True
    )
    assert any(re.search(r"scatters by \d\d% .*acceleration", one) for one in told)
