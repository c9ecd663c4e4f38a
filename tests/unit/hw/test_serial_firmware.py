"""The reference firmware: time to live, hold, sequence window, status."""

import numpy as np
import pytest

from hw.jit import records
from hw.serial import frame
from hw.serial.framing import seal
from hw.simulators.serial_firmware import Board, request_packet


def command(sequence, enable=1, value=500_000, ttl=10, n_axes=1):
    record = records(np.zeros(1, frame.command_dtype(n_axes)))
    record["sequence"], record["enable"], record["time_to_live"], record["value"] = (
        sequence,
        enable,
        ttl,
        value,
    )
    body, packet = np.zeros(258, np.uint8), np.zeros(300, np.uint8)
    return packet[: seal(body, frame.encode_command(record, body), packet)].tobytes()


@pytest.fixture
def board():
    made = Board(1, "SIM-0001", 1000)
    made.take(command(1, enable=0))
    return made


def test_at_power_up_nothing_moves_until_a_command_with_enable_0():
    board = Board(1, "SIM-0001", 1000)
    board.take(command(1))
    assert board.held
    assert not board.output.any()
    board.take(command(2, enable=0))
    board.take(command(3))
    assert board.output == [0.5]


@pytest.mark.parametrize("ttl", [1, 10, 50])
def test_torque_ends_with_its_time_to_live(board, ttl):
    board.take(command(2, ttl=ttl))
    for _ in range(ttl - 1):
        board.begin_cycle()
        assert board.output == [0.5]
    board.begin_cycle()
    assert board.output == [0.0]
    assert board.status & frame.Status.TTL_EXPIRED
    assert board.status & frame.Status.HELD


def test_after_expiry_enable_alone_moves_nothing(board):
    board.take(command(2))
    board.begin_cycle(11)
    board.take(command(3))
    assert not board.output.any()
    board.take(command(4, enable=0) + command(5))
    assert board.output == [0.5]


def test_a_stop_holds(board):
    board.take(command(2))
    board.take(request_packet(frame.TYPE_STOP))
    assert not board.output.any()
    board.take(command(3))
    assert not board.output.any()


def test_an_older_command_never_enables(board):
    board.take(command(100, enable=0))
    board.take(command(99))
    board.take(command(100))
    board.take(command(100 + 0x8000))
    assert not board.output.any()
    board.take(command(101))
    assert board.output == [0.5]


def test_a_host_that_starts_over_is_obeyed_after_its_first_disabled_command(board):
    board.take(command(50_000, enable=0))
    board.take(command(0, enable=0) + command(1))
    assert board.output == [0.5]


@pytest.mark.parametrize("name", ["estop", "drive_fault"])
def test_emergency_stop_and_drive_fault_block_the_output(board, name):
    board.take(command(2))
    setattr(board, name, True)
    assert not board.output.any()
    assert not board.status & frame.Status.ENABLED


def test_a_damaged_command_changes_nothing_and_is_reported_once(board):
    board.take(command(2))
    bad = bytearray(command(3, value=900_000))
    bad[9] ^= 1
    assert board.take(bytes(bad)).damaged == 1
    assert board.output == [0.5]
    assert board.status & frame.Status.COMMAND_DAMAGED


def test_a_command_for_another_number_of_axes_is_not_obeyed(board):
    board.take(command(2, n_axes=2))
    assert not board.output.any()


def test_a_time_to_live_of_0_is_not_obeyed(board):
    board.take(command(2, ttl=0))
    assert not board.output.any()
