"""Logs of loops of another make (`foreign_clocks`): what a logger's convention explains is no warning, a
torque that is truly late or early is told.
"""

import math
from dataclasses import replace

import pytest
from dirty_logs import OFF
from foreign_clocks import BOUC_WEN, ENDS, KARNOPP, MEASURED, TANH, Loop, drawn, identified, written

pytestmark = pytest.mark.compiled

CARRIAGE = Loop(
    linear=True, inertia=1.5, coulomb=4.0, viscous=6.0, travel=0.12, speed=0.4, count=1e-6, seed=4
)  # fmt: skip

SOUND = {
    "a joint, each row begins a command": Loop(law=TANH, log_hz=250.0, control_hz=250.0),
    "a joint, each row ends one": Loop(law=BOUC_WEN, row=ENDS, log_hz=200.0, control_hz=200.0),
    "a joint, measured, quicker than it was logged": Loop(row=MEASURED, log_hz=250.0, seed=3),
    "a joint, measured behind a filter": Loop(
        row=MEASURED, log_hz=500.0, control_hz=500.0, filter_s=3e-4, seed=25
    ),
    "a carriage, each row begins a command": replace(CARRIAGE, law=TANH, log_hz=500.0, control_hz=500.0),
    "a carriage, logged more seldom than it was commanded": replace(
        CARRIAGE, law=BOUC_WEN, log_hz=200.0, program="chirp"
    ),
    "a joint, measured, that looks 1.3 ms early": drawn(25),
    "a joint, measured, that looks .8 ms early": drawn(32),
}

DELAYED = {
    "a joint, 4 ms on a bus": (Loop(bus_s=4e-3, inertia=0.02), "early"),
    "a joint at 250 Hz, 8 ms on a bus": (Loop(bus_s=8e-3, log_hz=250.0, control_hz=250.0), "early"),
    "a carriage, 2 ms on a bus": (replace(CARRIAGE, law=KARNOPP, bus_s=2e-3, program="chirp"), "early"),
    "a carriage, measured 5 ms ago": (
        replace(CARRIAGE, row=MEASURED, bus_s=5e-3, program="chirp", log_hz=500.0),
        "late",
    ),
}


@pytest.mark.parametrize("name", SOUND)
def test_what_a_loggers_convention_explains_is_no_warning(name, tmp_path):
    _, off, found, error = identified(SOUND[name], tmp_path)
    assert not error
    assert all(abs(off[parameter]) <= 0.5 * most for parameter, most in OFF.items()), off
    assert not [text for text in found["warnings"] if "torque looks" in text or "taken so" in text]


def test_how_the_torque_was_taken_stands_beside_the_warnings(tmp_path):
    _, _, found, _ = identified(SOUND["a joint, each row begins a command"], tmp_path)
    (taken,) = found["taken"]
    assert "the command that each row begins" in taken


def test_a_program_of_slow_strokes_has_no_friction_to_be_right_about():
    truth = written(drawn(17)).truth
    assert math.isnan(truth["coulomb_nm"])


@pytest.mark.parametrize("name", DELAYED)
def test_a_torque_truly_of_another_time_is_told(name, tmp_path):
    loop, word = DELAYED[name]
    _, off, found, error = identified(loop, tmp_path)
    assert error or any(abs(off[parameter]) > 0.5 * most for parameter, most in OFF.items()), off
    assert any(f"ms {word}" in text for text in (*found.get("warnings", ()), error))
