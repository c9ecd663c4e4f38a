"""Lanes (`tests/integration/lanes.py`) whose boards are written in C, and standstills on them."""

import contextlib
import os
import resource
import signal
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from c_board import CBoard, build
from patience import PATIENCE_S, until

sys.path.insert(0, str(Path(__file__).parents[1] / "integration"))
from lanes import BOARD_HZ, TIME_TO_LIVE, Daemon, Lane

from rtctl.client import RigClient
from rtctl.control.vocabulary import State
from rtctl.errors import ClientError
from tests.bench.flood import memory_mb

LATE_CYCLES = 1
"""Of the board: its watchdog looks once in a cycle."""


def show(what):
    """A measurement, for whoever looks (`pytest -s`)."""
    sys.stdout.write(f"{what}\n")


def lanes_in_c(root, count):
    """Each with a board of its own, in C."""
    board = partial(CBoard, build(root), rate_hz=BOARD_HZ)
    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(lambda number: Lane(root, number, board), range(count)))


def armed(lane, nursery):
    """A daemon with torque, and a client of it; begun anew where the machine itself stood still meanwhile."""
    for _ in range(5):
        daemon, client = Daemon(lane, nursery), None
        try:
            client = lane.client(daemon)
            client.timeout_s = 5.0
            if lane.arm(client, "torque"):
                return daemon, client
        except (ClientError, AssertionError) as error:
            show(f"begun anew: {error}")
        if client is not None:
            client.close()
        with contextlib.suppress(ProcessLookupError):
            os.kill(daemon.pid, signal.SIGTERM)
        daemon.exit_code()
    raise AssertionError(f"{lane.name}: no torque in five lives: {daemon.said.read_text()}")


@dataclass
class Standstill:
    """What came of one, in ms from sending STOP: until the loop obeyed it, and until the motor was free for
    good.
    """

    what: str
    obeyed_ms: float
    free_ms: float
    state: str
    memory_mb: float
    torque_later: bool
    words: str
    seen: bool

    def __str__(self):
        return (
            f"{self.what}: zero torque begun after {'' if self.seen else 'at most '}{self.obeyed_ms:.1f} "
            f"ms, motor free after {self.free_ms:.0f} ms, then {self.state}, host {self.memory_mb:.0f} MB"
        )


class Stopper(threading.Thread):
    """Sends a STOP, whenever its answer may come."""

    def __init__(self, lane):
        super().__init__(daemon=True)
        self._lane, self.sent_ns = lane, 0
        self._client = RigClient(lane.name, runtime_dir=str(lane.runtime), timeout_s=PATIENCE_S)
        self._client.hello()

    def run(self):
        self.sent_ns = time.monotonic_ns()
        try:
            self._client.stop()
        except Exception as error:  # noqa: BLE001 - the daemon may end before it answers
            self.error = error
        finally:
            self._client.close()


def obeyed_ns(ticks, sent_ns, seconds):
    """Grid time of the first tick that is not ACTIVE any more after `sent_ns`; None where none is heard."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        batch = ticks.receive(0.5)
        if batch is None:
            continue
        found = (batch["state"] != State.ACTIVE) & (batch["time_ns"] >= sent_ns - 10_000_000)
        if found.any():
            return int(batch["time_ns"][np.argmax(found)])
    return None


def stand_still(lane, nursery, target, seconds):
    """Arm; halt a process, send STOP, let the process go on after `seconds`; and end the daemon."""
    daemon, client = armed(lane, nursery)
    halted = daemon.pid if target == "host" else daemon.loop()
    stopper = Stopper(lane)
    with client, client.ticks() as ticks:
        ticks.receive(PATIENCE_S)
        first = lane.observation.count
        os.kill(halted, signal.SIGSTOP)
        try:
            memory = memory_mb(daemon.pid)
            stopper.start()
            time.sleep(seconds)
        finally:
            with contextlib.suppress(ProcessLookupError):  # the host has ended a loop that stood still
                os.kill(halted, signal.SIGCONT)
        begun = obeyed_ns(ticks, stopper.sent_ns, 10.0 if target == "host" else 2.0)
    stopper.join(PATIENCE_S)
    return ended(
        lane, daemon, stopper.sent_ns, begun, first, f"SIGSTOP of the {target}, {seconds:g} s", memory
    )


def run_out_of_memory(lane, nursery):
    """Arm, leave neither host nor loop a page more than they have, ask for things, send STOP."""
    daemon, client = armed(lane, nursery)
    stopper = Stopper(lane)
    first, memory = lane.observation.count, memory_mb(daemon.pid)
    for pid in (daemon.loop(), daemon.pid):
        resource.prlimit(pid, resource.RLIMIT_AS, (1 << 20, resource.RLIM_INFINITY))
    client.timeout_s = 2.0
    with client, contextlib.suppress(ClientError):  # the host may end of it: then its loop stops the rig
        for _ in range(20):
            client.schema()
    stopper.start()
    stopper.join(PATIENCE_S)
    return ended(lane, daemon, stopper.sent_ns, None, first, "no memory left", memory)


def ended(lane, daemon, sent_ns, begun_ns, first, what, memory):
    """Wait until the motor is free, look on for a while, end the daemon, and tell what was seen."""
    until(lambda: not lane.newest()["torque_nm"].any(), "the end of the torque")
    free = lane.observation.count
    lane.board.wait_for(free + 12 * TIME_TO_LIVE)
    later = lane.rows(free)
    rows = lane.rows(first)
    driven = np.flatnonzero(rows["torque_nm"][:, 0])
    free_ms = 0.0 if not len(driven) else (rows["time_ns"][driven[-1]] - sent_ns) * 1e-6
    try:
        with RigClient(lane.name, runtime_dir=str(lane.runtime), timeout_s=1.0) as client:
            state = client.status()["state"]
        os.kill(daemon.pid, signal.SIGTERM)
    except Exception:  # noqa: BLE001 - it has ended by itself
        state = "ended"
    code = daemon.exit_code()
    free_ms = max(0.0, free_ms)  # it was free before the STOP
    if begun_ns is not None and (begun_ns - sent_ns) * 1e-6 > free_ms:
        begun_ns = None  # the ring had lost the ticks of that moment
    begun_ms = free_ms if begun_ns is None else min(free_ms, max(0.0, (begun_ns - sent_ns) * 1e-6))
    return Standstill(
        what,
        begun_ms,
        free_ms,
        f"{state}, exit {code}",
        memory,
        bool(later["torque_nm"].any()),
        daemon.said.read_text(),
        begun_ns is not None,
    )


@contextlib.contextmanager
def judged_lanes(root, count):
    """Lanes; in the end each board says whether torque ever stayed on for longer than its time to live."""
    lanes = lanes_in_c(root, count)
    try:
        yield lanes
    finally:
        judgements = [lane.board.close() for lane in lanes]
    for one in judgements:
        assert one["commands"] > 0
        assert one["longest_cycles"] <= TIME_TO_LIVE + LATE_CYCLES
    show(
        f"\nlongest torque without a fresh command: {max(one['longest_cycles'] for one in judgements)} "
        f"cycles, {max(one['longest_ns'] for one in judgements) * 1e-6:.0f} ms by the clock (time to live "
        f"{TIME_TO_LIVE} cycles)"
    )
