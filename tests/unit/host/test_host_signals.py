"""Signals of the host: counted, and seen by a poll once."""

import os
import select
import signal
from pathlib import Path

import pytest

from rtctl.host.signals import Signals


def is_readable(signals):
    return bool(select.select([signals], [], [], 0)[0])


@pytest.fixture
def signals():
    made = Signals()
    yield made
    made.close()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_requests_to_end_are_counted(signals, number):
    assert not is_readable(signals)
    os.kill(os.getpid(), number)
    os.kill(os.getpid(), number)
    assert (signals.ends, signals.hangups) == (2, 0)
    assert is_readable(signals)


def test_a_hangup_ends_one_poll_and_not_every_poll_after_it(signals):
    os.kill(os.getpid(), signal.SIGHUP)
    assert (signals.ends, signals.hangups) == (0, 1)
    assert is_readable(signals)
    signals.drain()
    assert not is_readable(signals)
    signals.drain()
    os.kill(os.getpid(), signal.SIGHUP)
    assert is_readable(signals)


def test_the_handlers_of_before_come_back():
    kinds = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.getsignal(number) for number in kinds]
    opened = sorted(Path("/proc/self/fd").iterdir())
    Signals().close()
    assert [signal.getsignal(number) for number in kinds] == before
    assert sorted(Path("/proc/self/fd").iterdir()) == opened
