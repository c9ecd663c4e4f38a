"""Start `hw.simulators.serial_board` as a child process and give it orders: for tests, demonstrations,
benchmarks.
"""

from __future__ import annotations

import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO, Self

from hw.simulators.serial_observation import Observation

PATIENCE_S = 150.0
"""Longest wait for an answer: a first start compiles."""


class SimulatedBoard:
    """A simulated board under `folder/"board"`, its motor on record in `folder/"observed"`.

    Parameters
    ----------
    folder
        Where its link and its record go.
    arguments
        More arguments of `python -m hw.simulators.serial_board`, for instance `"--step"`.
    popen
        Makes the child; `nursery.Program` does so for a test without 0.6 s of a core of imports.

    Attributes
    ----------
    port : str
        Path the host opens.
    """

    def __init__(
        self, folder: Path, *arguments: str, popen: Callable[..., subprocess.Popen[bytes]] = subprocess.Popen
    ) -> None:
        self.port = str(folder / "board")
        self._observed = folder / "observed"
        command = [sys.executable, "-m", "hw.simulators.serial_board", "--link", self.port, "--control"]
        self.process: subprocess.Popen[bytes] = popen(
            [*command, "--observe", str(self._observed), *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self._orders: IO[bytes] = self.process.stdin
        self._answers: IO[bytes] = self.process.stdout
        self._answer()
        self.observation = Observation.attach(self._observed)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def order(self, text: str) -> int:
        """Have an order carried out; returns the board cycle after it. ValueError for one it does not
        know.
        """
        self._orders.write(text.encode() + b"\n")
        self._orders.flush()
        answer = self._answer()
        if not answer.startswith("ok"):
            raise ValueError(answer)
        return int(answer.split()[1])

    def _answer(self) -> str:
        if not select.select([self._answers], [], [], PATIENCE_S)[0]:
            msg = f"the simulated board gave no answer within {PATIENCE_S:g} s"
            raise TimeoutError(msg)
        line = self._answers.readline().decode().strip()
        if not line:
            msg = f"the simulated board ended (status {self.process.wait(PATIENCE_S)})"
            raise ChildProcessError(msg)
        return line

    def wait_for(self, rows: int) -> None:
        """Wait until the motor's record has at least `rows` rows."""
        end = time.monotonic() + PATIENCE_S
        while self.observation.count < rows:
            if time.monotonic() > end:
                msg = f"the record has {self.observation.count} rows, {rows} were awaited"
                raise TimeoutError(msg)
            time.sleep(1e-3)

    def close(self) -> int:
        """End it; returns its exit status."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            status = self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            status = self.process.wait()
        self._orders.close()
        self._answers.close()
        return status
