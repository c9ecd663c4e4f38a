"""The axis of a CiA 402 drive on a bus that only remembers: what it says about damage, silence, faults, and
how it goes off.
"""

import math
import struct

import pytest
from remembering_bus import AXIS, DEVICE, LOST, OPTIONS, RIG, Bus, three_looks

from hw.can import cia402
from hw.can.sample import Sample
from hw.interface import BackendError


@pytest.fixture
def no_waiting(monkeypatch):
    monkeypatch.setattr(cia402, "wait_for", three_looks)


def cia402_axis(**more):
    sample = Sample(1)
    axis = cia402.Cia402Axis({**AXIS, **more}, OPTIONS, RIG, 0, sample)
    bus = Bus()
    axis._command, axis._sync = bus.outgoing(1, 4), bus.outgoing(2, 0)
    return axis, sample, axis.handlers(), bus


def feedback(on, statusword, counts=4096, current=500):
    on[cia402.TPDO1 + 5](struct.pack("<Hih", statusword, counts, current), 0, 8)


def test_a_cia402_drive_turns_feedback_into_angle_and_current_and_refuses_other_lengths():
    axis, sample, on, _ = cia402_axis()
    on[cia402.TPDO1 + 5](bytes(7), 0, 7)
    assert sample.counts["damaged"] == 1
    on[cia402.HEARTBEAT + 5](b"\x04\x00", 0, 2)
    on[cia402.EMERGENCY + 5](b"\x10", 0, 1)
    assert (axis.nmt, axis.emergency) == (cia402.OPERATIONAL, 0)
    feedback(on, 0x27)
    assert axis.state == cia402.ENABLED
    assert sample.position_rad[0] == pytest.approx(2 * math.pi / 10)
    assert sample.current_a[0] == pytest.approx(1.0)
    on[cia402.EMERGENCY + 5](b"\x10\x23\x00", 0, 3)
    assert axis.status() == "node 5: operation enabled, emergency 0x2310 (continuous over-current)"


def test_a_cia402_drive_that_missed_its_start_is_started_again(monkeypatch, no_waiting):
    axis, _, on, bus = cia402_axis()
    monkeypatch.setattr("hw.can.cia402_setup.configure", lambda *_: (1.0, 2.0, b"who"))
    start = (0x000, bytes([0x01, 5]))
    bus.answer = lambda: feedback(on, 0x21) if bus.sent.count(start) == 2 else None
    axis.set_up(bus)
    assert (bus.sent.count(start), axis.identity) == (2, b"who")


def test_the_velocity_of_a_cia402_drive_is_part_of_the_sample_only_where_it_is_wanted():
    axis, sample, on, _ = cia402_axis()
    assert cia402.TPDO2 + 5 not in on
    feedback(on, 0x27)
    assert axis._heard()
    axis, sample, on, _ = cia402_axis(velocity_units=8192.0, direction=-1)
    feedback(on, 0x27)
    assert not axis._heard()
    on[cia402.TPDO2 + 5](bytes(8), 0, 8)
    assert (sample.counts["damaged"], axis._heard()) == (1, False)
    on[cia402.TPDO2 + 5](struct.pack("<i", -4096), 0, 4)
    assert axis._heard()
    assert sample.fresh == sample.needed
    assert sample.velocity_rad_s[0] == pytest.approx(0.5 * 2 * math.pi / 10)


def test_a_cia402_drive_gets_torque_only_when_enabled_and_answering_so():
    axis, _, on, bus = cia402_axis()
    feedback(on, 0x23)
    axis.write(bus, 2.0, True)
    assert struct.unpack("<Hh", bus.sent[-1][1]) == (cia402.ENABLE, 0)
    feedback(on, 0x27)
    axis.write(bus, 2.0, True)
    assert struct.unpack("<Hh", bus.sent[-1][1]) == (cia402.ENABLE, 100)
    axis.write(bus, 2.0, False)
    assert struct.unpack("<Hh", bus.sent[-1][1]) == (cia402.SHUT_DOWN, 0)
    axis.prime(bus)
    axis.stop(bus)
    assert [data for _, data in bus.sent[-3:]] == [struct.pack("<Hh", 6, 0), struct.pack("<Hh", 6, 0), b""]
    assert axis.status() == "node 5: operation enabled"


def test_a_cia402_drive_in_fault_not_operational_not_enabled_or_silent_is_a_fault():
    axis, _, on, bus = cia402_axis()
    feedback(on, 0x08)
    assert axis.link_faults() == DEVICE
    feedback(on, 0x21)
    assert axis.link_faults() == 0
    on[cia402.HEARTBEAT + 5](b"\x04", 0, 1)
    assert axis.link_faults() == DEVICE
    on[cia402.HEARTBEAT + 5](b"\x05", 0, 1)
    for _ in range(50):
        axis.write(bus, 0.0, True)
    assert axis.link_faults() == 0
    axis.write(bus, 0.0, True)
    assert axis.link_faults() == LOST
    for _ in range(950):
        axis.write(bus, 0.0, True)
    assert axis.link_faults() == DEVICE | LOST


def test_a_cia402_drive_is_set_up_or_refused_when_no_feedback_comes(monkeypatch, no_waiting):
    monkeypatch.setattr("hw.can.cia402_setup.configure", lambda *_: (1.5, 3.0, b"number"))
    axis, _, on, _ = cia402_axis()
    bus = Bus()
    with pytest.raises(BackendError, match="no TPDO after SYNC"):
        axis.set_up(bus)
    assert [can_id for can_id, _ in bus.sent] == [cia402.NMT, cia402.RPDO1 + 5, cia402.SYNC] * 5
    axis.set_up(Bus(lambda: feedback(on, 0x21)))
    assert axis.identity == b"number"


@pytest.mark.parametrize("direction", [1, -1])
def test_a_cia402_drive_without_a_current_shows_the_one_its_torque_takes(monkeypatch, no_waiting, direction):
    axis, sample, on, bus = cia402_axis(direction=direction)
    monkeypatch.setattr("hw.can.cia402_setup.configure", lambda *_: (1.5, None, b"who"))
    bus.answer = lambda: feedback(on, 0x21, current=500)
    axis.set_up(bus)
    feedback(on, 0x21, current=500)
    assert sample.current_a[0] == pytest.approx(direction * 0.5 * 1.5 / 0.05)


def test_a_cia402_drive_that_drops_out_of_operation_enabled_is_not_walked_back_into_it():
    axis, _, on, bus = cia402_axis()
    feedback(on, 0x27)
    axis.write(bus, 2.0, True)
    feedback(on, 0x27)
    axis.write(bus, 2.0, True)
    assert axis.link_faults() == 0
    feedback(on, 0x40)
    assert axis.link_faults() == DEVICE, "in this very cycle"
    for state in (0x40, 0x21, 0x23, 0x27, 0x08) * 40:
        feedback(on, state)
        axis.write(bus, 2.0, True)
        control, target = struct.unpack("<Hh", bus.sent[-1][1])
        assert (control in (cia402.SHUT_DOWN, cia402.DISABLE_VOLTAGE), target) == (True, 0)
        assert axis.link_faults() & DEVICE
    feedback(on, 0x27)
    axis.write(bus, 2.0, False)
    assert axis.link_faults() & DEVICE == 0
