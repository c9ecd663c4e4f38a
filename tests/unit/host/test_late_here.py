"""Who ran on a core of this machine, and who has ended on it."""

import os
import subprocess
import sys
import time
from pathlib import Path

from patience import until

from rtctl.host.exchange.late_tasks import Tasks


def test_the_task_that_ran_on_the_core_is_named():
    """Of this machine: a child that computes, and is asked for by the core it is on."""
    child = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        tasks = Tasks(os.getpid())

        def told():
            with Path(f"/proc/{child.pid}/stat").open() as file:
                core = int(file.read().rpartition(")")[2].split()[36])
            tasks.look(core, 0, everywhere=True)
            found = tasks.ran(core, 0, 0, time.monotonic_ns())
            return any(one.name.endswith(f" {child.pid}") for one in found)

        assert until(told)
    finally:
        child.kill()
        child.wait()
