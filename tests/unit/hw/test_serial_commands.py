"""What the host's end of a link sends, what it makes of a board that lets go, and the options it refuses."""

import math

import pytest
from serial_wire import Wire

from hw.interface import BackendError, LinkFault
from hw.serial.options import SerialOptions
from hw.simulators.serial_firmware import Board

DROPPED = LinkFault.DEVICE


def command(wire):
    board = Board(wire.backend._rig.n_axes, "other", 1000)
    taken = board.take(b"\0" + wire.sent())
    assert taken.commands == 1 or not board.held
    return board


def test_commands_are_in_fixed_point_with_the_motors_sign():
    wire = Wire(axis=[{"motor_sign": -1}])
    wire.tick["enabled"], wire.tick["current_command_a"] = 1, 1.2345678
    board = command(wire)
    assert board.command["enable"][0] == 1
    assert board.command["value"][0, 0] == -1_234_567
    assert board.command["torque_mode"][0] == 0
    assert board.command["time_to_live"][0] == 10


def test_torque_commands_take_the_torque():
    wire = Wire(command="torque", time_to_live_cycles=3)
    assert wire.backend.consumes == {"torque"}
    wire.tick["enabled"], wire.tick["torque_applied_nm"], wire.tick["current_command_a"] = 1, -0.25, 9.0
    board = command(wire)
    assert board.command["value"][0, 0] == -250_000
    assert board.command["torque_mode"][0] == 1
    assert board.command["time_to_live"][0] == 3


@pytest.mark.parametrize(
    ("value", "wanted"), [(1e9, 2**31 - 1), (-1e9, -(2**31) + 1), (2147.4836469, 2**31 - 2)]
)
def test_a_command_saturates_and_never_wraps(value, wanted):
    wire = Wire()
    wire.tick["enabled"], wire.tick["current_command_a"] = 1, value
    assert command(wire).command["value"][0, 0] == pytest.approx(wanted, abs=1)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_value_that_is_not_finite_disables_every_axis(bad):
    wire = Wire(n_axes=2)
    wire.tick["enabled"], wire.tick["current_command_a"] = 1, [[0.5, bad]]
    board = command(wire)
    assert board.command["enable"][0] == 0
    assert (board.command["value"] == 0).all()


def test_a_disabled_tick_sends_zeros():
    wire = Wire()
    wire.tick["enabled"], wire.tick["current_command_a"] = 0, 1.0
    board = command(wire)
    assert board.command["enable"][0] == 0
    assert (board.command["value"] == 0).all()


@pytest.mark.parametrize(
    ("name", "channels", "usable"),
    [
        ("drive_fault", [], False),
        ("force_missing", ["force"], False),
        ("force_missing", ["current"], True),
        ("temperature_missing", ["temperature"], False),
        ("temperature_missing", ["force"], True),
    ],
)
def test_a_board_that_reports_a_failure_of_what_is_used_is_as_good_as_lost(name, channels, usable):
    wire = Wire(channels=channels)
    setattr(wire.board, name, True)
    wire.feed(wire.packet())
    assert wire.faults == (0 if usable else DROPPED)


def test_a_board_that_went_torque_free_by_itself_while_enabled_is_as_good_as_lost():
    wire = Wire()
    wire.board.take(b"\0")

    def exchange(enabled):
        wire.tick["enabled"], wire.tick["current_command_a"] = enabled, 0.1 * enabled
        wire.board.take(wire.sent())
        wire.board.begin_cycle()
        wire.feed(wire.packet())
        return wire.faults

    assert exchange(0) == 0
    assert exchange(1) == 0
    wire.board.begin_cycle(20)  # no command for longer than its time to live
    assert wire.board.held
    assert exchange(1) == DROPPED
    assert exchange(0) == 0, "a command with enable 0 ends the hold"
    assert exchange(1) == 0


def test_a_hold_from_power_up_is_no_fault_of_a_disabled_rig():
    wire = Wire()
    for _ in range(3):
        wire.feed(wire.packet())
        assert wire.faults == 0


def test_a_bit_rate_that_cannot_carry_the_packets_is_refused():
    with pytest.raises(BackendError, match=r"baud 115200 is too slow.*need at least"):
        Wire(n_axes=1, baud=115_200)


def test_tables_for_another_number_of_axes_are_refused():
    with pytest.raises(BackendError, match="axis has 3 tables"):
        Wire(n_axes=2, axis=[{}, {}, {}])


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"port": "ttyUSB0"}, "port"),
        ({"baud": 300}, "baud"),
        ({"channels": ["force", "force"]}, "channels"),
        ({"channels": ["torque"]}, "channels"),
        ({"time_to_live_cycles": 256}, "time_to_live_cycles"),
        ({"axis": []}, "axis"),
        ({"axis": [{"motor_sign": 2}]}, "motor_sign"),
        ({"identity": ""}, "identity"),
        ({"identity": "x" * 17}, "identity"),
        ({"identity": "naïve"}, "identity"),
    ],
)
def test_bad_options_are_refused_by_key(options, key):
    with pytest.raises(ValueError, match=key):
        SerialOptions.model_validate({"port": "/dev/ttyUSB0", **options})


@pytest.mark.parametrize("channels", [["current"], ["estop"]])
def test_a_board_whose_power_stage_lets_go_stays_torque_free_until_it_is_disabled(channels):
    wire = Wire(channels=channels)
    wire.board.take(b"\0")

    def exchange(enabled):
        wire.tick["enabled"], wire.tick["current_command_a"] = enabled, 0.1 * enabled
        wire.board.take(wire.sent())
        wire.board.begin_cycle()
        wire.feed(wire.packet())
        return wire.faults

    assert [exchange(on) for on in (0, 1, 1)] == [0, 0, 0]
    wire.board.estop = True  # it blocks the power stage; a host that is not shown it has the enabled bit only
    seen = [exchange(1) for _ in range(3)]
    wire.board.estop = False
    after = [exchange(1) for _ in range(50)]
    if channels == ["estop"]:
        assert seen == [0, 0, 0]
        return
    assert seen == [DROPPED] * 3
    assert after == [DROPPED] * 50
    assert wire.board.output[0] == 0.0
    assert [exchange(on) for on in (0, 1, 1)] == [0, 0, 0]
    assert wire.board.output[0] == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("cycles", "cycle_us", "taken"),
    [
        (10, 1000, True),
        (20, 500, True),
        (2, 1000, True),
        (11, 1000, False),
        (50, 1000, False),
        (200, 50, True),
        (201, 1000, False),
        (10, 10_000, False),
        (1, 1000, False),
        (10, 100, False),
        (10, 0, False),
    ],
)
def test_a_time_to_live_is_two_to_ten_periods_of_the_loop_whatever_the_boards_own_cycle_is(
    cycles, cycle_us, taken
):
    wire = Wire(time_to_live_cycles=cycles)
    wire.feed(Board(1, "SIM-0001", cycle_us).identity_packet())
    if taken:
        wire.backend._check_identity()
        return
    with pytest.raises(BackendError, match=f"time_to_live_cycles {cycles} are .* must be 2 to 10: 2 to 10"):
        wire.backend._check_identity()
    assert wire.backend.identity is None, "refused: another board may come in its place"
