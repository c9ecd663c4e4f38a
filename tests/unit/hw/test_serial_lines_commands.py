"""Lines of text that are sent, what is refused of their description, and a board that lets go."""

import math
import os

import numpy as np
import pytest
from hardware import rig
from lines_wire import DRIVE, POSITION, TORQUE, Wire, options

from hw import registry
from hw.interface import BackendError, LinkFault, SpeakingBackend
from hw.serial.lines_backend import LinesBackend
from hw.serial.lines_codec import nmea
from hw.serial.lines_options import LinesOptions
from hw.simulators.serial_lines_board import LineBoard


@pytest.mark.parametrize(
    ("torque", "text"),
    [
        (0.5, b"T0.5000\n"),
        (-0.12349, b"T-0.1234\n"),
        (1e-6, b"T0.0000\n"),
        (-1e-6, b"T0.0000\n"),
        (1e30, b"T1000000.0000\n"),
        (math.nan, b"T0.0000\n"),
        (math.inf, b"T0.0000\n"),
    ],
)
def test_commands_are_cut_off_toward_zero_and_limited_and_never_anything_but_a_number(torque, text):
    assert Wire().sent(torque=torque) == text.replace(b"T-0.0000", b"T0.0000")


def test_a_disabled_rig_sends_zero_and_so_does_the_stop():
    wire = Wire()
    assert wire.sent(enabled=0, torque=0.5) == b"T0.0000\n"
    assert wire.backend._stop_packet() == b"\n" + 3 * b"T0.0000\n"


def test_a_number_that_is_none_on_one_axis_lets_all_go():
    fields = [TORQUE, {**TORQUE, "axis": 1, "prefix": " "}, {"channel": "enable", "prefix": " E"}]
    sample = {"field": [POSITION, {**POSITION, "axis": 1, "column": 1}]}
    wire = Wire(options({"time_to_live_ms": 10, "field": fields}, sample), n_axes=2)
    assert wire.sent(torque=[[0.5, 0.25]]) == b"T0.5000 0.2500 E1\n"
    assert wire.sent(torque=[[0.5, math.nan]]) == b"T0.0000 0.0000 E0\n"


def test_the_time_to_live_and_a_checksum_are_sent_where_the_board_reads_them():
    fields = [TORQUE, {"channel": "time_to_live", "prefix": " L"}]
    wire = Wire(options({"time_to_live_ms": 8.0, "checksum": "nmea", "field": fields}))
    assert wire.sent(torque=0.5) == b"T0.5000 L8*%02X\n" % nmea(b"T0.5000 L8")


def test_a_drive_is_switched_on_once_and_off_while_not_armed():
    wire = Wire(options({**DRIVE, "enter": "ME1", "idle": "ME0"}, poll="?", stop=["bye"]))
    sent = [wire.sent(enabled=enabled, torque=0.5) for enabled in (0, 1, 1, 0)]
    assert sent == [b"ME0\n?\n", b"ME1\n?\n", b"T0.5000\n?\n", b"ME0\n?\n"]
    assert wire.backend._stop_packet() == b"\n" + 3 * b"T0.0000\nME0\n" + b"bye\n"


def test_a_line_cut_by_a_full_port_cannot_join_the_next():
    wire = Wire()
    wire.backend._wire["unsent_in_row"] = 1
    assert wire.sent(torque=0.5) == b"\nT0.5000\n"


@pytest.mark.parametrize("refused", [1, 2])
def test_what_switches_a_drive_on_is_sent_until_the_line_has_room_for_it(refused):
    wire = Wire(options({**DRIVE, "enter": "ME1", "idle": "ME0"}))
    assert wire.sent(enabled=0) == b"ME0\n"
    assert wire.sent(torque=0.5) == b"ME1\n"
    for k in range(refused):
        wire.backend._wire["unsent_in_row"] = k + 1
        assert wire.sent(torque=0.5) == b"\nME1\n", "it has not arrived: no torque before it"
    wire.backend._wire["unsent_in_row"] = 0
    assert wire.sent(torque=0.5) == b"T0.5000\n"
    wire.backend._wire["unsent_in_row"] = 1
    assert wire.sent(torque=0.5) == b"\nT0.5000\n", "a command that did not arrive is no new beginning"
    assert wire.sent(enabled=0) == b"\nME0\n"


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (options({"field": [TORQUE]}), "time_to_live_ms"),
        (options({"time_to_live_ms": 50.0, "field": [TORQUE]}), "at most 10: 10 periods"),
        (options({"time_to_live_ms": 1.5, "field": [TORQUE]}), "at least 2, 2 periods"),
        (options({**DRIVE, "enter": "ME1"}), "enter needs idle"),
        (options({**DRIVE, "field": [{"channel": "enable"}]}), "either torque or current_command"),
        (options({**DRIVE, "field": [{**TORQUE, "prefix": "T\n"}]}), "prefix"),
        (options({**DRIVE, "field": [TORQUE] * 16}), "more than 250 characters"),
        (options({**DRIVE, "field": [{**TORQUE, "zero": 0.06, "decimals": 1}]}), "more than 1 decimals"),
        (
            options(sample={"field": [POSITION, {"channel": "sequence", "column": 1, "wrap_at": 0.5}]}),
            "wrap_at 0.5 of 'sequence'",
        ),
        (options(sample={"field": [{**POSITION, "column": 2}]}), "the line has columns 0 to 1"),
        (options(sample={"field": [POSITION, {**POSITION, "column": 1}]}), "given twice"),
        (options(sample={"field": [{"channel": "sequence", "column": 0}]}), "nothing is measured"),
        (options(sample={"field": [{**POSITION, "unit": "A"}]}), "unit 'A'"),
        (options(sample={"field": [{"channel": "estop", "column": 0}]}), "need bits"),
    ],
)
def test_descriptions_that_make_no_sense_are_refused_by_key(table, said):
    with pytest.raises(ValueError, match=said):
        LinesOptions.model_validate(table, context={"rate_hz": 1000.0})


@pytest.mark.parametrize(
    ("table", "n_axes", "said"),
    [
        (options(), 2, "each of axes 0 to 1 needs it once"),
        (options({**DRIVE, "field": [{**TORQUE, "axis": 1}]}), 1, "torque is given for axes"),
        (
            options(
                sample={
                    "columns": 3,
                    "field": [
                        POSITION,
                        {**POSITION, "axis": 1, "column": 1},
                        {"channel": "current", "column": 2, "unit": "A"},
                    ],
                }
            ),
            2,
            r"current is given for axes \[0\]",
        ),
        (options(baud=9600), 1, "baud 9600 is too slow"),
    ],
)
def test_descriptions_that_do_not_fit_the_rig_are_refused(table, n_axes, said):
    valid = LinesOptions.model_validate(table).model_dump(mode="json")
    with pytest.raises(BackendError, match=said):
        registry.create("serial-lines", valid, rig(n_axes))
    assert registry.timing("serial-lines", valid, rig(1))[0].delay_s > 2e-3


def test_a_board_that_prints_otherwise_is_refused_with_what_came():
    master, slave = os.openpty()
    os.write(master, b"hello\nworld\n")
    valid = LinesOptions.model_validate({**options(), "port": os.ttyname(slave), "open_timeout_s": 0.3})
    backend = LinesBackend(valid.model_dump(mode="json"), rig())
    with pytest.raises(BackendError, match=r"no line of numbers within 0\.3 s: (not a byte|\d+ bytes) came"):
        backend.open()
    backend.close()
    os.close(master)
    os.close(slave)


@pytest.mark.parametrize("words", [{}, {"enter": "ME1", "idle": "ME0"}])
def test_a_board_that_tells_that_it_drives_stays_down_once_it_has_let_go(words):
    told = {"channel": "enabled", "column": 1, "mask": 1}
    wire = Wire(options({**DRIVE, **words}, {"field": [POSITION, told]}))
    board = LineBoard(wire.valid, rig(), "1")

    def exchange(enabled):
        board.take(wire.sent(enabled=enabled, torque=0.1 * enabled))
        wire.feed(board.state_packet(wire.tick, np.zeros(1), 0))
        return wire.faults

    assert [exchange(on) for on in (0, 1, 1, 1, 0, 0)] == [0] * 6
    assert [exchange(1) for _ in range(3)] == [0] * 3
    assert board.output[0] == pytest.approx(0.1)
    board.hold()
    wire.feed(board.state_packet(wire.tick, np.zeros(1), 0))
    assert wire.faults == LinkFault.DEVICE
    assert [exchange(1) for _ in range(5)] == [LinkFault.DEVICE] * 5
    assert board.output[0] == 0.0
    assert [exchange(on) for on in (0, 0, 1, 1)] == [0] * 4
    assert board.output[0] == pytest.approx(0.1)


def test_a_board_says_in_words_what_its_device_fault_is():
    wire = Wire()
    assert isinstance(wire.backend, SpeakingBackend)
    wire.feed(b"1,0\n")
    assert wire.backend.words()[0].text == ""
    wire.feed(b"nan,0\n")
    assert "a number in its line is none" in wire.backend.words()[0].text


def test_the_simulated_board_lets_go_after_its_time_to_live():
    wire = Wire()
    board = LineBoard(wire.valid, rig(), "1")
    assert board.take(wire.sent(torque=0.5)).commands == 1
    assert board.output[0] == 0.5
    board.begin_cycle(9)
    assert board.output[0] == 0.5
    board.begin_cycle()
    assert board.output[0] == 0.0
