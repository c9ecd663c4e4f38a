"""Logs of rigs of another make (`other_rigs`): right parameters, or a warning that names the cause."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from dirty_logs import OFF, said_by
from other_loggers import Logger, log_of
from other_rigs import BLIMAN_SORINE, DAHL, GMS, Rig

from hw.motion import name as key
from rtctl.friction.logs.log_input import Gearing, options_of, read_log

pytestmark = pytest.mark.compiled

RIGHT = {
    "Maxwell slip of Leuven, many sines": (Rig(law=GMS), Logger()),
    "Bliman and Sorine, moves": (Rig(law=BLIMAN_SORINE, program="moves"), Logger()),
    "a peak that lags, chirp": (Rig(law=DAHL, lag=0.05, stribeck=0.1, program="chirp"), Logger()),
    "bristles of 30 mrad, many sines": (Rig(law=DAHL, bend=0.03, breakaway=0.25, travel=0.6), Logger()),
    "measured together at 50 Hz": (Rig(program="moves"), Logger(rate_hz=50.0)),
    "heavy, hardly any friction": (Rig(coulomb=0.02, breakaway=0.025, viscous=0.01), Logger()),
    "a small motor": (
        Rig(inertia=2e-4, coulomb=0.02, breakaway=0.026, viscous=2e-3, servo=(2.0, 0.03), kt=0.05),
        Logger(counts=16384.0, current_step=2e-3),
    ),
}

CARRIAGE = Rig(
    inertia=1.2, coulomb=6.0, breakaway=7.5, stribeck=0.01, viscous=5.0, bend=2e-5, travel=0.05,
    servo=(6e3, 150.0), kt=20.0,
)  # fmt: skip
"""A linear axis: the numbers of `Rig` in m, N and kg, N/A."""

MICROMETRE = Logger(counts=2 * math.pi / 1e-6)

CARRIAGES = {
    "moves": (replace(CARRIAGE, law=BLIMAN_SORINE, program="moves", travel=0.5), MICROMETRE, None),
    "many sines": (replace(CARRIAGE, law=DAHL, lag=0.02), MICROMETRE, None),
    "a stiff belt": (replace(CARRIAGE, law=DAHL, inertia=0.4, link=0.8, shaft=8e4), MICROMETRE, None),
    "a soft belt": (replace(CARRIAGE, inertia=0.4, link=0.8, shaft=1500.0), MICROMETRE, r"no noise.*elastic"),
    "play": (replace(CARRIAGE, inertia=0.4, link=0.8, play=3e-3, shaft=4e4), MICROMETRE, r"no noise.*play"),
    "one direction rubs more": (
        replace(CARRIAGE, law=BLIMAN_SORINE, asymmetry=0.2),
        MICROMETRE,
        r"an offset of 1\.2 N, .* --keep-offset",
    ),
    "a current that was filtered": (
        CARRIAGE,
        replace(MICROMETRE, current_filter_hz=20.0),
        r"force looks .* late",
    ),
}
"""Carriages, what wrote their logs, and the cause that is named; None: right, and no alarm."""

NAMED = {
    "an elastic shaft": (Rig(inertia=0.004, link=0.008, shaft=15.0), Logger(), r"no noise.*elastic shaft"),
    "play behind the motor": (
        Rig(inertia=0.004, link=0.008, play=0.03),
        Logger(on_link=True),
        r"no noise.*play",
    ),
    "play, seen from the motor": (
        Rig(inertia=0.008, link=0.013, play=0.01, program="moves"),
        Logger(),
        r"no noise.*play",
    ),
    "friction that differs by direction": (
        Rig(law=BLIMAN_SORINE, asymmetry=0.2, program="moves"),
        Logger(),
        r"an offset of .* --keep-offset",
    ),
    "cogging": (Rig(ripple=0.15, program="moves"), Logger(), r"depends on the position"),
    "a current that was filtered": (
        Rig(program="moves"),
        Logger(current_filter_hz=20.0),
        r"torque looks .* late",
    ),
}


def identified(log, folder, place="rad", effort="Nm"):
    path, scale = folder / "log.csv", {"rad": 1.0, "mm": 1e3}[place]
    columns = np.column_stack([log.time, scale * log.position, log.torque])
    np.savetxt(path, columns, delimiter=",", header="time_s,x,motor", comments="", fmt="%.9g")
    code, out, err = said_by(
        *("--log", str(path), "--column", f"position=x:{place}", "--column", f"torque=motor:{effort}"),
        *("--gear-ratio", "1", "--json"),
    )
    assert code == 0, err
    found = json.loads(out)
    values = found["symmetric"]["parameters"]
    off = {name: values[key(name, found["motion"])]["value"] / truth - 1 for name, truth in log.truth.items()}
    return off, found["warnings"]


@pytest.mark.parametrize("name", CARRIAGES)
def test_a_carriage_of_another_make_is_right_or_its_cause_is_named(name, tmp_path):
    rig, logger, cause = CARRIAGES[name]
    off, warnings = identified(log_of(rig, logger), tmp_path, "mm", "N")
    assert not [text for text in warnings if re.search(r"\brad\b|N m\b|kg m|torque looks", text)]
    if cause:
        assert any(re.search(cause, text) for text in warnings), warnings
    else:
        assert all(abs(off[parameter]) <= most for parameter, most in OFF.items()), off
        assert not warnings


@pytest.mark.parametrize("name", RIGHT)
def test_a_sound_log_of_another_make_gives_its_parameters_and_no_alarm(name, tmp_path):
    off, warnings = identified(log_of(*RIGHT[name]), tmp_path)
    assert all(abs(off[parameter]) <= 0.5 * most for parameter, most in OFF.items()), off
    assert not warnings


@pytest.mark.parametrize("name", NAMED)
def test_what_the_model_does_not_know_is_named(name, tmp_path):
    rig, logger, cause = NAMED[name]
    _, warnings = identified(log_of(rig, logger), tmp_path)
    assert any(re.search(cause, text) for text in warnings), warnings


@pytest.mark.parametrize(
    ("rig", "load", "place", "effort"), [(Rig(law=DAHL), 2.0, "rad", "Nm"), (CARRIAGE, 1.6, "mm", "N")]
)
def test_logs_of_two_loads_are_told_for_it(rig, load, place, effort, tmp_path):
    arguments = ["--column", f"position=x:{place}", "--column", f"torque=motor:{effort}", "--json"]
    for k, each in enumerate((rig, replace(rig, inertia=load * rig.inertia))):
        log, scale = log_of(each, MICROMETRE), {"rad": 1.0, "mm": 1e3}[place]
        columns = np.column_stack([log.time, scale * log.position, log.torque])
        path = tmp_path / f"{k}.csv"
        np.savetxt(path, columns, delimiter=",", header="time_s,x,motor", comments="", fmt="%.9g")
        arguments += ["--log", str(path)]
    _, out, err = said_by(*arguments, "--gear-ratio", "1")
    told = re.search(r"the inertia differs between the logs, ([\d.]+) \S.* in 0\.csv, ([\d.]+) k", out + err)
    assert told, out + err
    assert float(told[2]) / float(told[1]) == pytest.approx(load, rel=0.03)


def test_friction_that_bends_over_speed_is_no_change_within_the_log(tmp_path):
    _, warnings = identified(
        log_of(Rig(law=DAHL, power=2.0, viscous=0.03, program="moves"), Logger()), tmp_path
    )
    assert not [text for text in warnings if re.search(r"changes within|not proportional", text)]


def test_turns_that_are_quicker_than_the_rows_are_no_jumps(tmp_path):
    log = log_of(Rig(law=DAHL, program="ramps", seconds=60.0), Logger(rate_hz=50.0))
    path = tmp_path / "log.csv"
    np.savetxt(
        path,
        np.column_stack([log.time, log.position, log.torque]),
        delimiter=",",
        header="time_s,x,m",
        comments="",
    )
    mapped = {"position": {"column": "x"}, "motor_torque": {"column": "m"}}
    (found,) = read_log(options_of(path, mapped, None), Gearing(), 0.0)
    assert np.abs(found.position_rad - log.position).max() < 1e-6
    assert not [note for note in found.notes if "position" in note]
