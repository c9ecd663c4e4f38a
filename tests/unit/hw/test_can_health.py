"""Error frames: what counts as a fault of the bus, and what ends it."""

import pytest

from hw.can.health import BUS_OFF, CONTROLLER, REFUSED_LIMIT, RESTARTED, BusHealth
from hw.interface import LinkFault

RX_PASSIVE, TX_PASSIVE, ACTIVE, TX_WARNING = 0x10, 0x20, 0x40, 0x08


def data(status=0):
    return bytes([0, status, 0, 0, 0, 0, 0, 0])


def test_bus_off_is_a_lost_link_until_the_controller_is_restarted():
    health = BusHealth()
    health.error_frame(BUS_OFF, data())
    assert health.link_faults == LinkFault.LOST
    health.error_frame(CONTROLLER, data(TX_WARNING))
    assert health.link_faults == LinkFault.LOST, "only a restart ends it"
    health.error_frame(RESTARTED, data())
    assert health.link_faults == 0
    assert health.counts["bus_off"] == health.counts["restarted"] == 1


@pytest.mark.parametrize("status", [RX_PASSIVE, TX_PASSIVE])
@pytest.mark.parametrize("end", [ACTIVE, TX_WARNING])
def test_error_passive_is_a_lost_link_until_the_counters_have_fallen(status, end):
    health = BusHealth()
    health.error_frame(CONTROLLER, data(status))
    assert health.link_faults == LinkFault.LOST
    health.error_frame(CONTROLLER, data(end))
    assert health.link_faults == 0


def test_a_warning_alone_is_no_fault():
    health = BusHealth()
    health.error_frame(CONTROLLER, data(TX_WARNING))
    assert health.link_faults == 0


def test_a_full_queue_is_a_fault_after_some_frames_and_until_one_is_taken():
    health = BusHealth()
    for _ in range(REFUSED_LIMIT - 1):
        health.refused()
    assert health.link_faults == 0
    health.refused()
    assert health.link_faults == LinkFault.LOST
    health.taken()
    assert health.link_faults == 0


def test_short_error_frames_are_taken_too():
    health = BusHealth()
    health.error_frame(CONTROLLER | BUS_OFF, b"")
    assert health.bus_off
