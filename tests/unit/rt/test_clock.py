"""Clocks: absolute deadlines, and virtual time that waits only for the reader."""

import time

import numpy as np
import pytest

from rtctl.rt.clock import VirtualClock, WallClock
from rtctl.rt.shared_memory import Memory


def test_the_wall_clock_never_wakes_before_the_deadline():
    clock = WallClock()
    for wait_ns in (0, 50_000, 2_000_000):
        deadline = time.monotonic_ns() + wait_ns
        woke = clock.sleep_until(deadline)
        assert deadline <= woke <= time.monotonic_ns()


def test_a_deadline_in_the_past_returns_at_once_with_the_present_time():
    clock = WallClock()
    before = time.monotonic_ns()
    assert before <= clock.sleep_until(before - 10**9) <= time.monotonic_ns()


@pytest.mark.compiled
def test_an_impossible_deadline_is_an_error_not_an_endless_wait():
    with pytest.raises(OSError, match="clock_nanosleep"):
        WallClock().sleep_until(-1)


def test_a_signal_does_not_end_the_sleep_early():
    import signal

    seen = []
    old = signal.signal(signal.SIGALRM, lambda *_: seen.append(1))
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.02)
        deadline = time.monotonic_ns() + 60_000_000
        assert WallClock().sleep_until(deadline) >= deadline
        assert seen
    finally:
        signal.signal(signal.SIGALRM, old)


def test_virtual_time_jumps_to_the_deadline_and_never_goes_back():
    clock = VirtualClock()
    assert clock.now() == 0
    assert clock.sleep_until(5_000_000) == 5_000_000
    assert clock.sleep_until(1_000_000) == 5_000_000


def test_virtual_time_waits_for_a_reader_that_is_half_a_ring_behind():
    import threading

    memory = Memory.create(1, 100, 1_000_000)
    memory.header["head"] = 60
    clock, woke = VirtualClock(memory.header), threading.Event()
    thread = threading.Thread(target=lambda: (clock.sleep_until(1), woke.set()))
    thread.start()
    assert not woke.wait(0.05)
    memory.header["read_head"] = 20
    assert woke.wait(60)
    thread.join()
    memory.close()
    assert np.all(memory.header["head"] == 60)


def test_virtual_time_runs_ahead_of_a_reader_by_as_much_as_is_said():
    memory = Memory.create(1, 100, 1_000_000)
    clock = VirtualClock(memory.header)
    memory.header["head"] = 20
    assert clock.room() == 31
    memory.header["ahead_rows"] = 20
    assert clock.room() == 1
    memory.close()


def test_virtual_time_does_not_wait_for_a_reader_once_the_process_shall_end():
    memory = Memory.create(1, 100, 1_000_000)
    memory.header["head"] = 60
    assert VirtualClock(memory.header, lambda: True).sleep_until(7) == 7
    memory.close()
