"""Wrong units in a log are found by the limits of the rig file."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.errors import DataError
from rtctl.friction.logs.against_rig import against_encoder, against_rig
from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.intervals import Estimate
from rtctl.friction.logs.log_input import Gearing, options_of, read_log
from rtctl.friction.logs.plausibility import Limits
from rtctl.rig_file.config import load

CONFIG = Path(__file__).parents[3] / "configs" / "mock.toml"
T = np.arange(5000) / 500.0


@pytest.fixture(scope="module")
def axis():
    return load(CONFIG).config.axis[0]


def read(tmp_path, axis, x, motor, external=None):
    columns = {"time": {"column": "t"}, "position": {"column": "x"}, "motor_torque": {"column": "m"}}
    data = [T, x, motor]
    if external is not None:
        columns["hand_torque"] = {"column": "e"}
        data.append(external)
    path = tmp_path / "log.csv"
    rows = "\n".join(",".join(f"{value:.9g}" for value in row) for row in zip(*data, strict=True))
    path.write_text(f"t,x,m,e\n{rows}\n" if external is not None else f"t,x,m\n{rows}\n")
    (whole,) = read_log(options_of(path, columns, None), Gearing(), limits=Limits.of_axis(axis, "rig.toml"))
    return whole


def motion(amplitude_rad=0.4):
    return amplitude_rad * np.sin(2.5 * T)


def torque(amplitude_nm=0.3):
    return amplitude_nm * np.cos(2.5 * T + 0.1)


def test_a_log_within_the_limits_of_the_rig_is_read(tmp_path, axis):
    hand = 0.5 * np.cos(2.5 * T + 0.6)  # another time than that of the motor
    assert len(read(tmp_path, axis, motion(), torque(), hand).torque_nm) == len(T)


@pytest.mark.parametrize(
    ("signals", "message"),
    [
        ((motion(8.0), torque()), r"column position: 20 rad/s .*at most 7.5 for joint of rig.toml.*unit"),
        (
            (motion(), torque(3.0)),
            r"motor torque: 3 N m .*at most 2.5 for joint of rig.toml.*unit of the torque",
        ),
        ((motion(), torque(), torque(8.0)), r"external torque: 8 N m .*at most 6.25"),
        ((motion(), torque(3e-4)), r"no torque above 0.0003 N m.*at least 0.002 .*unit of the torque"),
    ],
)
def test_a_log_beyond_the_limits_of_the_rig_is_refused(tmp_path, axis, signals, message):
    with pytest.raises(DataError, match=message):
        read(tmp_path, axis, *signals)


def test_a_position_outside_the_travel_is_refused(tmp_path, axis):
    narrow = axis.model_copy(update={"position_min_rad": -0.2, "position_max_rad": 0.6})
    with pytest.raises(DataError, match=r"-0\.4 to 0\.4 rad leaves the travel -0\.25 to 0\.65 rad of joint"):
        read(tmp_path, narrow, motion(), torque())


def fit(inertia, viscous, half=0.0, coulomb=0.2):
    found = {
        "coulomb_nm": Estimate(coulomb, 1e-3, coulomb - 0.002, coulomb + 0.002),
        "inertia_kgm2": Estimate(inertia, 1e-5, inertia - half, inertia + half),
        "viscous_nms_rad": Estimate(viscous, 1e-3, viscous - 0.002, viscous + 0.002),
    }
    return SimpleNamespace(symmetric=SimpleNamespace(parameters=found))


def test_parameters_that_contradict_the_rig_file_are_said(axis):
    assert against_rig(fit(0.013, 0.055), axis, "rig.toml") == ()
    (inertia,) = against_rig(fit(0.7, 0.055), axis, "rig.toml")
    assert "inertia_kgm2 = 0.012, the log says 0.7" in inertia
    (sure,) = against_rig(fit(0.0145, 0.055), axis, "rig.toml")
    assert "inertia_kgm2 = 0.012, the log says 0.0145: a unit or a scale" in sure
    assert against_rig(fit(0.0145, 0.055, 0.003), axis, "rig.toml") == (), "the interval holds it"
    (viscous,) = against_rig(fit(0.012, 0.02978), axis, "rig.toml")
    assert "promises more damping than the log shows (at most 0.0317)" in viscous
    (flank,) = against_rig(fit(0.012, -0.03), axis, "rig.toml")
    assert "friction falls with speed in this log (-0.032 to -0.028 N m s/rad)" in flank
    assert "record faster motion" in flank
    assert "lower it" not in flank
    rubs = axis.model_copy(update={"dry_friction_nm": 0.2})
    assert against_rig(fit(0.013, 0.055, coulomb=0.199), rubs, "rig.toml") == ()
    (dry,) = against_rig(fit(0.013, 0.055, coulomb=0.16), rubs, "rig.toml")
    assert "dry_friction_nm = 0.2 promises more dry friction than the log shows (at most 0.162" in dry


@pytest.mark.parametrize(
    ("scale", "motion", "cause"),
    [
        (180 / np.pi, "rotary", "degrees read as rad"),
        (10 / 9, "rotary", "gon read as degrees"),
        (1 / 0.0254, "linear", "inches read as m"),
        (1.0, "rotary", ""),
        (4.0, "rotary", ""),
        (1.0 / 16, "linear", ""),
        (0.7671, "rotary", ""),
    ],
)
def test_the_steps_of_an_encoder_tell_the_unit_of_a_position(scale, motion, cause):
    counts = 4096.0
    walk = np.cumsum(np.random.default_rng(0).integers(-3, 4, 4000))
    log = AxisLog(500.0, scale * 2 * np.pi / counts * walk, np.zeros(4000), "log.csv", "0")
    told = against_encoder([[log]], counts, motion)
    assert told == () if not cause else cause in told[0]
    assert against_encoder([[log]], 1.0, motion) == (), "nobody said how many counts a turn has"
