"""Force sensors over a pty and a loopback socket: units, damage, silence, unplugging, commands."""

import threading
import time
from pathlib import Path

import numpy as np
import pytest
from force_devices import SENSORS, OptoForce, Rdt, Rokubi, force_of

from hw import registry
from hw.force import optoforce, rdt, rdt_backend, rokubi, serial_sensor
from hw.interface import BackendError, LinkFault, LinkLost, Rig
from rtctl.tick import new_ticks

RIG = Rig(1, 1e-3, np.ones(1), np.ones(1), np.ones(1), np.ones(1), np.ones((1, 3)))


def make(device, **more):
    options = registry.options_model(device.kind).model_validate({**device.options, **device.where, **more})
    return registry.create(device.kind, options.model_dump(mode="json"), RIG)


def descriptors():
    return sum(1 for _ in Path("/proc/self/fd").iterdir())


class Bench:
    """A played sensor and its backend."""

    def __init__(self, kind, **more):
        self.device = SENSORS[kind]()
        self.backend = make(self.device, **more)
        self.backend.open()

    def send(self, *frames):
        for frame in frames:
            self.device.write(frame)
        self.device.arrived(self.backend)
        return self.read()

    def read(self):
        tick = new_ticks()
        self.backend.read(tick)
        return tick[0]

    def close(self):
        self.backend.close()
        self.device.close()


@pytest.fixture
def bench():
    made = []

    def _make(kind, **more):
        made.append(Bench(kind, **more))
        return made[-1]

    yield _make
    for one in made:
        one.close()


@pytest.mark.parametrize("kind", SENSORS)
def test_forces_arrive_in_newton(bench, kind):
    at = bench(kind)
    tick = at.send(at.device.frame(3))
    assert tick["force_n"].tolist() == pytest.approx(force_of(3))
    assert (tick["sample_count"], tick["link_faults"]) == (1, 0)


@pytest.mark.parametrize("kind", SENSORS)
def test_the_matrix_turns_mirrors_and_mixes(bench, kind):
    at = bench(kind, matrix=[[0, 1, 0], [-1, 0, 0], [0, 0, 0.5]])
    x, y, z = force_of(2)
    assert at.send(at.device.frame(2))["force_n"].tolist() == pytest.approx([y, -x, 0.5 * z])


@pytest.mark.parametrize("kind", SENSORS)
def test_without_a_new_sample_nothing_is_fresh_and_the_last_force_stays(bench, kind):
    at = bench(kind)
    at.send(at.device.frame(3))
    tick = at.read()
    assert tick["sample_count"] == 1
    assert tick["force_n"].tolist() == pytest.approx(force_of(3))


@pytest.mark.parametrize("kind", SENSORS)
def test_a_sample_shown_twice_by_the_sensor_is_fresh_once(bench, kind):
    at = bench(kind)
    at.send(at.device.frame(3))
    again = at.device.frame(3) if kind != "rdt" else Rdt.frame(3, number=4)
    assert at.send(again)["sample_count"] == 1
    assert at.backend.counts()["repeated"] == 1


@pytest.mark.parametrize(
    ("kind", "status"),
    [
        *(("rokubi", int(bit)) for bit in rokubi.Status if bit < 16),
        ("optoforce", 0x0200),
        ("optoforce", 0x2000),
        ("rdt", 0xC0000000),
    ],
)
def test_a_sample_the_device_does_not_vouch_for_is_no_sample(bench, kind, status):
    at = bench(kind)
    at.send(at.device.frame(1))
    tick = at.send(at.device.frame(2, status=status))
    assert tick["link_faults"] == LinkFault.DEVICE
    assert tick["sample_count"] == 1
    assert tick["force_n"].tolist() == pytest.approx(force_of(1))
    tick = at.send(at.device.frame(3))
    assert (tick["link_faults"], tick["sample_count"]) == (0, 2)
    assert at.backend.counts()["refused"] == 1


@pytest.mark.parametrize("kind", ["rokubi", "optoforce"])
def test_a_damaged_frame_is_dropped_and_told(bench, kind):
    at = bench(kind)
    at.send(at.device.frame(1))
    bad = bytearray(at.device.frame(2))
    bad[9] ^= 4
    tick = at.send(bytes(bad))
    assert (tick["link_faults"], tick["sample_count"]) == (LinkFault.CHECKSUM, 1)
    tick = at.send(at.device.frame(3))
    assert (tick["link_faults"], tick["sample_count"]) == (0, 2)
    assert at.backend.counts()["checksum"] == 1


@pytest.mark.parametrize("kind", ["rokubi", "optoforce"])
def test_a_backlog_that_filled_the_kernels_buffer_is_not_fresh(bench, kind, monkeypatch):
    at = bench(kind)
    at.send(at.device.frame(1))
    frame = at.device.frame(2)

    def _full(views):
        data = (frame * (4096 // len(frame) + 1))[: serial_sensor.FULL]
        views[0][: len(data)] = data
        return len(data)

    monkeypatch.setattr(at.backend._port, "read_into", _full)
    assert at.read()["sample_count"] == 1
    assert at.backend.counts()["overflows"] == 1
    monkeypatch.undo()
    tick = at.send(at.device.frame(3))
    assert (tick["sample_count"], tick["link_faults"]) == (2, 0)


@pytest.mark.parametrize("kind", ["rokubi", "optoforce"])
def test_an_unplugged_sensor_is_a_lost_link_within_two_cycles(bench, kind):
    at = bench(kind)
    at.send(at.device.frame(1))
    at.device.unplug()
    with pytest.raises(LinkLost, match=str(at.device.path)):
        [at.read() for _ in range(2)]
    at.backend.stop()


@pytest.mark.parametrize("kind", SENSORS)
def test_before_open_and_after_close_the_link_is_lost(bench, kind):
    at = bench(kind)
    at.backend.close()
    with pytest.raises(LinkLost, match="not open"):
        at.read()
    with pytest.raises(LinkLost, match="not open"):
        at.backend.write(new_ticks())


@pytest.mark.parametrize("kind", SENSORS)
def test_a_thousand_openings_leak_no_descriptor_and_no_thread(bench, kind):
    at = bench(kind)
    at.backend.close()
    before, threads = descriptors(), threading.active_count()
    for _ in range(1000):
        at.backend.open()
        at.backend.close()
        if kind != "rdt":
            at.device.heard()  # the commands of each, lest the pty fill up
    assert descriptors() == before
    assert threading.active_count() == threads


@pytest.mark.parametrize("kind", SENSORS)
def test_the_count_goes_on_after_reopening(bench, kind):
    at = bench(kind)
    at.send(at.device.frame(1))
    at.backend.close()
    at.backend.open()
    if kind == "rdt":
        while at.device.heard() != rdt.START_REALTIME:
            pass
    assert at.send(at.device.frame(1))["sample_count"] == 2


def test_rokubi_is_set_running_and_left_running_unless_asked(bench):
    at = bench("rokubi", stop_at_close=True)
    assert at.device.heard() == b"R"
    at.backend.close()
    assert at.device.heard() == b"C"


def test_optoforce_is_configured_and_stopped(bench):
    at = bench("optoforce", output_hz=333, filter_hz=150)
    assert at.device.heard() == optoforce.configure(333, 150)
    at.backend.close()
    assert at.device.heard() == optoforce.configure(0, 150)


def test_the_answer_to_the_configuration_is_no_damage(bench):
    at = bench("optoforce")
    answer = bytes((0xAA, 0x00, 0x50, 0x01, 0x00, 0x00, 0xFB))
    tick = at.send(answer + OptoForce.frame(1))
    assert (tick["sample_count"], tick["link_faults"]) == (1, 0)


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
    for k in range(2, 8):
        at.device.write(Rdt.frame(k))
    shown = [at.read() for _ in range(3)]
    assert [int(tick["sample_count"]) for tick in shown[:2]] == [1, 1]
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
    deadline = time.monotonic() + 20
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


@pytest.mark.parametrize(
    ("sensor", "noise", "words"),
    [(Rokubi, b"", "nothing came"), (OptoForce, b"", "nothing came")],
)
def test_a_port_without_its_sensor_is_refused_with_the_reason(sensor, noise, words):
    device = sensor()
    backend = make(device, open_timeout_s=0.01)
    with pytest.raises(BackendError, match=words) as caught:
        backend.open()
    assert device.path in str(caught.value)
    device.close()


def test_a_host_without_its_sensor_is_refused_with_the_reason():
    device = Rdt()
    backend = make(device, open_timeout_s=0.01)
    with pytest.raises(BackendError, match="no record within"):
        backend.open()
    device.close()


class Streaming:
    """Sends frames from a thread until told to stop, as a real sensor does."""

    def __init__(self, device):
        self.device, self._stop = device, threading.Event()
        self._thread = threading.Thread(target=self._run)

    def _run(self):
        k = 0
        while not self._stop.wait(0.001):
            k += 1
            try:
                self.device.write(self.device.frame(k))
            except (BlockingIOError, ConnectionRefusedError):
                continue

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_exc):
        self._stop.set()
        self._thread.join()


@pytest.mark.parametrize("kind", SENSORS)
def test_opening_waits_for_the_first_sample_and_the_first_read_may_show_it(kind):
    device = SENSORS[kind]()
    backend = make(device, open_timeout_s=10.0)
    with Streaming(device):
        backend.open()
        tick, deadline = new_ticks(), time.monotonic() + 20
        while tick["sample_count"][0] < 5:
            backend.read(tick)
            assert time.monotonic() < deadline
        assert tick["link_faults"][0] == 0
        backend.close()
    device.close()


@pytest.mark.parametrize("kind", SENSORS)
def test_options_are_refused_with_their_bounds(kind):
    device = SENSORS[kind]()
    with pytest.raises(ValueError, match="matrix"):
        make(device, matrix=[[0, 0, 0]] * 3)
    with pytest.raises(ValueError, match="open_timeout_s"):
        make(device, open_timeout_s=11.0)
    device.close()


def test_only_the_layout_with_four_sensors_has_a_second_one():
    device = OptoForce()
    with pytest.raises(ValueError, match="only layout '4x3-axis'"):
        make(device, sensor=2)
    device.close()
