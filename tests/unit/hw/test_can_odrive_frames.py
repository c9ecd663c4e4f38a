"""Frames of an ODrive by its DBC: which lengths are readings, wherever they stand; what it asks of a bus."""

import math
import struct

import pytest
from remembering_bus import AXIS, OPTIONS, RIG, Bus

from hw.can import odrive, odrive_codec
from hw.can.drive_backend import OdriveBackend
from hw.can.load import Traffic
from hw.can.sample import Sample

LENGTHS = [*range(9), 12, 16, 20, 24, 32, 48, 64]
"""Of CAN, and of CAN FD."""

READINGS = {0x09: "position_rad", 0x14: "current_a", 0x15: "temperature_c"}
"""Get_Encoder_Estimates, Get_Iq and Get_Temperature: two floats each, 8 bytes, says the DBC."""


@pytest.mark.parametrize("command", READINGS)
@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize("offset", [0, 8])
def test_a_reading_is_a_frame_of_eight_bytes_and_no_other(command, length, offset):
    sample = Sample(1)
    axis = odrive.OdriveAxis(AXIS, OPTIONS, RIG, 0, sample)
    frame = struct.pack("<16f", *(float(k) for k in range(1, 17)))[:length]
    axis.handlers()[5 << 5 | command](b"\x7f" * offset + frame + b"\x7f" * (64 - length), offset, length)
    scale = axis._shaft.rad_per_turn if command == 0x09 else 1.0
    untold = math.nan if command == 0x15 else 0.0
    wanted = {0x09: 1.0, 0x14: 2.0, 0x15: 2.0}[command] * scale if length == 8 else untold
    assert getattr(sample, READINGS[command])[0] == pytest.approx(wanted, nan_ok=True)


def heat(axis, celsius):
    axis.handlers()[5 << 5 | 0x15](struct.pack("<ff", 30.0, celsius), 0, 8)


def test_a_temperature_that_comes_no_more_is_none_and_no_motor_that_stays_cool():
    backend = OdriveBackend(OPTIONS, RIG)
    (axis,), celsius = backend.drives, backend.sample.temperature_c
    # before the first one, and in what is shown before the first sample
    assert math.isnan(celsius[0])
    assert math.isnan(backend.taken.of["temperature"][0])
    axis.make_frames(bus := Bus())
    heat(axis, 60.0)
    for _ in range(500):  # five of its periods of 100 ms
        axis.write(bus, 0.0, False)
    heat(axis, math.nan)  # as one that did not come
    assert celsius[0] == 60.0
    axis.write(bus, 0.0, False)
    assert math.isnan(celsius[0])
    heat(axis, 61.0)
    axis.write(bus, 0.0, False)
    assert celsius[0] == 61.0


def test_cycles_without_python_end_when_a_temperature_is_due_to_be_lost():
    (axis,) = OdriveBackend({**OPTIONS, "heartbeat_ms": 1000.0}, RIG).drives
    heat(axis, 60.0)
    axis.pass_by(100)
    assert axis.alike() == 400
    axis.pass_by(400)
    axis.make_frames(bus := Bus())
    axis.write(bus, 0.0, False)
    assert math.isnan(axis._sample.temperature_c[0])
    assert axis.alike() == 5000 - 501  # the heartbeat is next


def test_the_traffic_of_a_drive_that_is_asked_and_of_one_that_sends_by_itself():
    asked = {**OPTIONS, "heartbeat_ms": 20.0, "temperature_ms": 50.0}
    assert odrive_codec.traffic(asked, 500.0) == [
        Traffic("node 5 torque", 4, 500.0),
        Traffic("node 5 encoder estimates", 8, 500.0),
        Traffic("node 5 Iq", 8, 500.0),
        Traffic("node 5 heartbeat", 8, 50.0),
        Traffic("node 5 temperature", 8, 20.0),
        Traffic("node 5 requests", 0, 1000.0, remote=True),  # one for each of both readings
    ]
    alone = {**asked, "feedback": "cyclic", "feedback_ms": 4.0, "temperature_ms": 0.0}
    assert [(frame.length, frame.per_s) for frame in odrive_codec.traffic(alone, 500.0)] == [
        (4, 500.0), (8, 250.0), (8, 250.0), (8, 50.0),
    ]  # fmt: skip
