"""The judge of `board.c` as a process: what `tests/simulated_board.py` is, in another language."""

import contextlib
import json
import os
import shutil
import signal
import subprocess
from pathlib import Path

import pytest
from patience import PATIENCE_S, until

from hw.simulators.serial_observation import Observation

SOURCE = Path(__file__).with_name("board.c")


def compiled(source, made, *options):
    """Compile `source` into the file `made`. Skips the test where there is no compiler."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    command = [compiler, "-std=c11", "-O2", "-Wall", "-Wextra", "-Werror", "-o", made, source, *options]
    subprocess.run(command, check=True, timeout=PATIENCE_S)
    return made


def build(folder):
    """Compile the board. Skips the test where there is no compiler."""
    return compiled(SOURCE, folder / "board-in-c", "-lm")


class CBoard:
    """A board in C under `folder/"board"`, with its motor on record. `judgement` is there once it was
    closed.
    """

    def __init__(self, program, folder, rate_hz):
        self.port, observed = str(folder / "board"), folder / "observed"
        self.process = subprocess.Popen(
            [str(program), self.port, str(observed), str(rate_hz)], stdout=subprocess.PIPE, text=True
        )
        assert self.process.stdout.readline() == "ready\n"
        self.observation = Observation.attach(observed)
        self.judgement = None

    def be_punctual(self, priority):
        """At real-time priority, where that is allowed."""
        with contextlib.suppress(PermissionError):
            os.sched_setscheduler(self.process.pid, os.SCHED_FIFO, os.sched_param(priority))

    def wait_for(self, rows):
        """Wait until the motor's record has at least `rows` rows."""
        until(lambda: self.observation.count >= rows, f"{rows} rows")

    def close(self):
        """End it, and have its judgement."""
        if self.judgement is None:
            self.process.send_signal(signal.SIGTERM)
            said, _ = self.process.communicate(timeout=PATIENCE_S)
            self.judgement = json.loads(said)
        return self.judgement
