"""Every shipped rig file of a described serial device, run against its simulated device."""

import contextlib
import math

import numpy as np
import pytest
from serial_played import Played


@pytest.fixture
def play(tmp_path):
    with contextlib.ExitStack() as stack:

        def _play(name, port):
            made = stack.enter_context(contextlib.closing(Played(tmp_path, name, port)))
            made.open()
            return made

        yield _play


def angle(rig):
    return float(rig.sim.plant.state["position_rad"][0, 0])


@pytest.mark.parametrize(
    ("name", "port"), [("serial-vesc.toml", "/tmp/rtctl-vesc"), ("serial-described.toml", "/tmp/rtctl-board")]
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
    assert tick["current_a"][0] == pytest.approx(1.5, abs=0.2)
    assert not tick["link_faults"]
    assert tick["sample_count"] > 140
    rig.backend.stop()
    rig.sim.listen()
    assert not rig.board.output.any()
    rig.cycles(2, current_a=1.5)
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
