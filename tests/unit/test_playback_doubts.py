"""What `rtctl playback` says of logs whose regression is not to be trusted."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.friction.logs.dynamics import Dynamics
from rtctl.friction.logs.intervals import Estimate
from rtctl.simulation.playback_doubts import against_identify, another_inertia
from rtctl.simulation.playback_job import Job, run

INERTIA, COULOMB = 4e-4, 0.03


def written(path, unit_nm=1.0, shift=0.0, stiffness_nm_rad=0.0):
    """A log of 8 s of a Coulomb joint that its motor moves, 500 rows a second."""
    t = np.arange(4000) / 500
    w, u = 2 * np.pi * 0.7, 2 * np.pi * 1.9
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


def test_an_inertia_that_turns_blur_is_told_where_nobody_gave_one():
    def known(value):
        return Estimate(value, 0.0, 0.9 * value, 1.1 * value)

    parameters = {"coulomb_nm": known(COULOMB), "inertia_kgm2": known(INERTIA)}
    fit = SimpleNamespace(symmetric=SimpleNamespace(parameters=parameters))
    right = Dynamics(INERTIA, 0.01, COULOMB, -COULOMB, 0.0, 100)
    blurred = replace(right, inertia_kgm2=0.7 * INERTIA)
    assert against_identify(fit, [("a.csv", right)], inertia_given=False) == ()
    (told,) = against_identify(fit, [("a.csv", right), ("b.csv", blurred)], inertia_given=False)
    assert told.startswith(
        "b.csv: the inertia taken here, 0.00028 kg m^2, is not that of rtctl identify --log"
    )
    assert "--inertia-kgm2 0.0004" in told
    assert against_identify(fit, [("b.csv", blurred)], inertia_given=True) == ()
    assert another_inertia(("a.csv", right), [("b.csv", blurred)]) == ()
