"""Lines of text: what is taken as numbers and what is not, freshness, commands that can always say zero, and
the bounds of it all.
"""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lines_wire import DRIVE, POSITION, Wire, options

from hw.interface import LinkFault
from hw.serial import link
from hw.serial.lines_codec import LINE_MAX, LINES_MAX, Lines, nmea


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


@pytest.mark.parametrize(("wrap_at", "good"), [(65536.0, 20), (None, 6)])
def test_a_counter_of_sixteen_bits_that_starts_over_is_no_board_that_was_powered_anew(wrap_at, good):
    counter = {"channel": "sequence", "column": 1, "wrap_at": wrap_at}
    wire = Wire(options(sample={"field": [POSITION, counter]}))
    for k in range(65_530, 65_550):
        wire.feed(b"0.5,%d\n" % (k % 65_536))
    assert wire.count == good
    wire.feed(b"0.5,3\n")
    assert (wire.count, wire.faults) == (good, LinkFault.SEQUENCE), "an older one is still told"


def test_an_axis_without_a_sensor_of_its_own_is_not_told_to_stand_or_to_be_cold():
    fields = [
        POSITION,
        {**POSITION, "axis": 1, "column": 1},
        {"channel": "temperature", "axis": 1, "column": 2, "unit": "degC"},
        {"channel": "velocity", "column": 2, "unit": "rad/s"},
    ]
    wire = Wire(options(sample={"columns": 3, "field": fields}), 2)
    wire.feed(b"1,2,40\n")
    assert math.isnan(wire.tick["temperature_c"][0, 0])
    assert math.isnan(wire.tick["device_velocity_rad_s"][0, 1])
    assert (wire.tick["temperature_c"][0, 1], wire.tick["device_velocity_rad_s"][0, 0]) == (40.0, 40.0)
