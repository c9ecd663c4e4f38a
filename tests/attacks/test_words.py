"""Nobody listens to what the daemon says: a terminal stopped by Ctrl-S, a pipe that is not read."""

import fcntl
import os
import pty
import signal
import tempfile
import time

import pytest
from besieged import Daemon

pytestmark = pytest.mark.compiled

RELOADS = 120
"""Each makes the daemon say a line; the pipe and the terminal hold fewer."""


def say_much(daemon):
    for _ in range(RELOADS):
        os.kill(daemon.process.pid, signal.SIGHUP)
        time.sleep(0.01)


def still_serves(daemon):
    """Status, STOP and SIGTERM are answered; the times are printed, not judged."""
    daemon.arm()
    say_much(daemon)
    print(f"STOP obeyed after {daemon.obeys_a_stop():.1f} ms")
    say_much(daemon)
    assert daemon.client.status()["state"] in ("STOPPING", "IDLE")
    began = time.monotonic()
    daemon.process.terminate()
    assert daemon.process.wait(30.0) == 0
    print(f"SIGTERM obeyed after {time.monotonic() - began:.2f} s")


def test_a_pipe_that_nobody_reads_keeps_no_stop_and_no_end_from_the_daemon():
    read, write = os.pipe()
    fcntl.fcntl(write, fcntl.F_SETPIPE_SZ, 4096)
    with tempfile.TemporaryDirectory(prefix="rt") as folder, Daemon(folder, stderr=write) as daemon:
        still_serves(daemon)
    os.close(read)
    os.close(write)


def test_a_terminal_stopped_by_ctrl_s_keeps_no_stop_and_no_end_from_the_daemon():
    master, slave = pty.openpty()
    streams = {"stdin": slave, "stderr": slave, "stdout": slave}
    with tempfile.TemporaryDirectory(prefix="rt") as folder, Daemon(folder, **streams) as daemon:
        os.write(master, b"\x13")
        still_serves(daemon)
    os.close(master)
    os.close(slave)
