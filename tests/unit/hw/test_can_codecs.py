"""The protocols' frames: published layouts, saturation, and no exception from any bytes at all."""

import math
import struct

import numpy as np
import pytest

from hw.can import cia402, moteus_codec, odrive, odrive_codec
from hw.can.load import fd_length
from hw.can.sample import Sample, Shaft
from hw.interface import Rig


def rig(n_axes=1):
    return Rig(
        n_axes, 1e-3, np.full(n_axes, 10.0), np.full(n_axes, 0.8), np.full(n_axes, 0.05),
        np.full(n_axes, 4096.0),
        np.eye(3)[:n_axes],
    )  # fmt: skip


AXIS = {"node": 5, "direction": 1, "shaft": "motor", "offset_rad": 0.0, "current_max_a": 20.0}


def test_odrive_identifiers_are_node_then_command():
    assert odrive_codec.can_id(1, 0x0C) == 0x2C
    assert odrive_codec.can_id(0x3F, 0x1F) == 0x7FF


def test_odrive_feedback_turns_into_joint_angle_and_current():
    sample = Sample(1)
    axis = odrive.OdriveAxis(
        {**AXIS, "direction": -1, "offset_rad": 0.25},
        {"feedback": "cyclic", "heartbeat_ms": 10.0},
        rig(),
        0,
        sample,
    )
    handlers = axis.handlers()
    handlers[odrive_codec.can_id(5, odrive_codec.GET_ENCODER)](struct.pack("<ff", 2.5, 1.0), 0, 8)
    assert sample.fresh != sample.needed
    handlers[odrive_codec.can_id(5, odrive_codec.GET_IQ)](struct.pack("<ff", 9.0, 3.0), 0, 8)
    assert sample.fresh == sample.needed
    assert sample.position_rad[0] == pytest.approx(-2.5 * 2 * math.pi / 10 + 0.25)
    assert sample.current_a[0] == -3.0


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_odrive_numbers_that_are_not_finite_have_not_arrived(value):
    sample = Sample(1)
    axis = odrive.OdriveAxis(AXIS, {"feedback": "cyclic", "heartbeat_ms": 10.0}, rig(), 0, sample)
    for command in (odrive_codec.GET_ENCODER, odrive_codec.GET_IQ):
        axis.handlers()[odrive_codec.can_id(5, command)](struct.pack("<ff", value, value), 0, 8)
    assert sample.fresh == 0
    assert sample.counts["not_finite"] == 2
    assert sample.position_rad[0] == sample.current_a[0] == 0.0


def test_odrive_errors_have_their_names():
    assert odrive_codec.error_names(0x1000000 | 0x20) == "DRV_FAULT, WATCHDOG_TIMER_EXPIRED"


def test_moteus_command_is_the_documented_bytes():
    frame = bytearray(moteus_codec.command_frame())
    assert len(frame) == 48
    assert frame[:6].hex() == "01000a0c0820"
    moteus_codec.encode_command(frame, 0, 0.5, 2.0, 0.01)
    position, velocity, torque, kp, kd, most, stop, ttl = struct.unpack_from("<8f", frame, 6)
    assert math.isnan(position)
    assert math.isnan(stop)
    assert (velocity, torque, kp, kd, most) == (0.0, 0.5, 0.0, 0.0, 2.0)
    assert ttl == pytest.approx(0.01)
    assert moteus_codec.stop_frame()[:3].hex() == "010000"
    assert len(moteus_codec.stop_frame()) == fd_length(3 + len(moteus_codec.QUERY))
    assert moteus_codec.command_id(1, 0) & 0x1FFFFFFF == 0x8001
    assert moteus_codec.reply_ids(1, 0)[0] == 0x100


def _reply(mode=10, position=0.25, velocity=0.75, current=1.5, temperature=40.0, fault=0):
    return (
        bytes([0x21, 0x00, mode]) + b"\x2f\x01" + struct.pack("<fff", position, velocity, 0.1)
        + b"\x2d\x04" + struct.pack("<f", current) + b"\x2d\x0e" + struct.pack("<f", temperature)
        + bytes([0x21, 0x0F, fault])
    )  # fmt: skip


def test_moteus_reply_is_read_in_any_order_of_subframes():
    usual = moteus_codec.decode_reply(_reply(), 0, 32)
    assert usual == (10, 0.25, 0.75, 1.5, 40.0, 0)
    shuffled = (
        b"\x24\x01\x0f\x00\x00" + b"\x2c\x04\x01" + struct.pack("<4f", 0.25, 0.75, 0.1, 1.5)
        + b"\x2d\x0e" + struct.pack("<f", 40.0) + b"\x21\x00\x0a" + b"\x50\x50"
    )  # fmt: skip
    assert moteus_codec.decode_reply(shuffled, 0, len(shuffled)) == usual


@pytest.mark.parametrize("cut", range(32))
def test_a_moteus_reply_cut_short_is_none(cut):
    assert moteus_codec.decode_reply(_reply()[:cut], 0, cut) is None


def test_every_statusword_has_a_state_and_a_safe_controlword():
    for statusword in range(0x10000):
        state = cia402.drive_state(statusword)
        control = cia402.controlword(state, False, 1)
        assert control & 0x0F != cia402.ENABLE, "never enabled unasked"
        assert state == cia402._STATES[statusword & 0x7F]


def test_cia402_walks_up_to_enabled_and_down_again():
    assert cia402.controlword(cia402.SWITCH_ON_DISABLED, True, 1) == 0x06
    assert cia402.controlword(cia402.READY, True, 1) == 0x07
    assert cia402.controlword(cia402.SWITCHED_ON, True, 1) == 0x0F
    assert cia402.controlword(cia402.ENABLED, True, 1) == 0x0F
    assert cia402.controlword(cia402.ENABLED, False, 1) == 0x06
    assert cia402.controlword(cia402.FAULT, True, 100) == 0x00, "no fault is reset into motion"
    assert cia402.controlword(cia402.FAULT, False, 100) == 0x80


@pytest.mark.parametrize(
    ("value", "wanted"),
    [(0.5, 500), (-0.5, -500), (1e9, 32767), (-1e9, -32768), (math.nan, 0), (math.inf, 32767), (40.0, 32767)],
)
def test_per_mille_saturates(value, wanted):
    assert cia402.per_mille(value, 1.0) == wanted


def test_the_shaft_turns_signs_and_limits_currents():
    shaft = Shaft({**AXIS, "direction": -1}, rig(), 0)
    assert shaft.torque_per_ampere == pytest.approx(-0.05)
    assert Shaft({**AXIS, "shaft": "link"}, rig(), 0).torque_per_ampere == pytest.approx(0.5)
    assert [shaft.limited(x) for x in (5.0, 1e308, -1e308, math.nan, math.inf, -math.inf)] == [
        5.0,
        20.0,
        -20.0,
        0,
        0,
        0,
    ]


_WHOLE = bytes.fromhex("21000a2f010000803e00000000cdcccc3d2d040000c03f2d0e00002042210f00")


@pytest.mark.parametrize(
    ("behind", "position"),
    [
        (b"", 0.25),
        (b"\x50" * 5, 0.25),
        (
            b"\x2d\x01\x00\x00\x00\x3f",
            0.5,
        ),  # said again, otherwise: the last one counts, as for moteus' own library
        (b"\x20\x00", 0.25),  # registers: none
        (b"\x2d\x01\x00\x00", None),  # cut off
        (b"\x31\x01\x04", None),
        (b"\x50\x50\x07", None),
    ],
)
def test_behind_a_moteus_reply_stands_padding_or_more_of_the_reply_or_it_is_damaged(behind, position):
    found = moteus_codec.decode_reply(_WHOLE + behind, 0, len(_WHOLE) + len(behind))
    assert (found and found[1]) == position
