"""The compiled halves of a cycle do on a serial line what `read` and `write` do, and leave to them what is
rare.
"""

import os

import numpy as np
import pytest
from patience import until
from serial_line import SerialLine, waiting

from hw.entry_points import call_for_int, entry_point
from hw.interface import LinkLost
from hw.jit import compiled
from hw.serial import compiled_core
from hw.serial_port import Port
from hw.simulators.serial_firmware import Board
from hw.system_calls import FAILED, read_some, write_all
from rtctl.tick import new_ticks

pytestmark = pytest.mark.compiled


@compiled
def _go(at, arguments):
    return call_for_int(at, arguments)


class Line(SerialLine):
    """A line with a board, and both halves of a cycle."""

    def __init__(self):
        super().__init__(160_000)
        self.board, self.parts = Board(1, "TEST", 1000), self.backend.compiled_cycle(self.tick)

    def sample(self, k):
        ticks, counts = new_ticks(1, 1), np.array([37 * k])
        ticks["current_a"], ticks["force_n"] = 0.25, (1.0, -2.0, 0.5)
        return self.board.state_packet(ticks, counts, 1000 * k)

    def read(self, compiled_half):
        if not compiled_half:
            self.backend.read(self.tick)
            return 0
        parts = self.parts
        return _go(entry_point(parts.read, *parts.read_arguments), parts.read_arguments)

    def write(self, compiled_half):
        if not compiled_half:
            self.backend.write(self.tick)
            return 0
        parts = self.parts
        return _go(entry_point(parts.write, *parts.write_arguments), parts.write_arguments)

    def sent(self):
        try:
            return os.read(self.far, 65536)
        except BlockingIOError:
            return b""


@pytest.fixture
def line():
    made = Line()
    yield made
    made.close()


def test_both_ways_read_and_send_the_same_in_turn(line):
    ticks, packets = [], []
    for compiled_half in (False, True):
        other = Line()
        for k in range(1, 40):
            noise = b"\x01\x02noise\x00" if k % 7 == 0 else b""
            other.arrive(other.sample(k) * (1 + (k % 5 == 0)) + noise)  # now and then one twice
            other.tick["tick"], other.tick["enabled"], other.tick["current_command_a"] = k, k > 10, 0.01 * k
            assert other.read(compiled_half) == 0
            assert other.write(compiled_half) == 0
            ticks.append(other.tick.copy())
            until(lambda far=other.far: waiting(far), "a command")
            packets.append(other.sent())
        other.close()
    n = len(ticks) // 2
    assert all(packets[:n])
    assert packets[:n] == packets[n:]
    assert [t.tobytes() for t in ticks[:n]] == [t.tobytes() for t in ticks[n:]]


@pytest.mark.parametrize("half", [False, True])
def test_a_backlog_is_taken_in_and_neither_it_nor_its_rest_is_shown_as_fresh(line, half):
    os.write(line.far, line.sample(1))
    assert line.read(half) == 0
    before = int(line.tick["sample_count"][0])
    stale = b"".join(line.sample(k) for k in range(2, 80))[: compiled_core.BACKLOG + 200]
    os.write(line.far, stale)
    counts, told = [], []
    # the second: what the kernel had no room for, and hands on when there is some
    for more in (b"", line.sample(100), line.sample(101)):
        if more:
            os.write(line.far, more)
        assert line.read(half) == 0
        counts.append(int(line.tick["sample_count"][0]) - before)
        told.append(line.backend.words()[0].text)
    assert counts == [0, 0, 1]
    assert ["the board sends too much" in text for text in told] == [True, False, False]


def test_a_line_that_is_hung_up_is_left_to_python_which_says_so(line):
    os.close(line.far)
    try:
        assert line.read(True) == 1
        with pytest.raises(LinkLost, match="unplugged or reset"):
            line.backend.read(line.tick)
    finally:
        line.far = os.open("/dev/null", os.O_RDWR)


def test_a_closed_backend_is_left_to_python(line):
    line.backend.close()
    assert line.read(True) == 1
    assert line.write(True) == 1
    with pytest.raises(LinkLost, match="not open"):
        line.backend.read(line.tick)


def test_a_full_line_is_counted_once_for_each_command_and_ends_in_a_lost_link(line, monkeypatch):
    monkeypatch.setattr(Port, "discard_output", lambda _self: None)  # nobody takes what waits there
    while line.write(True) == 0:
        pass
    for tries in range(1, compiled_core.RESTART_PACKETS):
        assert line.backend._wire["full"][0] == 1
        line.write(False)
        assert line.backend.unsent == tries
        assert line.write(True) == 1
    with pytest.raises(LinkLost, match="takes no more commands"):
        line.write(False)


def test_a_command_that_found_no_room_is_not_sent_late_when_there_is_room_again(line):
    while line.write(True) == 0:
        pass
    while line.sent():
        pass
    line.write(False)
    assert line.backend.unsent == 1
    assert line.sent() == b""


def test_a_command_that_fits_again_starts_the_count_anew(line):
    line.backend._wire["unsent_in_row"] = 5
    assert line.write(True) == 0
    assert line.backend._wire["unsent_in_row"][0] == 0


def test_system_calls_tell_nothing_there_from_broken():
    near, far = os.pipe2(os.O_NONBLOCK)
    into, out = np.zeros(16, np.uint8), np.arange(16, dtype=np.uint8)
    assert read_some(near, into) == 0
    assert write_all(far, out, 5) == 1
    assert read_some(near, into) == 5
    assert into[:5].tolist() == [0, 1, 2, 3, 4]
    while write_all(far, np.zeros(4096, np.uint8), 4096) == 1:
        pass
    assert write_all(far, out, 5) == 0
    assert read_some(-1, into) == FAILED
    assert write_all(-1, out, 5) == FAILED
    os.close(far)
    while read_some(near, np.zeros(65536, np.uint8)) > 0:
        pass
    assert read_some(near, into) == FAILED, "hung up"
    os.close(near)
