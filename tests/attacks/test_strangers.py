"""Whatever strangers do, and whoever does not listen: a STOP arrives, the end comes, and memory stays
bounded.

One daemon bears it all, with its terminal stopped by Ctrl-S and a pipe for its errors that nobody reads.
"""

import fcntl
import os
import pty
import signal
import sys
import tempfile
import time

import pytest
import zmq
from besieged import Daemon
from patience import PATIENCE_S, until

from rtctl.client import RigClient
from rtctl.client.connection import Connection, remote_endpoints
from rtctl.host.heartbeat import LENIENT_S
from rtctl.wire.keys import ClientKey
from tests.bench.attacks import ATTACKS, MOST_MB, Attack, address_of, at_work, stop_ms

pytestmark = pytest.mark.compiled

MOST_MS = 5000.0
"""A bound on a shared machine; `rtctl bench attacks` measures (250 ms is the aim)."""

LONG_S = 3.0
"""By then a message without an end would have taken more memory than is allowed."""

RELOADS = 60
"""Each makes the daemon say a line; the pipe and the terminal hold fewer."""


@pytest.fixture(scope="module")
def daemon():
    master, slave = pty.openpty()
    read, write = os.pipe()
    fcntl.fcntl(write, fcntl.F_SETPIPE_SZ, 4096)
    streams = {"stdin": slave, "stdout": slave, "stderr": write}
    with tempfile.TemporaryDirectory(prefix="rt") as folder, Daemon(folder, **streams) as made:
        os.write(master, b"\x13")
        yield made
    for fd in (master, slave, read, write):
        os.close(fd)


def shown(what, ms):
    """A measurement, for whoever looks (`pytest -s`)."""
    sys.stdout.write(f"STOP under {what}: {ms:.1f} ms\n")
    return ms


def make_it_talk(daemon):
    for _ in range(RELOADS):
        os.kill(daemon.process.pid, signal.SIGHUP)
        time.sleep(0.005)


def test_words_that_nobody_hears_keep_no_stop_from_the_rig(daemon):
    assert stop_ms(daemon.client, lambda: make_it_talk(daemon)) < MOST_MS
    make_it_talk(daemon)
    assert daemon.client.status()["state"] in ("STOPPING", "IDLE")


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.name)
def test_an_attack_neither_delays_a_stop_nor_takes_memory_nor_keeps_others_out(daemon, attack):
    where = address_of(attack.door, daemon.client, daemon.port)
    with at_work(attack, where, daemon.key) as begin:
        assert shown(attack.name, stop_ms(daemon.client, begin)) < MOST_MS
        with RigClient("mock", runtime_dir=daemon.folder, timeout_s=PATIENCE_S) as another:
            another.stop()
        with RigClient(address=f"127.0.0.1:{daemon.port}", key=daemon.key, timeout_s=PATIENCE_S) as with_key:
            with_key.stop()
        if attack.kind == "unfinished" and attack.door in ("command", "viewer"):
            time.sleep(LONG_S)
        assert daemon.descriptors() < 4000
    assert daemon.memory_mb() < MOST_MB


@pytest.mark.parametrize("kind", ["identities", "half"])
def test_one_process_that_takes_every_place_keeps_no_stop_of_another_one_out(daemon, kind):
    with at_work(Attack(kind, "command"), address_of("command", daemon.client, daemon.port)) as begin:
        begin()
        time.sleep(0.5)  # by then all sixteen places were gone, twenty times over
        for _ in range(3):
            with RigClient("mock", runtime_dir=daemon.folder, timeout_s=10.0) as another:
                assert stop_ms(another, lambda: None) < 1e4, (
                    "and not after the 18 s that the crowd held the door"
                )


def test_a_client_with_a_key_that_sends_millions_of_frames_does_not_delay_another_ones_stop(daemon):
    greedy = ClientKey.load(daemon.store.new("greedy", "observer", daemon.folder / "greedy.key"))
    where = remote_endpoints(f"127.0.0.1:{daemon.port}")
    with zmq.Context() as context:
        dealer = Connection(context, where, greedy).socket(zmq.DEALER, where.command, {})

        def send():
            for _ in range(2):
                for _ in range(300_000):
                    dealer.send(b"", zmq.SNDMORE)
                dealer.send(b"")

        with RigClient(address=f"127.0.0.1:{daemon.port}", key=daemon.key, timeout_s=PATIENCE_S) as operator:
            assert stop_ms(operator, send) < MOST_MS
        dealer.close(linger=0)
    assert daemon.memory_mb() < MOST_MB


def test_a_key_that_is_a_link_to_itself_and_a_fifo_among_the_keys_change_nothing(daemon):
    clients = daemon.store.folder / "clients"
    (clients / "loop.key").symlink_to("loop.key")
    os.mkfifo(clients / "pipe.key")
    made = daemon.store.new("late", "observer", daemon.folder / "late.key")  # the folder is read again
    with RigClient(address=f"127.0.0.1:{daemon.port}", key=made, timeout_s=PATIENCE_S) as late:
        assert late.hello()["role"] == "observer"
    assert daemon.client.status()["state"] in ("STOPPING", "IDLE")


def test_a_daemon_that_was_stopped_from_a_terminal_has_stopped_its_rig(daemon):
    """Ctrl-Z, SIGSTOP, a debugger: the loop runs on, at real-time priority if it has it, and ends the
    motion.
    """
    until(lambda: daemon.client.status()["state"] == "IDLE", "the end of the ramp")
    with daemon.client.events() as events:
        daemon.client.arm(timeout_s=PATIENCE_S)
        until(lambda: (events.receive(1.0) or {}).get("to") == "ACTIVE", "the event")
        os.kill(daemon.process.pid, signal.SIGSTOP)
        time.sleep(LENIENT_S + 0.5)
        os.kill(daemon.process.pid, signal.SIGCONT)
        until(lambda: (events.receive(1.0) or {}).get("name") == "HOST_SILENT", "the event")
    until(lambda: daemon.client.status()["state"] == "IDLE", "the end of the ramp")


def test_after_all_that_it_ends_when_asked(daemon):
    make_it_talk(daemon)
    daemon.process.terminate()
    assert daemon.process.wait(PATIENCE_S) == 0
