"""RDT over a loopback socket: order, gaps, floods, silence, strangers."""

import time

import pytest
from force_bench import benches, make
from force_devices import Rdt, force_of
from patience import PATIENCE_S

from hw.force import rdt, rdt_backend
from hw.interface import BackendError, LinkFault


@pytest.fixture
def bench():
    with benches() as make_bench:
        yield make_bench


def test_rdt_is_asked_to_stream_and_to_stop(bench):
    at = bench("rdt")
    assert at.device.heard() == rdt.START_REALTIME
    at.backend.close()
    assert at.device.heard() == rdt.STOP


def test_an_older_record_is_never_used_and_gaps_are_counted(bench):
    at = bench("rdt")
    at.send(Rdt.frame(5))
    tick = at.send(Rdt.frame(4))
    assert tick["sample_count"] == 1
    assert tick["force_n"].tolist() == pytest.approx(force_of(5))
    at.send(Rdt.frame(9))
    counts = at.backend.counts()
    assert (counts["older"], counts["lost"], counts["received"]) == (1, 3, 2)


def test_what_came_before_the_first_sample_is_shown_is_not_lost(bench):
    at = bench("rdt")
    tick = at.send(Rdt.frame(5), Rdt.frame(300))  # the sensor streams while the loop is still being compiled
    assert (tick["sample_count"], at.backend.counts()["lost"]) == (1, 0)
    at.send(Rdt.frame(302))
    assert at.backend.counts()["lost"] == 1


def test_the_newest_of_a_burst_of_records_is_shown_even_out_of_order(bench):
    at = bench("rdt")
    tick = at.send(Rdt.frame(2), Rdt.frame(4), Rdt.frame(3))
    assert tick["force_n"].tolist() == pytest.approx(force_of(4))


def test_record_numbers_may_wrap(bench):
    at = bench("rdt")
    at.send(Rdt.frame(1, number=2**32 - 1))
    tick = at.send(Rdt.frame(2, number=0))
    assert tick["sample_count"] == 2
    assert at.backend.counts()["lost"] == 0


def test_datagrams_of_another_size_are_refused_and_told(bench):
    at = bench("rdt")
    at.send(Rdt.frame(1))
    assert at.send(Rdt.frame(2)[:-1])["link_faults"] == LinkFault.CHECKSUM
    assert at.send(Rdt.frame(2) + b"\0")["sample_count"] == 1
    assert at.backend.counts()["malformed"] == 2


def test_a_flood_is_not_drained_for_ever_and_shows_nothing_until_it_is(bench, monkeypatch):
    at = bench("rdt")
    at.send(Rdt.frame(1))
    monkeypatch.setattr(rdt_backend, "DRAIN_MOST", 3)
    for k in range(2, 7):
        at.device.write(Rdt.frame(k))
    shown = [at.read() for _ in range(3)]
    assert [int(tick["sample_count"]) for tick in shown] == [1, 1, 1], "nor what is left of it"
    assert at.send(Rdt.frame(8))["force_n"].tolist() == pytest.approx(force_of(8))


class Clock:
    """Stands in for the time module in the backend: only what it needs."""

    def __init__(self):
        self.ns = 10**9

    def monotonic_ns(self):
        return self.ns

    def monotonic(self):
        return self.ns / 1e9


def test_a_silent_sensor_is_lost_asked_again_and_taken_back_from_any_number(bench, monkeypatch):
    clock = Clock()
    monkeypatch.setattr(rdt_backend, "time", clock)
    at = bench("rdt", lost_after_s=0.02)
    at.send(Rdt.frame(50))
    clock.ns += 19_000_000
    assert at.read()["link_faults"] == 0
    clock.ns += 2_000_000
    assert at.read()["link_faults"] == LinkFault.LOST
    clock.ns += 600_000_000
    at.read()
    assert at.device.heard() == rdt.START_REALTIME
    tick = at.send(Rdt.frame(1))
    assert (tick["sample_count"], tick["link_faults"]) == (2, 0)


def test_a_host_that_refuses_is_silence_not_an_exception(bench):
    at = bench("rdt", lost_after_s=0.002)
    at.device.unplug()
    at.backend._ask(0)
    deadline = time.monotonic() + PATIENCE_S
    while at.read()["link_faults"] != LinkFault.LOST:
        assert time.monotonic() < deadline


def test_records_of_a_stranger_are_not_seen(bench):
    at, stranger = bench("rdt"), Rdt()
    at.device.heard()
    stranger.host = at.backend._socket.getsockname()
    stranger.write(Rdt.frame(99))
    tick = at.send(Rdt.frame(1))
    stranger.close()
    assert tick["force_n"].tolist() == pytest.approx(force_of(1))
    assert at.backend.counts()["received"] == 1


def test_a_host_without_its_sensor_is_refused_with_the_reason():
    device = Rdt()
    backend = make(device, open_timeout_s=0.01)
    with pytest.raises(BackendError, match="no record within"):
        backend.open()
    device.close()
