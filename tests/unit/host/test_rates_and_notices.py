import os
import threading

import pytest

from rtctl.host.exchange.request_rates import MOST_CLIENTS, RateLimit
from rtctl.host.notices import MOST_BYTES, Notices
from rtctl.terminal import Grade, graded


class Clock:
    s = 0.0

    def __call__(self):
        return self.s


def test_a_client_gets_its_burst_then_its_rate_and_others_are_not_touched():
    clock = Clock()
    limit = RateLimit(100.0, 10, clock)
    assert sum(limit.allows("a") for _ in range(50)) == 10
    clock.s += 0.1
    assert sum(limit.allows("a") for _ in range(50)) == 10
    assert limit.allows("b")
    clock.s += 1000
    assert sum(limit.allows("a") for _ in range(50)) == 10, "a long pause saves up no more than a burst"


def test_the_number_of_clients_kept_is_bounded():
    limit = RateLimit(1.0, 1, Clock())
    for number in range(10 * MOST_CLIENTS):
        limit.allows(str(number))
    assert len(limit._buckets) == MOST_CLIENTS


@pytest.fixture
def pipe():
    ends = os.pipe()
    yield ends
    for fd in ends:
        os.close(fd)


def test_one_line_of_a_kind_a_second_and_the_rest_is_counted(pipe):
    clock = Clock()
    notices = Notices(pipe[1], clock)
    for _ in range(1000):
        notices("refused", "unknown key")
    notices("keys", "revoked")
    clock.s += 1.5
    notices("refused", "unknown\nkey")
    lines = os.read(pipe[0], 65536).decode().splitlines()
    assert lines == [
        "rtctl: unknown key",
        "rtctl: revoked",
        "rtctl: unknown key (999 more of this kind)",
    ]
    assert notices.left_out == 999


def test_a_pipe_that_nobody_reads_never_makes_it_wait_and_memory_stays_bounded(pipe):
    clock = Clock()
    notices = Notices(pipe[1], clock)

    def flood():
        for number in range(20_000):
            clock.s += 2.0
            notices(f"kind {number % 100}", "x" * 2 * MOST_BYTES)

    thread = threading.Thread(target=flood, daemon=True)
    thread.start()
    thread.join(120)
    assert not thread.is_alive(), "a notice waited for its reader"
    assert notices.left_out > 10_000
    assert len(notices._kinds) <= 64


def test_a_closed_descriptor_is_no_error():
    read, write = os.pipe()
    os.close(read)
    notices = Notices(write)
    notices("a", "text")
    os.close(write)
    notices("b", "text")
    assert notices.left_out == 2


def test_only_the_journal_is_told_the_grade_and_of_each_line(pipe, monkeypatch):
    found = os.fstat(pipe[1])
    notices = Notices(pipe[1])
    monkeypatch.setenv("JOURNAL_STREAM", f"{found.st_dev}:{found.st_ino + 1}")  # stderr was led elsewhere
    notices("a", "fault", Grade.ERROR)
    monkeypatch.setenv("JOURNAL_STREAM", f"{found.st_dev}:{found.st_ino}")
    notices("b", "fault", Grade.ERROR)
    notices("c", "armed", Grade.INFO)
    assert os.read(pipe[0], 4096) == b"rtctl: fault\n<3>rtctl: fault\nrtctl: armed\n"
    assert graded("one\ntwo", Grade.WARNING, pipe[1]) == "<4>one\n<4>two"
