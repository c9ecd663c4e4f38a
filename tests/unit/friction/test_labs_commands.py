"""Logs of what labs command: torque steps and random binary torques, quick strokes that few rows are of;
each is right and not called dirty."""

from itertools import pairwise

import numpy as np
import pytest

from rtctl.errors import DataError
from rtctl.friction.logs.log_input import Gearing, options_of, read_log
from rtctl.friction.logs.regression import joint_fit
from rtctl.friction.logs.regressors import of_stretches
from rtctl.friction.logs.row_faults import Rows, mended

MAPPED = {"position": {"column": "q"}, "motor_torque": {"column": "tau"}}
INERTIA, COULOMB, VISCOUS = 0.02, 0.15, 0.03


def moved(torque):
    """Position, at every row of 1 kHz, of a joint with dry and viscous friction that a torque drives."""
    q, v, path, step = 0.0, 0.0, [], 2.5e-4
    for u in torque:
        path.append(q)
        for _ in range(4):
            friction = np.copysign(COULOMB, v) + VISCOUS * v
            after = v + step / INERTIA * (u - friction)
            if v == 0.0:
                after = step / INERTIA * np.copysign(max(abs(u) - COULOMB, 0.0), u)
            v = 0.0 if after * v < 0 else float(after)
            q += step * v
    return np.array(path)


def fitted(folder, time_s, position, torque):
    path = folder / "log.csv"
    rows = np.column_stack([time_s, position, torque])
    np.savetxt(path, rows, delimiter=",", header="time_s,q,tau", comments="", fmt="%.9g")
    stretches = read_log(options_of(path, MAPPED, None), Gearing())
    fit = joint_fit(of_stretches(stretches))
    notes = (*fit.warnings, *(note for each in stretches for note in each.notes))
    return {name: each.value for name, each in fit.symmetric.parameters.items()}, " ".join(notes)


STEPS = np.array([1.0, 0.0, -1.0, 0.0, 0.7, -0.7, 0.0, 1.3, -1.3, 0.0])
BINARY = np.sign(np.random.default_rng(3).standard_normal(160))


@pytest.mark.parametrize(
    ("levels", "rows"), [(np.tile(STEPS, 6), 300), (BINARY, 120)], ids=["steps", "binary"]
)
def test_a_torque_that_is_switched_is_neither_of_a_slower_bus_nor_coarse(levels, rows, tmp_path):
    torque = 0.5 * np.repeat(levels, rows)
    position = 2e-5 * np.round(moved(torque) / 2e-5)
    found, told = fitted(tmp_path, 1e-3 * np.arange(len(torque)), position, torque)
    assert found["inertia_kgm2"] == pytest.approx(INERTIA, rel=0.03)
    assert found["coulomb_nm"] == pytest.approx(COULOMB, rel=0.05)
    assert "slower bus" not in told
    assert "coarse" not in told


def test_a_torque_of_a_slower_bus_is_still_told():
    t = 1e-3 * np.arange(20_000)
    torque = np.repeat(np.sin(3 * t) + 0.2 * np.sin(17 * t), 1)[np.arange(20_000) // 8 * 8]
    rows = mended(Rows("log", t, np.sin(2 * t), {"motor torque": torque}))
    assert any("slower bus" in note for note in rows.notes)


def strokes(rate_hz, seconds=0.35):
    """Position at each row of moves there and back, smooth, of changing length, with a rest between."""
    t = np.arange(int(40 * rate_hz)) / rate_hz
    ends = np.random.default_rng(2).uniform(-0.8, 0.8, 60)
    q = np.full(len(t), ends[0])
    for k, (a, b) in enumerate(pairwise(ends)):
        s = np.clip((t - 0.7 * k) / seconds, 0, 1)
        q += (b - a) * s**3 * (10 - 15 * s + 6 * s**2)
    return t, q


@pytest.mark.parametrize("rate_hz", [20.0, 30.0, 50.0])
def test_quick_strokes_of_few_rows_are_no_jumps(rate_hz):
    t, q = strokes(rate_hz)
    assert not mended(Rows("log", t, q.copy(), {})).notes


@pytest.mark.parametrize("rate_hz", [50.0, 250.0])
def test_a_jump_of_a_smooth_motion_is_still_told(rate_hz):
    t = np.arange(int(40 * rate_hz)) / rate_hz
    q = 0.6 * np.sin(2.4 * t) + 0.2 * np.sin(7 * t)
    q[len(q) // 2 :] += 0.15
    (note,) = mended(Rows("log", t, q, {})).notes
    assert "1 jumps" in note


def test_strokes_of_few_rows_of_a_slow_log_are_no_certain_fault():
    rng = np.random.default_rng(3)
    there = np.cumsum(rng.choice([-1.0, 1.0], 150) * rng.uniform(0.5, 1, 150))
    path = np.repeat(there, 4) + rng.normal(0, 1e-3, 600)  # there within .1 s, and at rest for .3 s
    slow = mended(Rows("log", np.arange(600) / 10, path.copy(), {}))
    assert "or brisk motion (at 10 rows a second they look alike" in slow.notes[0]
    to_and_fro = np.sin(0.05 * np.arange(600)) + rng.normal(0, 1e-3, 600)
    to_and_fro[20:580:16] += rng.uniform(0.3, 0.6, 35)
    left = mended(Rows("log", np.arange(600) / 10, to_and_fro.copy(), {}))
    assert "left as they are" in left.notes[0]
    np.testing.assert_array_equal(left.position_rad, to_and_fro)
    with pytest.raises(DataError, match="spikes"):
        mended(Rows("log", np.arange(600) / 200, to_and_fro.copy(), {}))
