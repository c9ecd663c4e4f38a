"""Force sensors over a pty and a loopback socket: units, damage, unplugging, commands."""

import threading
import time
from pathlib import Path

import pytest
from force_bench import benches, make
from force_devices import SENSORS, OptoForce, Rdt, Rokubi, force_of
from patience import PATIENCE_S

from hw.force import optoforce, rdt, rokubi
from hw.force import serial_backend as serial_sensor
from hw.interface import BackendError, LinkFault, LinkLost
from rtctl.tick import new_ticks


def descriptors():
    return sum(1 for _ in Path("/proc/self/fd").iterdir())


@pytest.fixture
def bench():
    with benches() as make_bench:
        yield make_bench


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
    assert at.send(at.device.frame(2))["sample_count"] == 1, "the rest, for which the kernel had no room"
    tick = at.send(at.device.frame(3))
    assert (tick["sample_count"], tick["link_faults"]) == (2, 0)


@pytest.mark.parametrize("kind", ["rokubi", "optoforce"])
def test_the_frame_of_opening_is_not_fresh_behind_a_backlog(bench, kind, monkeypatch):
    at = bench(kind)
    frame = at.device.frame(1)
    at.backend._waiting = at.backend._decode(frame)  # as `open` leaves it, while other devices are opened
    monkeypatch.setattr(at.backend._port, "read_into", lambda _views: serial_sensor.FULL)
    assert at.read()["sample_count"] == 0
    monkeypatch.undo()
    at.read()
    assert at.send(at.device.frame(2))["sample_count"] == 1


@pytest.mark.parametrize("kind", ["rokubi", "optoforce"])
def test_an_interrupted_opening_leaves_no_locked_port(kind, monkeypatch):
    device = SENSORS[kind]()
    backend = make(device, open_timeout_s=1.0)

    def _interrupted(*_given):
        raise KeyboardInterrupt

    monkeypatch.setattr(serial_sensor.select, "select", _interrupted)
    with pytest.raises(KeyboardInterrupt):
        backend.open()
    assert backend._port is None
    monkeypatch.undo()
    device.close()


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
    assert at.device.heard() == b"R\n"
    at.backend.close()
    assert at.device.heard() == b"C\n"


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
        tick, deadline = new_ticks(), time.monotonic() + PATIENCE_S
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
