"""What `rtctl playback` learns from, and what it says of logs whose regression is not to be trusted."""

import numpy as np
import pytest

from rtctl.friction.logs.log_input import Gearing
from rtctl.friction.logs.log_points import points_of_logs
from rtctl.simulation.playback_job import Job, run

INERTIA, COULOMB = 4e-4, 0.03


def written(path, unit_nm=1.0, shift=0.0, stiffness_nm_rad=0.0, hertz=(0.7, 1.9)):
    """A log of 8 s of a Coulomb joint that its motor moves, 500 rows a second."""
    t = np.arange(4000) / 500
    w, u = 2 * np.pi * np.array(hertz)
    v = 0.8 * np.sin(w * t + shift) + 0.3 * np.sin(u * t)
    a = 0.8 * w * np.cos(w * t + shift) + 0.3 * u * np.cos(u * t)
    x = -0.8 / w * np.cos(w * t + shift) - 0.3 / u * np.cos(u * t)
    tau = (INERTIA * a + COULOMB * np.tanh(v / 0.01) + stiffness_nm_rad * x) / unit_nm
    np.savez(path, t=t, x=x, tau=tau + 3e-4 / unit_nm * np.random.default_rng(1).normal(size=len(t)))
    return path


def test_a_log_in_another_unit_than_those_that_friction_is_of_is_told(tmp_path):
    free, milli = tmp_path / "free.npz", tmp_path / "milli.npz"
    columns = {"time": {"column": "t"}, "position": {"column": "x"}, "motor_torque": {"column": "tau"}}
    of = Job(log=written(milli, 1e-3, 0.6), fit_from=(written(free),), inertia_kgm2=INERTIA, **columns)
    told = run(of)["fit"]["warnings"]
    assert any("milli.npz: its inertia by regression is" in one and "another unit" in one for one in told)


def test_a_spring_that_a_hand_pulls_is_neither_inertia_nor_friction(tmp_path):
    columns = {"time": {"column": "t"}, "position": {"column": "x"}, "hand_torque": {"column": "tau"}}
    free, sprung = written(tmp_path / "free.npz"), written(tmp_path / "b.npz", 1.0, 0.6, 0.3)
    result = run(Job(log=sprung, fit_from=(free,), **columns))
    log, felt = result["log"], result["interaction"]["forward"]
    # the balance with the spring in it was refused: -0.0082 kg m^2, as a sign turned round
    assert log["inertia_kgm2"] == pytest.approx(INERTIA, rel=0.1)
    assert "it is taken for a spring" in result["warnings"][0]
    assert felt["friction_rms_nm"] == pytest.approx(COULOMB, rel=0.1)
    assert felt["hand_rms_nm"] > 1.5 * COULOMB


def test_friction_is_learned_from_the_points_that_identify_makes(tmp_path):
    columns = {"position": {"column": "x"}, "motor_torque": {"column": "tau"}}
    brisk = written(tmp_path / "brisk.npz", hertz=(4.1, 9.3))
    result = run(Job(log=brisk, fit_from=(brisk,), time={"column": "t"}, **columns))
    found, _ = points_of_logs([brisk], {"time": {"column": "t"}, **columns}, Gearing())
    fit = result["fit"]
    assert fit["points"] == len(found.count)
    assert fit["inertia_kgm2"] == result["log"]["inertia_kgm2"] == pytest.approx(INERTIA, rel=0.03)
    assert fit["regression"]["coulomb_nm"] == pytest.approx(COULOMB, rel=0.03)
    # a regression that counts the rows at turns, as the one learned from did
    assert result["log"]["regression"]["coulomb_nm"] < 0.7 * COULOMB
    assert result["prediction"]["rmse_sliding_nm"] < 0.1 * COULOMB < result["prediction"]["rmse_nm"]
