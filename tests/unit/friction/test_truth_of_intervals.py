"""Logs that are not quite of the model: intervals hold the truth, coarse encoders are seen, and no direction
is trusted with more friction than it has.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from dirty_logs import said_by

from rtctl.cli.fit import command as fit_command
from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.intervals import covariance, telling_blocks
from rtctl.friction.logs.log_checks import diagnose, with_coarseness
from rtctl.friction.logs.other_readings import doubts
from rtctl.friction.logs.regression import joint_fit, taken_late
from rtctl.friction.logs.regressors import regressors

J, B, F = 0.01, 0.05, 0.25


def motion(rate_hz=250.0, seconds=20.0, waves=((0.6, 0.31), (0.25, 0.83), (0.1, 1.9))):
    """Time, position, velocity and acceleration of some sines."""
    t = np.arange(round(rate_hz * seconds)) / rate_hz
    each = [(a, 2 * np.pi * f, p) for p, (a, f) in enumerate(waves)]
    x = sum(a * np.sin(w * t + p) for a, w, p in each)
    v = sum(a * w * np.cos(w * t + p) for a, w, p in each)
    return t, x, v, -sum(a * w * w * np.sin(w * t + p) for a, w, p in each)


def log_of(x, torque, rate_hz=250.0, **more):
    return AxisLog(rate_hz, x, torque, "made-up log", "0" * 64, **more)


def torque_of(v, a, friction=None, noise=0.01, seed=1):
    plain = F * np.sign(v) + B * v if friction is None else friction
    return J * a + plain + noise * np.random.default_rng(seed).standard_normal(len(v))


def test_a_log_of_the_model_itself_has_hardly_any_doubt():
    _, x, v, a = motion()
    found = joint_fit(regressors(log_of(x, torque_of(v, a)))).symmetric.parameters
    for name, truth in (("inertia_kgm2", J), ("viscous_nms_rad", B), ("coulomb_nm", F)):
        assert found[name].holds(truth), name
        assert found[name].doubt < 3 * found[name].standard_error, name
        half = 0.5 * (found[name].high - found[name].low)
        assert half > found[name].doubt, "what is random is in the interval, too"


@pytest.mark.parametrize("late_s", [0.002, -0.002])
def test_an_interval_holds_the_truth_of_a_torque_that_is_late(late_s):
    t, x, v, a = motion()
    torque = np.interp(t - late_s, t, torque_of(v, a, noise=0.002))
    found = joint_fit(regressors(log_of(x, torque))).symmetric.parameters
    viscous = found["viscous_nms_rad"]
    assert viscous.holds(B)
    random = viscous.high - viscous.low - 2 * viscous.doubt
    assert abs(viscous.value - B) > 0.5 * random, "by chance alone it would not"


def test_an_interval_holds_the_inertia_where_friction_grows_with_the_torque():
    _, x, v, a = motion(waves=((0.6, 0.5), (0.25, 1.3)))
    friction = F * np.sign(v) + B * v + 0.15 * np.sign(v) * np.abs(J * a)
    signals = regressors(log_of(x, torque_of(v, a, friction, noise=0.001)))
    found = joint_fit(signals)
    assert doubts(signals)[0] > 0.02 * J
    assert found.symmetric.parameters["inertia_kgm2"].holds(J)
    each = found.per_direction.parameters
    assert each["level_forward_nm"].doubt == found.symmetric.parameters["coulomb_nm"].doubt


@pytest.mark.parametrize("resampled", [False, True])
def test_an_encoder_that_is_coarse_for_its_motion_is_told_however_far_it_turned(resampled):
    """1024 counts over four turns are a fine position and a coarse acceleration."""
    _, x, v, a = motion(1000.0, 30.0, ((12.0, 0.05), (1.0, 0.13)))
    step = 2 * np.pi / 1024
    torque = torque_of(v, a, noise=0.001)
    counted = step * np.floor(x / step)
    if resampled:  # as uneven stamps are: between two rows, off the grid of the encoder
        counted = 0.5 * (counted[:-1] + counted[1:])
        torque = 0.5 * (torque[:-1] + torque[1:])
    log = log_of(counted, torque, 1000.0, step_rad=step)
    signals = regressors(log)
    signals = with_coarseness([[log]], signals, 0.03)
    assert joint_fit(signals).symmetric.parameters["inertia_kgm2"].value < 0.7 * J
    assert signals.inertia_short > 0.3
    assert [said for said in diagnose([[log]], signals) if "too coarse" in said]
    fine = log_of(x, torque_of(v, a, noise=0.001), 1000.0)
    assert with_coarseness([[fine]], regressors(fine), 0.03).inertia_short < 0.02


def test_a_current_measured_with_the_position_is_known_where_it_is_surely_not_held():
    t, x, v, a = motion(50.0, 40.0)
    torque = torque_of(v, a, noise=0.02)
    held_back = np.interp(t + 0.01, t, torque)  # as a command that is held is put back
    signals = regressors(log_of(x, held_back, 50.0), cutoff_hz=10.0)
    assert taken_late(signals, 0.01) == 0
    assert taken_late(regressors(log_of(x, torque, 50.0), cutoff_hz=10.0), 0.01) == 0.01
    held_on = np.interp(t + 0.02, t, torque)  # a command that begins with its row, put back likewise
    assert taken_late(regressors(log_of(x, held_on, 50.0), cutoff_hz=10.0), 0.01) == -0.01


def rows(path, friction, seed=0, noise=0.002):
    speeds = np.concatenate([np.linspace(0.05, 3.0, 30), -np.linspace(0.05, 3.0, 30)])
    g = np.random.default_rng(seed)
    lines = ["velocity_rad_s,friction_torque_nm"]
    lines += [f"{v},{np.sign(v) * friction(abs(v)) + noise * g.standard_normal()}" for v in speeds]
    path.write_text("\n".join(lines) + "\n")
    return path


def fit(*words):
    return CliRunner().invoke(fit_command, [str(word) for word in words])


def test_a_right_model_holds_on_the_next_session_although_a_line_has_seen_it(tmp_path):
    points = rows(tmp_path / "a.csv", lambda v: F + B * v)
    done = fit(points, "--out", tmp_path / "m.json", "--C", "10")
    assert done.exit_code == 0, done.output
    for seed in range(1, 5):
        judged = fit(
            rows(tmp_path / f"{seed}.csv", lambda v: F + B * v, seed),
            "--judge",
            tmp_path / "m.json",
            "--json",
        )
        assert not [said for said in json.loads(judged.output)["faults"] if "Coulomb" in said], seed
    bent = rows(tmp_path / "bent.csv", lambda v: 0.8 * F + 1.5 * B * v, 9)
    said = json.loads(fit(bent, "--judge", tmp_path / "m.json", "--json").output)["faults"]
    assert sum("Coulomb" in each for each in said) == 2


def asymmetric(tmp_path, *options):
    """A log whose forward friction is twice a third of the backward one; its points, and the least friction
    of a model of them.
    """
    t, x, v, a = motion(500.0, 30.0)
    friction = np.where(v > 0, 0.2, -0.3) + B * v
    path = tmp_path / "log.csv"
    np.savetxt(
        path,
        np.column_stack([t, x, torque_of(v, a, friction, 0.003)]),
        delimiter=",",
        header="time_s,x,h",
        comments="",
    )
    code, _, err = said_by(
        "--log",
        str(path),
        "--column",
        "position=x",
        "--column",
        "external=h",
        "--out",
        str(tmp_path / "found"),
        "--json",
        *options,
    )
    assert code == 0, err
    done = fit(tmp_path / "found" / "points.csv", "--out", tmp_path / "m.json", "--C", "10")
    assert done.exit_code == 0, done.output
    from rtctl.friction import artefact

    model = artefact.load(tmp_path / "m.json")
    return list(model.friction_min_nm - model.error_max_nm)


def test_no_direction_is_trusted_with_more_friction_than_it_has_for_a_zero_nobody_knows(tmp_path):
    forward, backward = asymmetric(tmp_path)
    assert 0.1 < forward <= 0.2
    assert 0.1 < backward <= 0.3


def test_a_zero_that_is_known_takes_nothing_off(tmp_path):
    forward, backward = asymmetric(tmp_path, "--keep-offset")
    assert 0.17 < forward <= 0.201
    assert 0.27 < backward <= 0.301
    (tmp_path / "zero").mkdir()
    assert min(asymmetric(tmp_path / "zero", "--offset-is-zero")) > 0.22


def test_even_strokes_are_said_not_to_tell_the_inertia(tmp_path):
    """To and fro at constant speeds: every acceleration lies beside a turn."""
    t = np.arange(0, 40, 0.004)
    speed = np.repeat([0.2, 0.5, 1.0, 2.0, 0.3, 0.8, 1.5, 0.4, 1.2, 0.6], 1000)[: len(t)]
    v = speed * np.where((t / 2 % 1) < 0.5, 1.0, -1.0)
    x = np.cumsum(v) * 0.004 + 0.01 * np.sin(t)  # no two strokes pass the same places
    torque = F * np.sign(v) + B * v + 0.02 * np.random.default_rng(4).standard_normal(len(t))
    path = tmp_path / "log.csv"
    np.savetxt(path, np.column_stack([t, x, torque]), delimiter=",", header="time_s,x,h", comments="")
    code, out, err = said_by("--log", str(path), "--column", "position=x", "--column", "external=h", "--json")
    assert code == 0, err
    assert [text for text in json.loads(out)["warnings"] if "hardly tells the inertia" in text]


@pytest.mark.parametrize("late_s", [0.003, -0.003])
def test_an_interval_holds_the_inertia_of_a_damped_joint_whose_torque_is_late(late_s):
    """The inertia is off by b d, jerk or not."""
    t, x, v, a = motion()
    viscous = 0.5
    torque = np.interp(t - late_s, t, torque_of(v, a, F * np.sign(v) + viscous * v, noise=0.002))
    inertia = joint_fit(regressors(log_of(x, torque))).symmetric.parameters["inertia_kgm2"]
    assert abs(inertia.value / J - 1) > 0.1
    assert inertia.holds(J)
    assert inertia.doubt < 2 * abs(viscous * late_s), "not much wider than it need be"


def bursts(seed, count=2, seconds=60.0, rate_hz=100.0):
    """Slow strokes, and a few brisk ones: the only ones that tell an inertia."""
    t = np.arange(round(seconds * rate_hz)) / rate_hz
    brisk = sum(np.exp(-(((t - at) / 0.4) ** 2)) for at in np.linspace(0.2, 0.8, count) * seconds)
    x = (
        0.6 * np.sin(2 * np.pi * 0.11 * t)
        + 0.25 * np.sin(2 * np.pi * 0.37 * t)
        + 0.06 * brisk * np.sin(9 * t)
    )
    v, a = np.gradient(x, t), np.gradient(np.gradient(x, t), t)
    noise = np.convolve(np.random.default_rng(seed).standard_normal(len(t) + 24), np.ones(25) / 5, "valid")
    return log_of(x, torque_of(v, a, noise=0.0) + 0.02 * noise, rate_hz)


def test_an_inertia_that_two_bursts_tell_has_an_interval_that_holds_it():
    """Sums of scores over blocks held it in half of these: what the bursts leave over is fitted away."""
    held, halves = [], []
    for seed in range(40):
        found = joint_fit(regressors(bursts(seed), 10.0)).symmetric.parameters["inertia_kgm2"]
        by_chance = replace(found, low=found.low + found.doubt, high=found.high - found.doubt)
        held.append(by_chance.holds(J))
        halves.append(0.5 * (by_chance.high - by_chance.low))
    assert np.mean(held) >= 0.85
    assert np.median(halves) < 3 * J


def test_blocks_that_tell_a_column_are_counted():
    block = np.repeat(np.arange(10), 100)
    rng = np.random.default_rng(0)
    even, two = rng.normal(size=1000), rng.normal(size=1000) * (block < 2)
    found = telling_blocks(np.column_stack([even, two]), block)
    assert found[0] > 9
    assert 1.7 < found[1] < 2.1


def test_a_variance_is_not_too_small_where_two_blocks_tell_a_column():
    """What such blocks leave over is fitted away: scores summed say a third of the variance."""
    block, rng = np.repeat(np.arange(10), 100), np.random.default_rng(4)
    found, said = [], []
    for _ in range(200):
        column = rng.normal(size=10)[block] * (block < 2) + 0.01 * rng.normal(size=1000)
        matrix = np.column_stack([np.ones(1000), column])
        noise = rng.normal(size=10)[block]
        solution = np.linalg.lstsq(matrix, noise, rcond=None)[0]
        scale = np.abs(column).max()
        found.append((solution[1] * scale) ** 2)
        said.append(covariance(matrix, noise - matrix @ solution, block, 0)[1, 1] * scale**2)
    assert np.median(said) > 0.7 * np.median(found)


def test_columns_that_say_the_same_have_a_covariance_all_the_same():
    """It ended in a traceback: a column of place that one rig's own motion made equal to another."""
    random = np.random.default_rng(5)
    one, other, noise = random.standard_normal((3, 400))
    block = np.repeat(np.arange(20), 20)
    alone = covariance(np.column_stack([one, other]), noise, block, 0)
    twice = covariance(np.column_stack([one, other, other]), noise, block, 0)
    assert twice[0, 0] == pytest.approx(alone[0, 0], rel=1e-6)
    assert np.array([0.0, 1.0, 1.0]) @ twice @ np.array([0.0, 1.0, 1.0]) == pytest.approx(
        alone[1, 1], rel=1e-6
    )
