"""Logs of foreign joints that somebody processed before they were given: filled in by straight lines, cut to
whole steps, too short. What was done is named, and put right or held by the interval.
"""

import re
from dataclasses import replace

import numpy as np
import pytest
from foreign_clocks import BOUC_WEN, KARNOPP, MEASURED, Loop, drawn, identified, written
from scipy.ndimage import uniform_filter1d

from rtctl.errors import DataError
from rtctl.friction.logs.dynamics import AxisLog, smooth
from rtctl.friction.logs.logs import FrictionSamples, level_points
from rtctl.friction.logs.row_noise import rounded_again, row_noise
from rtctl.friction.logs.signal_shift import derivatives

pytestmark = pytest.mark.compiled

SINES = Loop(
    program="sines", travel=1.2, count=2 * np.pi / 65536, law=BOUC_WEN, coulomb=0.2, seconds=25, seed=3
)
CARRIAGE = Loop(
    linear=True, inertia=1.5, viscous=6.0, coulomb=5.0, travel=0.12, speed=0.4, count=5e-6, law=KARNOPP,
    row=MEASURED, filter_s=3e-4, log_hz=500.0, seconds=25, seed=6,
)  # fmt: skip
BRAKED = Loop(program="chirp", travel=1.0, inertia=0.05, coulomb=0.2, hertz=8.0, speed=6.0, seconds=25)
"""Its torque brakes as often as it drives."""

FILLED = r"straight lines between values"


def filled(loop, column, hertz):
    """The log with one column known at `hertz` only, at times between its rows, and interpolated."""
    log = written(loop)
    at = np.arange(log.time[0], log.time[-1], 1 / hertz) + 1.37e-3
    known = np.interp(at, log.time, getattr(log, column))
    return replace(log, **{column: np.interp(log.time, at, known)})


@pytest.mark.parametrize("loop", [SINES, CARRIAGE], ids=["joint", "carriage"])
@pytest.mark.parametrize(("column", "hertz"), [("torque", 23.0), ("position", 47.0), ("position", 20.0)])
def test_a_column_that_was_filled_in_is_told_and_its_inertia_right(loop, column, hertz, tmp_path):
    _, off, found, error = identified(loop, tmp_path, log=filled(loop, column, hertz))
    assert not error
    (told,) = [text for text in found["warnings"] if "straight lines between values" in text]
    assert f"{column}: straight" in told.replace("force", "torque")
    assert f"({hertz:.3g} Hz)" in told
    assert abs(off["inertia_kgm2"]) < 0.04, off


@pytest.mark.parametrize("loop", [SINES, CARRIAGE, BRAKED], ids=["joint", "carriage", "braked"])
def test_nothing_is_taken_for_filled_in_that_was_measured(loop, tmp_path):
    _, _, found, _ = identified(loop, tmp_path)
    assert not [text for text in found["warnings"] if "straight lines" in text or "whole steps" in text]
    assert not [text for text in found["warnings"] if "looks smoothed" in text]


def test_an_encoder_at_one_speed_is_not_filled_in(tmp_path):
    """Counts that come at even times stand between them."""
    log = written(SINES)
    coarse = replace(log, position=np.floor(log.position / 2e-3) * 2e-3)
    _, _, found, _ = identified(SINES, tmp_path, log=coarse)
    assert not [text for text in found["warnings"] if "straight lines" in text]


@pytest.mark.parametrize(
    "loop",
    [SINES, CARRIAGE, replace(drawn(202), seconds=20)],
    ids=["joint", "carriage", "friction of another law"],
)
def test_a_torque_whose_digits_were_cut_off_is_told_and_held_by_the_interval(loop, tmp_path):
    log, step = written(loop), 0.4 * loop.coulomb
    _, off, found, _ = identified(loop, tmp_path, log=replace(log, torque=np.trunc(log.torque / step) * step))
    assert -0.22 < off["coulomb_nm"] < -0.18
    (told,) = [text for text in found["warnings"] if "whole steps" in text]
    assert re.search(r"2[56] % of the Coulomb friction", told)
    values = found["symmetric"]["parameters"]
    coulomb = values.get("coulomb_nm") or values["coulomb_n"]
    assert coulomb["low"] < log.truth["coulomb_nm"] < coulomb["high"]


def test_steps_that_change_nothing_are_no_warning(tmp_path):
    log, step = written(SINES), 0.1 * SINES.coulomb
    _, _, found, _ = identified(SINES, tmp_path, log=replace(log, torque=np.trunc(log.torque / step) * step))
    assert not [text for text in found["warnings"] if "whole steps" in text]


def test_a_torque_that_brakes_shows_that_it_was_rounded(tmp_path):
    log, step = written(BRAKED), 0.4 * BRAKED.coulomb
    _, off, found, _ = identified(
        BRAKED, tmp_path, log=replace(log, torque=np.round(log.torque / step) * step)
    )
    assert abs(off["coulomb_nm"]) < 0.02
    assert not [text for text in found["warnings"] if "whole steps" in text]


@pytest.mark.parametrize(("column", "seconds"), [("position", 0.2), ("torque", 0.2), ("position", 0.1)])
def test_a_column_that_was_smoothed_both_ways_is_told(column, seconds, tmp_path):
    log = written(SINES)
    rows = round(seconds / float(np.median(np.diff(log.time)))) | 1
    spoilt = replace(log, **{column: uniform_filter1d(getattr(log, column), rows)})
    _, off, found, _ = identified(SINES, tmp_path, log=spoilt)
    assert abs(off["inertia_kgm2"]) > 0.08
    assert any(f"the {column} looks smoothed both ways" in text for text in found["warnings"])


def test_a_smoothed_position_turns_its_friction_over_as_slowly(tmp_path):
    """With the sign of the motion as it is the cause explained too little of this chirp, and another one was
    told."""
    loop = drawn(3002)
    log = written(loop)
    rows = round(0.2 * loop.log_hz) | 1
    spoilt = replace(log, position=uniform_filter1d(log.position, rows, mode="nearest"))
    _, off, found, _ = identified(loop, tmp_path, log=spoilt)
    assert off["inertia_kgm2"] > 0.2
    assert any("the position looks smoothed both ways" in text for text in found["warnings"])


@pytest.mark.parametrize("later_s", [0.0, 0.06])
def test_an_echo_of_the_torque_is_told_and_a_late_torque_is_none(later_s, tmp_path):
    log = written(SINES)
    step = float(np.median(np.diff(log.time)))
    rows = round((later_s or 0.02) / step)
    before = np.concatenate([np.full(rows, log.torque[0]), log.torque[:-rows]])
    torque = log.torque + 0.4 * before if later_s else before
    _, _, found, error = identified(SINES, tmp_path, log=replace(log, torque=torque))
    said = " ".join([*found.get("warnings", ()), error])
    assert ("came once more" in said) == bool(later_s), said
    assert later_s or "the drive's echo of a command" in said


@pytest.mark.parametrize(
    ("loop", "column", "share"),
    [(SINES, "torque", 0.6), (SINES, "position", 5e-3), (CARRIAGE, "position", 2e-3)],
    ids=["torque", "position", "carriage"],
)
def test_noise_and_coarse_steps_look_smoothed_to_nobody(loop, column, share, tmp_path):
    """A mean of the other column, too, takes away what they leave over."""
    log, rng = written(loop), np.random.default_rng(5)
    torque = log.torque + share * loop.coulomb * rng.normal(size=len(log.torque))
    step = share * np.ptp(log.position)
    noisy = {"torque": torque, "position": np.floor(log.position / step) * step}[column]
    code, _, found, _ = identified(loop, tmp_path, log=replace(log, **{column: noisy}))
    assert code == 0
    assert not [text for text in found["warnings"] if "looks smoothed" in text]


def test_noise_of_rows_is_as_large_as_it_was_made_and_none_of_a_smoothed_column():
    rng, t = np.random.default_rng(2), np.arange(20000) / 500
    x = np.sin(2 * np.pi * 0.4 * t) + 1e-5 * rng.normal(size=len(t))
    tau = 0.2 * np.sign(np.cos(2 * np.pi * 0.4 * t)) + 0.1 * rng.normal(size=len(t))
    log = AxisLog(500.0, x, tau, "a.csv", "0" * 64)
    found = row_noise([[log]], 20.0)
    alone = row_noise([[replace(log, torque_nm=rng.normal(size=len(t)))]], 20.0)
    assert found.torque_nm.std() == pytest.approx(0.1 * alone.torque_nm.std(), rel=0.1)
    white = derivatives(smooth(1e-5 * rng.normal(size=len(t)), 500.0, 20.0), 1 / 500)
    assert found.motion[:, 0].std() == pytest.approx(white[1].std(), rel=0.15)
    rows = {"torque_nm": uniform_filter1d(tau, 101), "position_rad": uniform_filter1d(x, 101)}
    after = row_noise([[replace(log, **rows)]], 20.0)
    assert after.torque_nm.std() < 0.1 * found.torque_nm.std()
    assert after.motion[:, 0].std() < 0.2 * found.motion[:, 0].std()


def test_the_steps_of_a_position_that_was_resampled_are_those_it_was_recorded_with():
    """Between uneven stamps no step is left in the column."""
    t = np.arange(4000) / 500
    x = np.interp(t + 1e-3 * np.sin(7 * t), t, np.floor(np.sin(2 * np.pi * 0.4 * t) / 0.01) * 0.01)
    log = AxisLog(500.0, x, np.zeros(len(t)), "a.csv", "0" * 64, step_rad=0.01)
    again = rounded_again(log, 20.0).position_rad / 0.01 + 0.5
    assert again == pytest.approx(np.round(again), abs=1e-9)


def test_short_logs_are_told_for_short(tmp_path):
    n, rng = 120, np.random.default_rng(0)
    v = np.where(np.arange(n) % 2, 1, -1) * rng.uniform(0.1, 1, n)
    log = np.repeat(np.arange(12.0), 10)
    samples = FrictionSamples(np.arange(n) * 0.01, v, 0.2 * np.sign(v), "a.csv", "0" * 64, {"log": log})
    with pytest.raises(DataError, match=r"a\.csv: too short: no log has 8 samples of motion"):
        level_points(samples)
