"""What the host's end of a link makes of packets: freshness, order, units, signs, wraps."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from serial_wire import COUNTS, Wire

from hw.interface import LinkFault
from hw.serial import link
from hw.simulators.serial_firmware import Board
from rtctl.tick import new_ticks


def test_units_and_signs():
    wire = Wire(axis=[{"position_sign": -1, "position_offset_rad": 0.5, "motor_sign": -1}])
    wire.counts[:] = COUNTS // 4
    wire.measured["current_a"], wire.measured["temperature_c"] = 1.25, 31.5
    wire.measured["force_n"] = [1.5, -2.5, 0.000001]
    wire.board.estop = True
    tick = wire.feed(wire.packet())
    assert tick["position_rad"][0, 0] == pytest.approx(0.5 - math.pi / 2, abs=1e-12)
    assert tick["current_a"][0, 0] == pytest.approx(-1.25)
    assert tick["temperature_c"][0, 0] == pytest.approx(31.5)
    assert tick["force_n"][0] == pytest.approx([1.5, -2.5, 1e-6])
    assert tick["estop"][0] == 1


def test_a_velocity_has_the_unit_and_sign_of_the_position():
    wire = Wire(n_axes=2, channels=["velocity"], axis=[{"position_sign": -1}, {}], velocity=True)
    wire.measured["device_velocity_rad_s"] = 0.25, -0.5
    tick = wire.feed(wire.packet())
    tenth = 0.1 * 2 * math.pi / COUNTS
    assert tick["device_velocity_rad_s"][0] == pytest.approx([-0.25, -0.5], abs=tenth)
    assert (wire.count, wire.faults) == (1, 0)
    wire.measured["device_velocity_rad_s"] = 1e9
    wire.feed(wire.packet())
    full = (2**31 - 1) * tenth
    assert tick["device_velocity_rad_s"][0] == pytest.approx([-full, full])


@pytest.mark.parametrize("missing", ["the board says so", "it sends packets without"])
def test_a_velocity_that_is_used_and_missing_is_a_fault_of_the_device(missing):
    wire = Wire(channels=["velocity"], velocity=missing == "the board says so")
    wire.board.velocity_missing = missing == "the board says so"
    wire.feed(wire.packet())
    assert wire.faults == LinkFault.DEVICE
    other = Wire(velocity=missing == "the board says so")
    other.board.velocity_missing = True
    other.feed(other.packet())
    assert (other.count, other.faults) == (1, 0)


def test_channels_the_board_does_not_have_are_left_alone():
    wire = Wire(channels=[], velocity=True)
    wire.tick["device_velocity_rad_s"] = 7
    wire.tick["current_a"], wire.tick["force_n"], wire.tick["temperature_c"], wire.tick["estop"] = 7, 7, 7, 7
    wire.board.estop = True
    wire.feed(wire.packet())
    for name in ("current_a", "force_n", "temperature_c", "estop", "device_velocity_rad_s"):
        assert (wire.tick[name] == 7).all()
    assert wire.count == 1


def test_only_the_newest_of_several_packets_is_shown():
    wire = Wire()
    first = wire.packet()
    wire.counts[:] = 5
    wire.feed(first + wire.packet())
    assert wire.count == 1
    assert round(wire.tick["position_rad"][0, 0] * COUNTS / 2 / math.pi) == 5


def test_a_sample_is_fresh_once():
    wire = Wire()
    wire.feed(wire.packet())
    for _ in range(3):
        wire.feed(b"")
        assert wire.count == 1
        assert wire.faults == 0


@pytest.mark.parametrize("again", ["duplicate", "older", "old sample in a new packet"])
def test_nothing_older_is_ever_accepted(again):
    wire = Wire()
    older = wire.packet()
    wire.counts[:] = 5
    newest = wire.packet()
    wire.feed(newest)
    data = {"duplicate": newest, "older": older}.get(again) or wire.packet(step_us=0)
    before = wire.tick["position_rad"].copy()
    wire.feed(data)
    assert wire.count == 1
    assert wire.faults == LinkFault.SEQUENCE
    assert (wire.tick["position_rad"] == before).all()
    wire.feed(wire.packet())
    assert wire.count == 2
    assert wire.faults == 0


@pytest.mark.parametrize(
    ("numbers", "step_us"), [(-5, 1000), (0, 1000), (0x8000, 1000), (1, 0), (1, -1), (1, 1 << 31)]
)
def test_a_sample_must_be_newer_by_number_and_by_time(numbers, step_us):
    wire = Wire()
    wire.feed(wire.packet())
    assert wire.count == 1
    wire.board.sequence += numbers - 1
    wire.feed(wire.packet(step_us))
    assert wire.count == 1
    assert wire.faults & LinkFault.SEQUENCE


def test_packets_that_are_no_states_are_no_samples_and_no_damage():
    wire = Wire()
    other = Board(3, "SIM-0003", 1000).state_packet(new_ticks(1, 3), np.zeros(3), 1)
    wire.feed(wire.board.identity_packet() + other)
    record = wire.backend.link[0]
    assert (wire.count, int(wire.faults)) == (0, 0)
    assert (record["identified"], record["foreign"], record["damaged"]) == (1, 1, 0)


def test_a_part_of_a_cycles_bytes_shows_nothing_yet():
    wire = Wire()
    wire.feed(wire.packet(), link.MORE)
    assert wire.count == 0
    wire.feed(b"")
    assert wire.count == 1


def test_sequence_and_clock_run_over_their_ends():
    wire = Wire()
    wire.board.sequence, wire.time_us = 65_530, 2**32 - 5000
    for k in range(12):
        wire.feed(wire.packet())
        assert wire.count == k + 1
    assert wire.backend.link["older"][0] == 0
    assert wire.backend.link["lost"][0] == 0


def test_a_gap_is_counted_and_the_new_sample_taken():
    wire = Wire()
    wire.feed(wire.packet())
    wire.packet(), wire.packet()
    wire.feed(wire.packet())
    assert wire.count == 2
    assert wire.faults == 0
    assert wire.backend.link["lost"][0] == 2


def test_damage_is_a_checksum_fault_unless_a_good_sample_follows_at_once():
    wire = Wire()
    wire.feed(wire.packet())
    bad = bytearray(wire.packet())
    bad[7] ^= 0x10
    wire.feed(bytes(bad))
    assert wire.faults == LinkFault.CHECKSUM
    assert wire.count == 1
    wire.feed(bytes(bad) + wire.packet())
    assert wire.faults == 0
    assert wire.count == 2
    assert wire.backend.counts() == {
        "good": 2,
        "damaged": 2,
        "older": 0,
        "lost": 1,
        "foreign": 0,
        "unsent": 0,
    }


def test_nothing_out_of_a_backlog_is_fresh_and_what_comes_after_it_is():
    wire = Wire()
    wire.feed(wire.packet())
    cut_by_the_kernel = wire.packet()[10:]
    wire.feed(cut_by_the_kernel + wire.packet(), link.BACKLOGGED)
    assert (wire.count, wire.faults) == (1, 0)
    wire.board.sequence += 40_000  # the loop stood still for more than half the range of sequence numbers
    wire.feed(wire.packet(step_us=3_000_000_000))
    assert wire.count == 2
    assert wire.faults == 0


@pytest.mark.parametrize("start", [0, 2**31 - 3, -(2**31) + 2, 2**32 - 3])
@pytest.mark.parametrize("step", [1, -1, 1000, -1000])
def test_the_counter_may_run_over_its_end_in_both_directions(start, step):
    wire = Wire()
    position = []
    for k in range(8):
        wire.counts[:] = start + k * step
        position.append(wire.feed(wire.packet())["position_rad"][0, 0])
    assert np.diff(position) == pytest.approx(np.full(7, step * 2 * math.pi / COUNTS), rel=1e-6)


@settings(deadline=None)
@given(st.lists(st.integers(-(2**31) + 1, 2**31 - 1), max_size=20))
def test_unwrapped_counts_are_the_sum_of_the_steps(steps):
    wire = Wire()
    total = 0
    for step in steps:
        total += step
        wire.counts[:] = total
        wire.feed(wire.packet())
    assert wire.backend.link["position_counts"][0, 0] == total
