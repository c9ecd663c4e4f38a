"""Signals of the host: counted, and seen by a poll once."""

import os
import pty
import select
import signal
import sys
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
    assert (signals.ends, signals.hangups, signals.terminated) == (2, 0, number == signal.SIGTERM)
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


AT_A_TERMINAL = """
import os, signal, sys, time
sys.path.insert(0, sys.argv[1])
if sys.argv[2] == "nohup":
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
from rtctl.host.signals import Signals
signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGUSR1})
signals, report = Signals(), int(sys.argv[3])
os.write(report, b"ready ")
while not (signals.ends or signals.hangups):
    time.sleep(0.01)
os.write(report, b".")
signal.sigwait({signal.SIGUSR1})
os.write(report, f"{signals.ends} {signals.hangups}".encode())
os._exit(0)
"""


def counted(kind, hang_up):
    """What a program at a terminal of its own counts after `hang_up` of its terminal and process, and for the
    kind `twice` after another SIGHUP.
    """
    read, write = os.pipe()
    os.set_inheritable(write, True)
    pid, terminal = pty.fork()
    if pid == 0:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)  # whoever runs the tests may do so under nohup
        arguments = [sys.executable, "-c", AT_A_TERMINAL, str(Path.cwd()), kind, str(write)]
        os.execv(sys.executable, arguments)
    os.close(write)
    with os.fdopen(read) as report:
        assert os.read(read, 6) == b"ready "
        hang_up(terminal, pid)
        assert os.read(read, 1) == b"."
        if kind == "twice":
            os.kill(pid, signal.SIGHUP)
        os.kill(pid, signal.SIGUSR1)
        told = report.read()
    os.waitpid(pid, 0)
    return told


def test_a_terminal_that_is_gone_is_an_end_and_one_only():
    for kind in ("once", "twice"):  # kernel and shell may both send it
        assert counted(kind, lambda terminal, _pid: os.close(terminal)) == "1 0"


def test_a_hangup_while_the_terminal_is_there_and_one_under_nohup_are_none():
    assert counted("plain", lambda _terminal, pid: os.kill(pid, signal.SIGHUP)) == "0 1"
    assert counted("nohup", lambda terminal, _pid: os.close(terminal)) == "0 1"


def test_the_handlers_of_before_come_back():
    kinds = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.getsignal(number) for number in kinds]
    opened = sorted(Path("/proc/self/fd").iterdir())
    Signals().close()
    assert [signal.getsignal(number) for number in kinds] == before
    assert sorted(Path("/proc/self/fd").iterdir()) == opened
