"""What is sent in described frames, descriptions that are refused, and a board that lets go."""

import math
import os
import pty
import tty
from contextlib import nullcontext
from dataclasses import replace

import pytest
from described_wire import Wire, options
from hardware import rig
from pydantic import ValidationError

from hw import serial_port
from hw.interface import BackendError, LinkFault
from hw.serial.described_backend import DescribedBackend
from hw.serial.described_options import DescribedOptions
from hw.serial_port import usb_identity

DROPPED = LinkFault.DEVICE


@pytest.mark.parametrize(
    ("value", "wanted"),
    [(0.25, 25_000), (-0.2500099, -25_000), (1e6, 2**23 - 1), (-1e6, -(2**23)), (math.nan, 0)],
)
def test_commands_truncate_toward_zero_saturate_and_never_wrap(value, wanted):
    wire = Wire()
    wire.tick["enabled"], wire.tick["current_command_a"] = 1, value
    frame = wire.sent()
    assert int.from_bytes(frame[5:8], "little", signed=True) == wanted
    assert frame[4] == (0 if math.isnan(value) else 1)
    assert wire.board.take(frame).commands == 1
    assert wire.board.output[0] == pytest.approx(wanted * 1e-5)


def test_a_disabled_tick_sends_zero_and_the_enable_bit_off():
    wire = Wire()
    wire.tick["enabled"], wire.tick["current_command_a"] = 0, 0.25
    assert wire.sent()[4:8] == bytes(4)


def test_the_stop_is_a_disabled_command_unless_bytes_are_given():
    wire = Wire()
    packet = wire.backend._stop_packet()
    wire.tick["enabled"], wire.tick["current_command_a"] = 1, 0.25
    wire.board.take(wire.sent())
    assert wire.board.enabled
    wire.board.take(packet)
    assert not wire.board.enabled
    given = Wire(options(command__stop=[0x21, 0x0D]))
    assert given.backend._stop_packet() == b"!\r" * 3


def test_a_board_without_commands_is_a_sensor():
    table = options()
    del table["command"]
    backend = DescribedBackend(DescribedOptions.model_validate(table).model_dump(mode="json"), rig())
    assert backend.consumes == frozenset()
    assert backend.provides == {"position", "current", "force", "temperature", "estop"}
    backend.stop()


FIELD = {"channel": "position", "type": "i32", "offset": 4, "unit": "counts"}
MEASURED = {"channel": "current", "axis": 1, "type": "i16", "offset": 12, "unit": "mA"}
CURRENT = {"channel": "current_command", "type": "i24", "offset": 5, "unit": "mA"}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"sample__length": 20}, r"field 'estop' ends at byte 18; the checksum begins at byte 18"),
        ({"sample__checksum": "md5"}, "checksum"),
        ({"sample__sync": []}, "sync"),
        ({"sample__sync": [256]}, "sync"),
        ({"sample__endian": "middle"}, "endian"),
        ({"sample__checksum_from": 20}, "checksum_from 20"),
        ({"sample__field": [FIELD, {**FIELD, "offset": 8}]}, "is given twice"),
        (
            {"sample__field": [FIELD, {**FIELD, "axis": 1, "offset": 6}]},
            r"field 'position' of axis 1 overlaps .* at byte 6",
        ),
        ({"sample__field": [{**FIELD, "offset": 1}]}, "overlaps sync at byte 1"),
        ({"sample__field": [{**FIELD, "unit": "A"}]}, "unit 'A' of 'position'"),
        ({"sample__field": [{**FIELD, "scale": 0.0}]}, "scale of 'position' is 0"),
        ({"sample__field": [{**FIELD, "wrap_bits": 33}]}, "wrap_bits"),
        ({"sample__field": [{**FIELD, "mask": 1}]}, "mask 0x1 of 'position'"),
        ({"sample__field": [FIELD, {"channel": "estop", "type": "u8", "offset": 10}]}, "mask 0x0 of 'estop'"),
        (
            {"sample__field": [FIELD, {"channel": "sequence", "type": "f32", "offset": 10}]},
            "whole numbers only",
        ),
        ({"sample__tail": [1, 2, 3, 4]}, "field 'estop' ends at byte 18; the checksum begins at byte 16"),
        ({"sample__constant": [{"offset": 4, "bytes": [1]}]}, "overlaps constant at 4"),
        (
            {"command__field": [{"channel": "enable", "type": "u8", "offset": 4, "mask": 1}]},
            "either torque or current_command",
        ),
        ({"command__stop": [1, -1]}, "stop"),
        ({"command__field": [{**CURRENT, "zero": 100.5}]}, "zero 100.5.*a command of 0 cannot be sent"),
        ({"sample__colour": 1}, "colour"),
    ],
)
def test_bad_descriptions_are_refused_by_key(changes, said):
    with pytest.raises(ValidationError, match=said):
        DescribedOptions.model_validate(options(**changes))


@pytest.mark.parametrize(
    ("changes", "n_axes", "said"),
    [
        ({}, 2, r"position is given for axes \[0\]; each of axes 0 to 1 needs it once"),
        (
            {"sample__field": [FIELD, {**FIELD, "axis": 1, "offset": 8}, MEASURED]},
            2,
            r"current is given for axes \[1\]; each of axes 0 to 1",
        ),
        ({"sample__field": [{**FIELD, "axis": 3}]}, 1, "axis 3, the device has axes 0 to 0"),
        ({"baud": 9600}, 1, "baud 9600 is too slow"),
        ({"identity": 3, "sample__field": [FIELD]}, 1, "no field of that channel"),
    ],
)
def test_descriptions_that_do_not_fit_the_rig_are_refused(changes, n_axes, said):
    valid = DescribedOptions.model_validate(options(**changes)).model_dump(mode="json")
    with pytest.raises(BackendError, match=said):
        DescribedBackend(valid, rig(n_axes))


@pytest.mark.parametrize(("rate_hz", "refused"), [(9100.0, False), (9300.0, True)])
def test_a_board_that_sends_a_backlog_in_every_cycle_is_refused(rate_hz, refused):
    valid = DescribedOptions.model_validate(options(baud=12_000_000, rate_hz=rate_hz)).model_dump(mode="json")
    slow = replace(rig(), period_s=1e-2)
    told = (
        pytest.raises(BackendError, match="from 2048 on nothing counts as new") if refused else nullcontext()
    )
    with told:
        DescribedBackend(valid, slow)


def test_the_usb_identity_is_that_of_the_device_behind_the_port(tmp_path):
    device = tmp_path / "usb1" / "1-1"
    (device / "1-1:1.0" / "ttyUSB9").mkdir(parents=True)
    for name, text in {"idVendor": "0403\n", "idProduct": "6014\n", "serial": "FT123\n"}.items():
        (device / name).write_text(text)
    port = tmp_path / "class" / "ttyUSB9"
    port.mkdir(parents=True)
    (port / "device").symlink_to(device / "1-1:1.0" / "ttyUSB9")
    assert usb_identity("/dev/ttyUSB9", tmp_path / "class") == "0403:6014:FT123"
    assert usb_identity("/dev/ttyS0", tmp_path / "class") is None


def test_a_board_that_tells_that_it_drives_stays_down_once_it_has_let_go():
    table = options()
    fault = next(field for field in table["sample"]["field"] if field["channel"] == "fault")
    free = next(k for k in range(8) if not any(f.get("mask", 0) >> k & 1 for f in table["sample"]["field"]))
    table["sample"]["field"].append({**fault, "channel": "enabled", "mask": 1 << free})
    wire = Wire(table)

    def exchange(enabled):
        wire.tick["enabled"], wire.tick["current_command_a"] = enabled, 0.1 * enabled
        wire.board.take(wire.sent())
        wire.feed(wire.frame())
        return wire.faults

    assert [exchange(on) for on in (0, 1, 1)] == [0, 0, 0]
    wire.board.hold()
    wire.feed(wire.frame())
    assert wire.faults == DROPPED
    assert [exchange(1) for _ in range(50)] == [DROPPED] * 50
    assert wire.board.output[0] == 0.0
    assert [exchange(on) for on in (0, 1, 1)] == [0, 0, 0]
    assert wire.board.output[0] == pytest.approx(0.1)


def test_a_usb_device_whose_words_cannot_be_read_ends_nothing(tmp_path):
    device = tmp_path / "usb1" / "1-1"
    (device / "ttyUSB9").mkdir(parents=True)
    (device / "idVendor").write_text("0403\n")
    (device / "serial").write_bytes(b"\xff7\n")
    (tmp_path / "class" / "ttyUSB9").mkdir(parents=True)
    (tmp_path / "class" / "ttyUSB9" / "device").symlink_to(device / "ttyUSB9")
    assert usb_identity("/dev/ttyUSB9", tmp_path / "class") == "0403:\ufffd7"


def test_a_stop_is_sent_by_a_port_that_takes_no_settings(monkeypatch):
    def refuse(*_):
        raise OSError(25, "inappropriate")

    monkeypatch.setattr(serial_port, "_set_any_rate", refuse)
    master, slave = pty.openpty()
    tty.setraw(master)
    tty.setraw(slave)
    assert serial_port.send_once(os.ttyname(slave), 123_456, b"stop")
    assert os.read(master, 16) == b"stop"
    os.close(master)
    os.close(slave)
