"""Rigs side by side for tests of dying daemons: a board of its own each, one daemon after the other on it."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from nursery import Program
from simulated_board import SimulatedBoard

from rtctl.client import RigClient
from rtctl.errors import ClientError
from rtctl.host.exchange.force_zero import NAME as ZERO
from rtctl.recording.state_folder import state_folder

CONFIGS = Path(__file__).parents[2] / "configs"
SEED = 4
BOARD_HZ = 200
TIME_TO_LIVE = 10
PATIENCE_S = 60.0
SHORTLY = f"import sys; sys.path.append({str(Path(__file__).parent)!r}); import lives; lives.live_shortly()"
ARMING_CYCLES = 4000
"""Board cycles after which a life goes on unarmed, 20 s."""


@dataclass
class Death:
    """One life and its end: what was planned, and what was seen."""

    number: int
    target: str
    signal: signal.Signals
    phase: str
    delay_rows: int
    rows: np.ndarray = field(default_factory=lambda: np.zeros(0))
    unarmed: np.ndarray = field(default_factory=lambda: np.zeros(0))
    after: np.ndarray = field(default_factory=lambda: np.zeros(0))
    first_state: str = ""
    had_torque: bool = False
    code: int | None = None
    words: str = ""

    def __str__(self):
        return (
            f"seed {SEED}, life {self.number}: {self.signal.name} to the {self.target}, {self.phase} + "
            f"{self.delay_rows}"
        )


def rig_file(folder, name, port, realtime):
    text = (CONFIGS / "serial.toml").read_text()
    for shipped, here in (
        ('"/tmp/rtctl-board"', f'"{port}"'),
        ('name = "serial"', f'name = "{name}"'),
        ("rate_hz = 1000.0", "rate_hz = 100.0"),
        ('realtime = "prefer"', f'realtime = "{realtime}"'),  # a quarter of the torque; see lives.py
        ("stiffness_nm_rad = 10.0", "stiffness_nm_rad = 0.5"),
        ("center_rad = 0.0", "center_rad = 0.5"),
        ("time_to_live_cycles = 20", f"time_to_live_cycles = {TIME_TO_LIVE}"),
    ):
        assert text.count(shipped) == 1, shipped
        text = text.replace(shipped, here)
    path = folder / f"{name}-{realtime}.toml"
    path.write_text(text)
    return path


def until(condition, what):
    end = time.monotonic() + PATIENCE_S
    while not (value := condition()):
        assert time.monotonic() < end, f"in vain waited for {what}"
        time.sleep(0.02)
    return value


def is_gone(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] in "ZX"
    except OSError:
        return True


def children(pid):
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


class Daemon:
    """A running daemon: born in the nursery as a short-lived one (`lives.py`), or started as `rtctl run`."""

    def __init__(self, lane, nursery):
        self.said = lane.folder / "said"
        # the board's hand pulls while a life is tared: by the last one's zero it would not be armed
        (state_folder(lane.name) / ZERO).unlink(missing_ok=True)
        config = lane.config_with_rights if nursery is None else lane.config
        command = [sys.executable, "-m", "rtctl", "run", config, "--json", "--runtime-dir", lane.runtime]
        with self.said.open("w") as out:
            self.process = (
                subprocess.Popen(command, stdout=out, stderr=out)
                if nursery is None
                else Program(command, stdout=out, stderr=out, nursery=nursery, first=SHORTLY)
            )
        self.pid = self.process.pid

    def loop(self):
        found = children(self.pid)
        assert len(found) == 1, f"{found}: {self.said.read_text()}"
        return found[0]

    def exit_code(self):
        """Waits for its end."""
        return self.process.wait(PATIENCE_S)


def simulated(folder):
    """A board that runs the reference firmware."""
    return SimulatedBoard(
        folder, "--rig", str(CONFIGS / "mock.toml"), "--rate-hz", str(BOARD_HZ), popen=Program
    )


class Lane:
    """One board, made by `board(folder)`, and one daemon after the other on it."""

    def __init__(self, root, number, board=simulated):
        self.folder = root / f"lane{number}"
        self.runtime = self.folder / "run"
        self.runtime.mkdir(mode=0o700, parents=True)
        self.name = f"lane{number}"
        self.board = board(self.folder)
        with contextlib.suppress(PermissionError):  # a board is punctual; nothing is judged by it
            os.sched_setscheduler(self.board.process.pid, os.SCHED_FIFO, os.sched_param(5))
        self.config = rig_file(self.folder, self.name, self.board.port, "off")
        self.config_with_rights = rig_file(self.folder, self.name, self.board.port, "waive")
        self.observation = self.board.observation

    def rows(self, first, last=None):
        """Rows by their number since the board's start; those the ring has lost are left out."""
        count, rows = self.observation.count, self.observation.rows()
        lost = max(count - len(rows), 0)
        return rows[max(first - lost, 0) : None if last is None else last - lost]

    def newest(self):
        rows = self.observation._rows  # one row, not a copy of all
        return rows[(self.observation.count - 1) % len(rows)].copy()

    def client(self, daemon):
        """Connected, once the daemon answers."""
        made = RigClient(self.name, runtime_dir=str(self.runtime), timeout_s=PATIENCE_S)
        try:
            made.hello()
        except ClientError as error:
            made.close()
            raise AssertionError(f"{self.name}: {error}; {daemon.said.read_text()}") from error
        return made

    def live(self, death, nursery):
        """A life up to its end; begun anew when the machine stood still so long that the host ended it
        before.
        """
        for _ in range(5):
            first = self.observation.count
            daemon = Daemon(self, nursery)
            try:
                loop = self.begin(daemon, death, first)
            except (ProcessLookupError, ClientError, AssertionError):
                daemon.exit_code()  # the host says why it ended a loop after that, and only then
                if "stopped advancing" not in daemon.said.read_text():
                    raise
            else:
                return self.end(daemon, loop, death, first)
        raise AssertionError(f"{death}: five stalls in a row")

    def begin(self, daemon, death, first):
        """Up to the signal; returns the loop's process."""
        client = self.client(daemon)
        try:
            loop = daemon.loop()
            death.first_state = client.status()["state"]
            death.unarmed = self.rows(first)
            if death.phase != "idle":
                self.arm(client, death.phase)
            self.board.wait_for(self.observation.count + death.delay_rows)
            death.had_torque = bool(self.newest()["torque_nm"].any())
            os.kill(loop if death.target == "loop" else daemon.pid, death.signal)
        finally:
            client.close()
        return loop

    def end(self, daemon, loop, death, first):
        """From the signal on, until the board has long heard nothing."""
        if death.target == "host" and death.signal == signal.SIGSTOP:
            self.board.wait_for(self.observation.count + 4 * TIME_TO_LIVE)
            os.kill(daemon.pid, signal.SIGKILL)  # as systemd's watchdog does
        death.code = daemon.exit_code()
        until(lambda: is_gone(loop), f"the end of loop {loop}")
        gone = self.observation.count
        self.board.wait_for(gone + 3 * TIME_TO_LIVE)
        death.rows, death.after = self.rows(first), self.rows(gone + TIME_TO_LIVE + 2)
        death.words = daemon.said.read_text()
        return death

    def arm(self, client, phase):
        """Ask until the board is enabled, and has torque where that is wanted. False after a fault.

        On a busy machine late ticks may stop a rig that is just starting; that one dies as it is.
        """
        last = self.observation.count + ARMING_CYCLES

        def reached():
            state = client.status()["state"]
            if state == "IDLE":
                with contextlib.suppress(ClientError):
                    client.arm(wait=False)
            if phase == "arming" and self.newest()["enabled"]:
                return "enabled"
            torque = state == "ACTIVE" and self.newest()["torque_nm"].any()
            in_vain = state in ("FAULT", "LOCKOUT") or self.observation.count > last
            return torque or (in_vain and "fault")

        return until(reached, f"{self.name}: {phase}") != "fault"

    def armed(self, nursery):
        """A daemon with torque at work, and a client of it."""
        for _ in range(10):
            daemon = Daemon(self, nursery)
            client = self.client(daemon)
            if self.arm(client, "torque"):
                return daemon, client
            client.close()
            os.kill(daemon.pid, signal.SIGTERM)
            daemon.exit_code()
        raise AssertionError(f"{self.name}: no torque in ten lives: {daemon.said.read_text()}")

    def close(self):
        self.board.close()
