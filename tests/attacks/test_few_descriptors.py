"""A host that may open few files: a crowd that opens connections as fast as it can does not end it, and a
STOP arrives.
"""

import contextlib
import resource
import tempfile
import time

import pytest
from besieged import Daemon
from patience import PATIENCE_S, until
from test_strangers import MOST_MS

from rtctl.client import RigClient
from tests.bench.attacks import Attack, address_of, at_work, stop_ms

pytestmark = pytest.mark.compiled

FEW, PROCESSES, SECONDS = 512, 3, 2.0


def allow_few():
    resource.setrlimit(resource.RLIMIT_NOFILE, (FEW, FEW))


def test_a_crowd_at_a_host_that_may_open_few_files_neither_ends_it_nor_delays_a_stop():
    with (
        tempfile.TemporaryDirectory(prefix="rt") as folder,
        Daemon(folder, preexec_fn=allow_few) as daemon,
        contextlib.ExitStack() as crowd,
    ):
        where = address_of("command", daemon.client, daemon.port)
        crowds = [
            crowd.enter_context(at_work(Attack("connects", "command"), where)) for _ in range(PROCESSES)
        ]
        assert stop_ms(daemon.client, lambda: [begin() for begin in crowds]) < MOST_MS
        end = time.monotonic() + SECONDS
        while time.monotonic() < end:
            assert daemon.process.poll() is None, "libzmq has ended it"
            assert daemon.descriptors() < FEW
        crowd.close()
        until(lambda: daemon.client.status()["state"] == "IDLE", "the end of the ramp")
        with RigClient("mock", runtime_dir=daemon.folder, timeout_s=PATIENCE_S) as another:
            assert another.status()["state"] == "IDLE"
