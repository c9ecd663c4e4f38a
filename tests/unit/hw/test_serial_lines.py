"""Lines of text: what is taken as numbers and what is not, freshness, commands that can always say zero, and the bounds of it all."""

import math
import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_serial_described import rig

from hw import registry
from hw.interface import BackendError, LinkFault, SpeakingBackend
from hw.serial import link
from hw.serial.lines_backend import LinesBackend
from hw.serial.lines_codec import LINE_MAX, LINES_MAX, Lines, nmea
from hw.serial.lines_options import LinesOptions
from hw.simulators.serial_lines_board import LineBoard
from rtctl.control.jit import records
from rtctl.tick import new_ticks

POSITION = {"channel": "position", "column": 0, "unit": "rad"}
TORQUE = {"channel": "torque", "prefix": "T", "unit": "N m"}
DRIVE = {"time_to_live_ms": 10.0, "field": [TORQUE]}


def options(command=None, sample=(), **more):
    table = {"columns": 2, "field": [POSITION], **dict(sample)}
    return {"port": "/dev/x", "sample": table, **({"command": command} if command else {}), **more}


class Wire:
    """A backend that gets its bytes from the test."""

    def __init__(self, table=None, n_axes=1):
        valid = LinesOptions.model_validate(table or options(DRIVE), context={"rate_hz": 1000.0})
        self.valid = valid.model_dump(mode="json")
        self.backend = LinesBackend(self.valid, rig(n_axes))
        self.tick = records(new_ticks(1, n_axes))
        self.backend.warm_up(self.tick)
        self.feed(b"\n")

    def feed(self, data, end=link.DRAINED):
        self.backend.chunk[: len(data)] = np.frombuffer(data, np.uint8)
        self.backend.meta[:] = len(data), end
        self.backend._receive()
        return self.tick

    def sent(self, *, enabled=1, torque=0.0, current=0.0):
        self.tick["enabled"], self.tick["torque_applied_nm"] = enabled, torque
        self.tick["current_command_a"] = current
        return self.backend.packet[: self.backend._send()].tobytes()

    @property
    def position(self):
        return float(self.tick["position_rad"][0, 0])

    @property
    def count(self):
        return int(self.tick["sample_count"][0])

    @property
    def faults(self):
        return LinkFault(int(self.tick["link_faults"][0]))


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_a_line_of_numbers_becomes_a_sample(end):
    wire = Wire()
    wire.feed(b"-1.25, 7" + end)
    assert (wire.count, wire.position, wire.faults) == (1, -1.25, 0)


def test_what_comes_before_the_first_end_of_line_may_be_half_a_line_and_is_none():
    wire = Wire()
    wire.backend._forget()
    wire.feed(b"2.5,0\n")
    assert (wire.count, wire.faults) == (0, 0), "it may have been 12.5"
    wire.feed(b"3.5,0\n")
    assert (wire.count, wire.position) == (1, 3.5)


def test_a_line_that_comes_in_pieces_counts_when_its_end_comes():
    wire = Wire()
    for piece in (b"1", b".2", b"5,", b"0"):
        wire.feed(piece)
        assert wire.count == 0
    wire.feed(b"\n2.0")
    assert (wire.count, wire.position) == (1, 1.25)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (b"1.5", LinkFault.CHECKSUM),  # too few, too many columns
        (b"1.5,2,3", LinkFault.CHECKSUM),
        (b",2", LinkFault.CHECKSUM),
        (b"1..5,2", LinkFault.CHECKSUM),
        (b"1,5 3,2", LinkFault.CHECKSUM),
        (b"0x12,2", LinkFault.CHECKSUM),
        (b"1_000,2", LinkFault.CHECKSUM),
        (b"--1,2", LinkFault.CHECKSUM),
        (b"1e,2", LinkFault.CHECKSUM),
        ("\u0661,2".encode(), LinkFault.CHECKSUM),
        (b"\xff\x00,2", LinkFault.CHECKSUM),
        (b"1" * 100000, LinkFault.CHECKSUM),
        (b"nan,2", LinkFault.DEVICE),
        (b"-NaN,2", LinkFault.DEVICE),
        (b"inf,2", LinkFault.DEVICE),
        (b"-Infinity,2", LinkFault.DEVICE),
        (b"ovf,2", LinkFault.DEVICE),
        (b"1e999,2", LinkFault.DEVICE),
    ],
)
def test_what_is_no_plain_number_is_never_a_sample(text, fault):
    wire = Wire()
    wire.feed(b"1.5,0\n")
    data = text + b"\n"
    for at in range(0, len(data), 4096):
        wire.feed(data[at : at + 4096])
    assert (wire.count, wire.position, wire.faults) == (1, 1.5, fault)
    wire.feed(b"2.5,0\n")
    assert (wire.count, wire.position, wire.faults) == (2, 2.5, 0), "the next good one counts"


def test_a_lost_character_is_noticed_by_the_decimals_or_the_checksum():
    exact = Wire(options(sample={"field": [{**POSITION, "decimals": 3}]}))
    exact.feed(b"1.25,0\n")
    assert (exact.count, exact.faults) == (0, LinkFault.CHECKSUM)
    exact.feed(b"1.250,0\n")
    assert exact.count == 1
    summed = Wire(options(sample={"checksum": "nmea"}))
    good = b"1.250,0*%02X" % nmea(b"1.250,0")
    for k in range(len(good)):
        summed.feed(good[:k] + good[k + 1 :] + b"\n")
        assert summed.count == 0
    summed.feed(good + b"\n")
    assert summed.count == 1
    summed.feed(b"$" + good + b"\n1.250,0\n1.250,0*\n1.250,0*0G\n")
    assert summed.count == 1, "the dollar stands in the first column"
    assert summed.backend.counts()["damaged"] == len(good) + 4


def test_other_lines_are_passed_over_where_a_prefix_says_which_are_meant():
    wire = Wire(options(sample={"prefix": "P:", "separator": " "}))
    wire.feed(b"MOT: ready\nP: 0.5   3\n# 1.0 2\n")
    assert (wire.count, wire.position, wire.faults) == (1, 0.5, 0)
    assert wire.backend.counts()["foreign"] == 2


def test_the_newest_line_of_a_cycle_counts_and_older_ones_by_their_number_do_not():
    fields = [POSITION, {"channel": "sequence", "column": 1}]
    wire = Wire(options(sample={"field": fields}))
    wire.feed(b"1.0,10\n2.0,11\n")
    assert (wire.count, wire.position) == (1, 2.0)
    for line in (b"3.0,11\n", b"3.0,5\n"):
        wire.feed(line)
        assert (wire.count, wire.position, wire.faults) == (1, 2.0, LinkFault.SEQUENCE)
    wire.feed(b"4.0,4294967295\n")
    assert wire.count == 1, "half the range ahead is behind"
    wire.feed(b"5.0,12\n")
    assert (wire.count, wire.position) == (2, 5.0)


def test_nothing_out_of_a_backlog_is_fresh():
    wire = Wire()
    wire.feed(b"1.0,0\n", link.MORE)
    assert (wire.count, wire.position) == (0, 0.0)
    wire.feed(b"2.0,0\n", link.BACKLOGGED)
    assert wire.count == 0
    wire.feed(b"3.0,0\n")
    assert (wire.count, wire.position) == (1, 3.0)


@pytest.mark.parametrize(
    "flood", [b"\n" * 4096, b"1,2\n" * 1024, b"9" * 4096, b"1,2,3;" * 600, b"nan,nan\r" * 500]
)
def test_the_work_of_a_cycle_and_the_memory_are_bounded_whatever_comes(flood):
    wire, looked_at = Wire(), []
    read = wire.backend._reader.read
    wire.backend._reader.read = lambda line: looked_at.append(line) or read(line)
    for _ in range(50):
        wire.feed(flood)
        assert len(looked_at) <= LINES_MAX + 1
        assert all(len(line) <= LINE_MAX for line in looked_at)
        assert len(wire.backend._lines._pending) <= LINE_MAX + 4096
        looked_at.clear()


@settings(max_examples=100, deadline=None)
@given(st.lists(st.binary(max_size=40), max_size=20))
def test_no_bytes_make_a_number_that_no_whole_line_has(pieces):
    lines, seen = Lines(), []
    for piece in pieces:
        seen += [line for line in lines.cut(piece) if line is not None]
    whole = b"".join(pieces).replace(b"\r", b"\n").split(b"\n")
    assert seen == [line for line in whole[1:-1] if line][: len(seen)]
    assert len(seen) == len([line for line in whole[1:-1] if line])


def test_switches_forces_and_an_angle_that_starts_over():
    fields = [
        {**POSITION, "unit": "deg", "wrap_at": 360.0},
        {"channel": "force", "component": 2, "column": 1, "unit": "mN", "scale": -5.0, "zero": 10.0},
        {"channel": "estop", "column": 2, "mask": 2},
        {"channel": "fault", "column": 2, "mask": 4, "invert": True},
    ]
    wire = Wire(options(sample={"columns": 3, "field": fields}))
    wire.feed(b"350,110,6\n")
    assert wire.tick["force_n"][0] == pytest.approx([0, 0, -0.5])
    assert (wire.tick["estop"][0], wire.faults) == (1, 0)
    wire.feed(b"10,110,0\n")
    assert wire.position == pytest.approx(math.radians(370))
    assert (wire.tick["estop"][0], wire.faults) == (0, LinkFault.DEVICE)
    wire.feed(b"999999,110,4\n")
    assert (wire.count, wire.faults) == (2, LinkFault.DEVICE), "beyond a turn: not of this device"
    wire.feed(b"10,110,2.0\n")
    assert wire.backend.counts()["damaged"] == 1, "a switch is a whole number"


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


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (options({"field": [TORQUE]}), "time_to_live_ms"),
        (options({"time_to_live_ms": 50.0, "field": [TORQUE]}), "at most 10: 10 periods"),
        (options({**DRIVE, "enter": "ME1"}), "enter needs idle"),
        (options({**DRIVE, "field": [{"channel": "enable"}]}), "either torque or current_command"),
        (options({**DRIVE, "field": [{**TORQUE, "prefix": "T\n"}]}), "prefix"),
        (options({**DRIVE, "field": [TORQUE] * 16}), "more than 250 characters"),
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


@settings(max_examples=100, deadline=None)
@given(st.lists(st.text("0123456789.,-+eEnainf*$\r\n \t\x00\xff", max_size=60), max_size=12), st.booleans())
def test_no_text_raises_or_shows_anything_but_a_finite_number(pieces, seal):
    wire = Wire(options(DRIVE, sample={"checksum": "nmea" if seal else "none"}))
    for piece in pieces:
        before = wire.backend.counts()["good"]
        wire.feed(piece.encode("latin-1"))
        assert math.isfinite(wire.position)
        assert (wire.count > 0) == (wire.backend.counts()["good"] > 0)
        if wire.backend.counts()["good"] == before:
            assert wire.sent(enabled=1, torque=0.25) == b"T0.2500\n"
