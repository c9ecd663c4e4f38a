"""The loop: absolute grid, skipped slots counted, every way out stops the actuator."""

import numpy as np
import pytest

from hw.interface import LinkLost
from rtctl.control.records import new_records
from rtctl.control.vocabulary import State
from rtctl.rt.clock import VirtualClock
from rtctl.rt.loop import Stop, run_loop, warm_up
from rtctl.rt.shared_memory import CommandWriter, Memory, RingReader

PERIOD_NS = 1_000_000


class FakeBackend:
    provides = frozenset({"position", "current", "force"})
    consumes = frozenset({"torque"})

    def __init__(self, on_read=lambda count: None):
        self.count, self.calls, self.written, self.on_read = 0, [], [], on_read

    def open(self):
        self.calls.append("open")

    def read(self, tick):
        self.count += 1
        self.on_read(self.count)
        tick["sample_count"] = self.count

    def write(self, tick):
        self.written.append(float(tick["torque_applied_nm"][0, 0]))

    def stop(self):
        self.calls.append("stop")

    def close(self):
        self.calls.append("close")


class ScriptedClock(VirtualClock):
    """Virtual time that oversleeps by a scripted amount at given wake-ups."""

    def __init__(self, late_ns):
        super().__init__()
        self.late_ns, self.wakeups = late_ns, 0

    def sleep_until(self, deadline_ns):
        self._now = max(self._now, deadline_ns) + self.late_ns.get(self.wakeups, 0)
        self.wakeups += 1
        return self._now


@pytest.fixture
def memory():
    memory = Memory.create(1, 4000, PERIOD_NS)
    params = new_records(1)[0]
    params["period_s"] = 1e-3
    for name, value in {
        "ready_ticks": 500, "soft_start_ticks": 500, "stop_ticks": 50, "target_hold_ticks": 20,
        "target_stop_ticks": 100, "stale_limit_ticks": 3, "energy_budget_j": 0.02, "energy_bank_j": 0.02,
        "inertia_kgm2": 0.012, "gear_ratio": 80, "gear_efficiency": 1, "torque_constant_nm_a": 0.02,
        "count_rad": 1e-5, "position_min_rad": -10, "position_max_rad": 10, "force_limit_n": 50,
        "current_limit_a": 10, "torque_limit_nm": 1, "torque_rate_nm": 0.1, "velocity_limit_rad_s": 10,
        "velocity_window_ticks": 16, "velocity_band_rad": 1e-5, "velocity_alpha": 1, "force_alpha": 1,
    }.items():  # fmt: skip
        params[name] = value
    memory.params[:] = params
    yield memory
    memory.close()


def run(memory, backend, clock=None, stop=None):
    stop = stop or Stop()
    run_loop(backend, memory, clock or VirtualClock(), stop)
    return RingReader(memory, from_start=True).read()


def ask_stop_at(stop, n, requests=1):
    def on_read(count):
        if count == n:
            stop.requests = requests

    return on_read


def test_a_stop_request_ends_the_loop_in_shutdown_and_stops_the_actuator(memory):
    stop = Stop()
    backend = FakeBackend(ask_stop_at(stop, 700))
    rows = run(memory, backend, stop=stop)
    assert rows["state"][-1] == State.SHUTDOWN
    assert 700 <= len(rows) <= 760
    assert backend.calls == ["stop"]
    assert rows["tick"].tolist() == list(range(len(rows)))
    assert np.all(np.diff(rows["time_ns"]) == PERIOD_NS)


def test_a_second_request_cuts_without_another_cycle(memory):
    stop = Stop()
    backend = FakeBackend(ask_stop_at(stop, 100, requests=2))
    rows = run(memory, backend, stop=stop)
    assert len(rows) == 99
    assert backend.calls == ["stop"]


def test_the_host_can_shut_it_down_through_the_mailbox(memory):
    writer = CommandWriter(memory)

    def on_read(count):
        if count == 50:
            writer.command["shutdown_count"] += 1
            writer.send()

    rows = run(memory, FakeBackend(on_read))
    assert rows["state"][-1] == State.SHUTDOWN
    assert rows["command_seq"][-1] == 1


def test_late_slots_are_skipped_counted_and_never_caught_up_in_a_burst(memory):
    stop = Stop()
    late = {10: 400_000, 20: 1_000_000, 30: 7_300_000}
    rows = run(memory, FakeBackend(ask_stop_at(stop, 60)), ScriptedClock(late), stop)
    by_wakeup = rows["tick"]
    assert by_wakeup[10] == 10
    assert rows["wakeup_ns"][10] == 400_000
    assert by_wakeup[20] == 21
    assert rows["wakeup_ns"][20] == 0
    assert by_wakeup[30] == 31 + 7
    assert rows["wakeup_ns"][30] == 300_000
    assert rows["missed_ticks"][-1] == 8
    assert np.all(rows["time_ns"] == rows["time_ns"][0] + rows["tick"] * PERIOD_NS)
    gaps = np.diff(rows["tick"])
    assert gaps.min() == 1
    assert sorted(gaps)[-2:] == [2, 8]


def test_a_backend_that_fails_is_stopped_and_its_error_passed_on(memory):
    def on_read(count):
        if count == 30:
            raise LinkLost("unplugged")

    backend = FakeBackend(on_read)
    with pytest.raises(LinkLost, match="unplugged"):
        run(memory, backend)
    assert backend.calls == ["stop"]
    assert memory.header["head"][0] == 29


def test_warming_up_touches_neither_the_ring_nor_the_mailbox(memory):
    before = memory.header.copy()
    warm_up(memory, FakeBackend())
    assert memory.header == before
    assert not memory.ring_words.any()


def test_the_waiver_is_stamped_into_every_tick(memory):
    stop = Stop()
    run_loop(FakeBackend(ask_stop_at(stop, 20)), memory, VirtualClock(), stop, waiver=True)
    assert RingReader(memory, from_start=True).read()["waiver"].all()


def test_an_unarmed_rig_sends_no_torque(memory):
    stop = Stop()
    backend = FakeBackend(ask_stop_at(stop, 1500))
    rows = run(memory, backend, stop=stop)
    assert not np.any(backend.written)
    assert not rows["enabled"].any()


def test_what_is_written_was_decided_from_what_was_read_in_the_same_cycle(memory):
    class Stopped(FakeBackend):
        def read(self, tick):
            super().read(tick)
            tick["estop"] = self.count >= 10

        def write(self, tick):
            self.written.append(State(int(tick["state"][0])))

    stop = Stop()
    backend = Stopped(ask_stop_at(stop, 15))
    run(memory, backend, stop=stop)
    assert backend.written[8:10] == [State.IDLE, State.ESTOP]


def test_a_rig_without_a_temperature_sensor_shows_no_temperature(memory):
    stop = Stop()
    rows = run(memory, FakeBackend(ask_stop_at(stop, 20)), stop=stop)
    assert np.isnan(rows["temperature_c"]).all()
