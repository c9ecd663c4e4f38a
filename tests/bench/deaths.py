"""How soon a board is torque-free after its loop died: `rtctl run` against the simulated board, killed again
and again.

The board's own time to live is set far beyond what the supervisor should need, so that what is measured is
the supervisor; that the time to live held is checked on the same rows.
"""

from __future__ import annotations

import math
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rtctl.client import RigClient
from rtctl.errors import ClientError, RtctlError
from rtctl.rig_file.config import load
from tests.bench.row import Row, in_turns
from tests.simulated_board import SimulatedBoard

TARGET_MS = 15.0
BOARD_HZ = 1000
TIME_TO_LIVE_CYCLES = 50
RATE_HZ = 200.0  # the time to live is 10 periods: more is refused, and 10 ms end too soon on a busy machine
SIGNALS = (signal.SIGKILL, signal.SIGSEGV)
PATIENCE_S, LOOK_S = 60.0, 0.02
MOST_LOST = 10
MOST_DELAY_S = 0.05
"""Random time under torque before the signal: some fifty phases of the loop and of the host's batches."""


@dataclass(frozen=True)
class Death:
    """One kill: ms until the motor was without torque for good, and the longest silence under torque, board
    cycles.
    """

    free_ms: float
    silent_cycles: int


def rows(
    config: Path, board_rig: Path, kills: int, say: Callable[[str], None] = lambda _text: None
) -> Iterator[Row]:
    """Kill the loop `kills` times under torque, SIGKILL and SIGSEGV in turn, at random phases.

    Parameters
    ----------
    config
        Rig file of a serial board (configs/serial.toml).
    board_rig
        Rig file of the axis that the simulated board drives (configs/mock.toml).
    kills
        How often.
    say
        Receives one line per death.
    """
    deaths: list[Death] = []
    return in_turns(_turns(config, board_rig, kills, deaths, say), lambda: _rows(deaths))


def _turns(
    config: Path, board_rig: Path, kills: int, deaths: list[Death], say: Callable[[str], None]
) -> Iterator[None]:
    draw, lost = random.Random(1), 0
    with tempfile.TemporaryDirectory(prefix="rtctl-") as folder:
        root = Path(folder)
        with SimulatedBoard(
            root, "--rig", str(board_alone(board_rig, root)), "--rate-hz", str(BOARD_HZ)
        ) as board:
            with suppress(PermissionError):
                os.sched_setscheduler(board.process.pid, os.SCHED_FIFO, os.sched_param(5))
            rig = rig_file(config, root, board.port)
            while len(deaths) < kills and lost < kills + MOST_LOST:
                death = _die(board, rig, root, SIGNALS[len(deaths) % 2], draw.uniform(0.0, MOST_DELAY_S))
                if death is None:
                    lost += 1
                    say(f"a life ended before its death, {lost} so far")
                    continue
                deaths.append(death)
                say(f"death {len(deaths)} of {kills}: torque-free after {death.free_ms:.1f} ms")
                yield
    if len(deaths) < kills:
        msg = f"{lost} daemons ended before they had torque; is the machine busy?"
        raise RtctlError(msg)


def _rows(deaths: list[Death]) -> list[Row]:
    """Of all deaths."""
    free_ms = np.array([death.free_ms for death in deaths])
    silent = max(death.silent_cycles for death in deaths)
    most_ms, all_ms = np.percentile(free_ms, 95), free_ms.max()
    spread = f"{len(deaths)} deaths, 95 % within {most_ms:.1f} ms, all within {all_ms:.1f} ms"
    held = f"time to live {TIME_TO_LIVE_CYCLES} cycles of the board at {BOARD_HZ} Hz"
    return [
        Row("loop death to zero torque, median", float(np.median(free_ms)), "ms", spread, TARGET_MS),
        Row("longest silence under torque", float(silent), "cycles", held, TIME_TO_LIVE_CYCLES + 1.0),
    ]


def board_alone(config: Path, folder: Path) -> Path:
    """Nobody holds the joint: a hand on it while a daemon tares is one that the next may not take for
    zero.
    """
    return _changed(config, folder / "board.toml", (('kind = "sine"', 'kind = "none"'),))


def rig_file(config: Path, folder: Path, port: str) -> Path:
    """A rig whose torque lasts, on the board at `port`."""
    changes = (
        ('"/tmp/rtctl-board"', f'"{port}"'),
        ("time_to_live_cycles = 20", f"time_to_live_cycles = {TIME_TO_LIVE_CYCLES}"),
        ("center_rad = 0.0", "center_rad = 0.5"),  # so that there is torque at rest
        ("rate_hz = 1000.0", f"rate_hz = {RATE_HZ}"),
        ("stiffness_nm_rad = 10.0", "stiffness_nm_rad = 2.0"),  # what the check lets pass at that rate
    )
    return _changed(config, folder / "rig.toml", changes)


def _changed(config: Path, path: Path, changes: Sequence[tuple[str, str]]) -> Path:
    """The rig file `path`: `config` with `changes`, each of which applies once."""
    text = config.read_text()
    for shipped, here in changes:
        if text.count(shipped) != 1:
            msg = f"{config}: {shipped!r} is not there once"
            raise RtctlError(msg)
        text = text.replace(shipped, here)
    path.write_text(text)
    load(path)
    return path


def _die(board: SimulatedBoard, rig: Path, folder: Path, number: int, delay_s: float) -> Death | None:
    """Start a daemon, wait for torque, end its loop; what the board saw. None when it ended by itself
    before.
    """
    command = [sys.executable, "-m", "rtctl", "run", str(rig), "--json", "--runtime-dir", str(folder)]
    first = board.observation.count
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as daemon:
        try:
            if not _has_torque(board, daemon, folder):
                return None
            time.sleep(delay_s)
            loop = int(Path(f"/proc/{daemon.pid}/task/{daemon.pid}/children").read_text().split()[0])
            _leave_its_core(board.process.pid, loop)
            killed_ns = time.monotonic_ns()
            os.kill(loop, number)
            daemon.communicate(timeout=PATIENCE_S)
        finally:
            daemon.kill()
    board.wait_for(board.observation.count + TIME_TO_LIVE_CYCLES + 2)
    seen = board.observation.rows()
    seen = seen[max(0, len(seen) - (board.observation.count - first)) :]
    driven = np.any(seen["torque_nm"] != 0.0, axis=1)
    if not driven[int(np.searchsorted(seen["time_ns"], killed_ns)) - 1]:
        return None
    free = int(np.flatnonzero(driven)[-1]) + 1
    free_ms = (seen["time_ns"][free] - killed_ns) / 1e6 if free < len(seen) else math.inf
    return Death(float(free_ms), int(_silence(seen)[driven].max()))


def _leave_its_core(board: int, loop: int) -> None:
    """Have the board run on the other cores: the kernel takes a loop apart for 10 to 30 ms, at its priority
    and on its core, and no real board stands still meanwhile."""
    if others := os.sched_getaffinity(0) - os.sched_getaffinity(loop):
        os.sched_setaffinity(board, others)


def _silence(seen: np.ndarray) -> np.ndarray:
    """Board cycles since the last command came, at each row."""
    fresh = np.ones(len(seen), bool)
    fresh[1:] = np.diff(seen["command_sequence"]) != 0
    return np.asarray(seen["slot"] - np.maximum.accumulate(np.where(fresh, seen["slot"], 0)))


def _has_torque(board: SimulatedBoard, daemon: subprocess.Popen[str], folder: Path) -> bool:
    """Arm until the motor has torque. False when the daemon has ended, as one does whose machine stood
    still.
    """
    end, why = time.monotonic() + PATIENCE_S, ""
    with RigClient("serial", runtime_dir=str(folder), timeout_s=1.0) as client:
        while time.monotonic() < end:
            time.sleep(LOOK_S)  # fewer requests than the gateway allows
            try:
                state = client.status()["state"]
                if state == "ACTIVE" and np.any(board.observation.rows()[-1]["torque_nm"] != 0.0):
                    return True
                if state == "IDLE":
                    client.arm(wait=False)
                elif state == "FAULT":
                    client.reset()
            except ClientError as error:
                why = f": {error}"
            if daemon.poll() is not None:
                return False
    msg = f"no torque within {PATIENCE_S:g} s{why}"
    raise RtctlError(msg)
