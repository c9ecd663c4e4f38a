"""What backends declare of their delay, against what their rig files say of it and arithmetic by hand."""

from pathlib import Path

import numpy as np
import pytest

from hw import registry
from hw.interface import Joint, Rig, Timing
from hw.jit import records
from hw.serial import frame
from hw.serial.framing import BODY_MAX, PACKET_MAX, seal
from hw.serial.options import SerialOptions
from rtctl.check import lateness
from rtctl.rig_file import config

CONFIGS = Path(__file__).parents[3] / "configs"


def _rig(n_axes=1, period_s=1e-3):
    ones = np.ones(n_axes)
    return Rig(n_axes, period_s, ones, ones, ones, ones, np.zeros((n_axes, 3)))


@pytest.mark.parametrize("kind", sorted(set(registry.BUILT_IN) - {"rokubi", "optoforce", "rdt"}))
def test_every_device_that_takes_part_in_the_loop_declares_its_delay(kind):
    assert registry.lookup(kind).timing is not None


def test_the_mock_declares_what_it_was_told_to_be():
    options = {
        "axis": [
            {"torque_delay_ticks": 2, "current_loop": {"bandwidth_hz": 300.0, "time_constant_s": 0.0}},
            {
                "current_loop": {"bandwidth_hz": 0.0, "time_constant_s": 1e-3},
                "elastic": {"link_viscous_share": 0.6},
            },
        ],
        "timing": {"sample_every_ticks": 3, "transport_delay_ticks": 0.4},
    }
    first, second = registry.timing("mock", options, _rig(2))
    assert first == Timing(pytest.approx(2.4e-3), pytest.approx(3e-3), 0.0, 300.0)
    assert second.delay_s == pytest.approx(0.4e-3)
    assert second.current_loop_hz == pytest.approx(159.155, abs=1e-3)
    rigid, elastic = registry.joint("mock", options, _rig(2))
    assert rigid == Joint()
    assert elastic == Joint(motor_share=0.4)


@pytest.mark.parametrize(
    ("name", "least", "most", "jitter"),
    [
        ("can-cia402", 1.0, 1.0, 0.0),
        ("can-moteus", 1.0, 1.0, 1.0),
        ("can-odrive", 1.2, 1.6, 1.0),
        ("can-board", 1.1, 1.9, 1.0),
        ("drive-and-force-sensor", 1.2, 1.6, 1.0),
        ("serial", 2.1, 3.0, 1.0),
        ("serial-described", 2.1, 3.0, 1.0),
        ("serial-vesc", 2.1, 3.0, 1.0),
        ("serial-simplefoc", 2.1, 3.0, 1.0),
        ("can-mit", 1.1, 1.9, 1.0),
        ("can-vesc", 1.1, 2.0, 1.0),
        ("mock", 0.0, 0.0, 0.0),
    ],
)
def test_shipped_rigs_are_as_late_as_their_devices_declare(name, least, most, jitter):
    found = lateness.of_axis(config.load(CONFIGS / f"{name}.toml"), 0)
    assert least <= found.between.delay <= most
    assert found.between.jitter <= jitter
    assert found.between.sample_ticks == 1
    assert found.undeclared == ()


@pytest.mark.parametrize("more", [(), ("velocity",), ("moment",), ("velocity", "moment")])
def test_a_board_is_late_by_the_bytes_that_its_packets_have_on_the_wire(more):
    valid = SerialOptions(port="/dev/x", baud=115_200, channels=("current", *more)).model_dump(mode="json")
    state, command = np.zeros(1, frame.state_dtype(2)), np.zeros(1, frame.command_dtype(2))
    state["has_velocity"], state["has_moment"] = "velocity" in more, "moment" in more
    body, packet = np.zeros(BODY_MAX, np.uint8), np.zeros(PACKET_MAX, np.uint8)
    wire = seal(body, frame.encode_state(records(state), body), packet)
    wire += seal(body, frame.encode_command(records(command), body), packet)
    found = registry.timing("serial", valid, _rig(2))
    assert found[0].delay_s == pytest.approx(2e-3 + 10 * wire / 115_200)


@pytest.mark.parametrize("kind", ["serial", "serial-described", "serial-lines"])
def test_a_board_that_sends_more_seldom_than_the_loop_reads_says_so(kind):
    """`rtctl check` proved the coupling of a board of 250 Hz under a loop of 1 kHz with a sample a tick."""
    given = config.load(CONFIGS / f"{kind if kind != 'serial-lines' else 'serial-simplefoc'}.toml").options
    usual, slow, drifts, quick = (
        registry.timing(kind, {**given, "rate_hz": rate_hz}, _rig())[0]
        for rate_hz in (None, 250.0, 999.5, 2e3)
    )
    assert usual == drifts == quick
    assert (usual.sample_period_s, usual.jitter_s) == (1e-3, 1e-3)
    assert (slow.sample_period_s, slow.jitter_s) == (4e-3, 4e-3)
    assert slow.delay_s == pytest.approx(usual.delay_s + 3e-3)  # a command waits for the board's cycle


def test_an_odrive_that_is_asked_is_one_period_late_and_one_that_sends_slowly_is_old():
    loaded = config.load(CONFIGS / "can-odrive.toml")
    asked = registry.timing("odrive", {**loaded.options, "feedback": "request"}, _rig())[0]
    assert asked.delay_s == pytest.approx(1e-3)
    slow = registry.timing("odrive", {**loaded.options, "feedback_ms": 3.0}, _rig())[0]
    assert slow.delay_s > 3e-3
    assert slow.sample_period_s == pytest.approx(3e-3)
