"""Every shipped rig file of a described serial device, run against its simulated device."""

import contextlib
import math

import numpy as np
import pytest
from serial_played import Played


@pytest.fixture
def play(tmp_path):
    with contextlib.ExitStack() as stack:

        def _play(name, port, **plant):
            made = stack.enter_context(contextlib.closing(Played(tmp_path, name, port, plant)))
            made.open()
            return made

        yield _play


def angle(rig):
    return float(rig.sim.plant.state["position_rad"][0, 0])


@pytest.mark.parametrize(
    ("name", "port"),
    [
        ("serial-vesc.toml", "/tmp/rtctl-vesc"),
        ("serial-described.toml", "/tmp/rtctl-board"),
        ("serial-simplefoc.toml", "/tmp/rtctl-foc"),
    ],
)
def test_a_described_device_is_driven_followed_and_let_go(play, name, port):
    rig = play(name, port)
    first = float(rig.cycles(3, enabled=0)["position_rad"][0]) - angle(rig)
    assert not rig.board.enabled or not rig.board.output.any()
    seen = [float(rig.cycles(1, current_a=1.5)["position_rad"][0]) for _ in range(150)]
    assert rig.board.output[0] == pytest.approx(1.5)
    assert angle(rig) > 2 * math.radians(4.5), "two turns of the motor and more"
    assert seen[-1] - first == pytest.approx(angle(rig), abs=0.03)
    assert (np.diff(seen) > -1e-4).all()
    tick = rig.cycles(1, current_a=1.5)
    if "current" in rig.backend.provides:
        assert tick["current_a"][0] == pytest.approx(1.5, abs=0.2)
    assert not tick["link_faults"]
    assert tick["sample_count"] > 140
    rig.backend.stop()
    rig.sim.listen()
    assert not rig.board.output.any()
    rig.cycles(1, enabled=0)
    rig.cycles(3, current_a=1.5)
    assert rig.board.output.any()
    rig.silence(15)
    assert not rig.board.output.any(), "its own time-out"


def test_the_fault_of_a_vesc_is_a_device_fault(play):
    rig = play("serial-vesc.toml", "/tmp/rtctl-vesc")
    rig.board.drive_fault = True
    assert rig.cycles(3, enabled=0)["link_faults"] & 16


def test_a_vesc_that_is_not_asked_says_nothing(play):
    rig = play("serial-vesc.toml", "/tmp/rtctl-vesc")
    count = int(rig.cycles(3, enabled=0)["sample_count"])
    rig.silence(5)
    rig.backend.read(rig.tick)
    assert rig.tick["sample_count"][0] <= count + 1


def test_a_simplefoc_board_is_switched_on_when_armed_and_off_when_not(play):
    rig = play("serial-simplefoc.toml", "/tmp/rtctl-foc")
    rig.cycles(2, enabled=0)
    assert not rig.board._on
    rig.cycles(1, current_a=1.0)
    assert rig.board._on
    assert not rig.board.output.any()
    tick = rig.cycles(60, current_a=1.0)
    assert rig.board.output[0] == 1.0
    speed = float(rig.sim.plant.state["velocity_rad_s"][0, 0])
    assert tick["device_velocity_rad_s"][0] == pytest.approx(speed, abs=0.1) != 0
    rig.cycles(1, enabled=0)
    assert not rig.board._on
    assert not rig.board.output.any()


def test_a_sensor_that_prints_text_is_a_device_beside_a_rig(play):
    rig = play("serial-println.toml", "/tmp/rtctl-scale", force={"bias_n": [0.3, -0.2, 0.5]})
    tick = rig.cycles(5, enabled=0)
    told = rig.sim.tick["force_n"][0]
    assert tick["force_n"] == pytest.approx(told, abs=0.1)
    assert told == pytest.approx([0.3, -0.2, 0.5], abs=0.1)
    assert not tick["link_faults"]
    count = int(tick["sample_count"])
    for _ in range(10):
        rig.backend.read(rig.tick)
        rig.tick["tick"] += 1
    assert rig.tick["sample_count"][0] <= count + 6, "silent: stale after 5 ticks"
