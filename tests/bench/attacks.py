"""STOP under attack: from sending it to the tick from which on the torque goes to zero, and the host's
memory.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rtctl.client import RigClient
from rtctl.control.vocabulary import State
from rtctl.errors import RtctlError
from rtctl.rig_file.config import load
from rtctl.wire.keys import ClientKey
from tests.bench.child import START_S
from tests.bench.flood import daemon_on_loopback, memory_mb
from tests.bench.row import Row

MOST_STOP_MS = 250.0
MOST_MB = 300.0
PATIENCE_S = 60.0


@dataclass(frozen=True)
class Attack:
    """A kind of `tests.bench.attacker`, and against which door: an ipc socket by name, `keys` or `viewer`."""

    kind: str
    door: str
    socket_type: str = "DEALER"

    @property
    def name(self) -> str:
        """For a person."""
        return f"{self.kind} at {self.door}"


ATTACKS = (
    Attack("frames", "command"),
    Attack("unfinished", "command"),
    Attack("unfinished", "targets"),
    Attack("unfinished", "telemetry", "SUB"),
    Attack("frames", "viewer", "SUB"),
    Attack("unfinished", "viewer", "SUB"),
    Attack("trickle", "viewer", "SUB"),
    Attack("connects", "command"),
    Attack("connects", "viewer"),
    Attack("connects", "keys"),
    Attack("raw", "command"),
    Attack("raw", "keys"),
    Attack("unknown", "keys"),
    Attack("half", "command"),
    Attack("half", "keys"),
    Attack("half", "viewer"),
    Attack("lies", "command"),
    Attack("lies", "viewer", "SUB"),
    Attack("identities", "command"),
    Attack("epochs", "command"),
    Attack("epochs", "targets"),
)


def rows(config: Path, stops: int) -> Iterator[Row]:
    """A row for each attack, on a daemon of its own, with `stops` times STOP; then the most memory a host
    took.
    """
    calm_mb, most_mb = 0.0, 0.0
    for attack in ATTACKS:
        with (
            daemon_on_loopback(config, viewer=True) as (process, folder, key, port),
            RigClient(load(config).config.rig.name, runtime_dir=folder, timeout_s=START_S) as rig,
        ):
            rig.hello()
            rig.timeout_s = PATIENCE_S
            calm_ms, calm_mb = float(np.median(stops_ms(rig, stops))), max(calm_mb, memory_mb(process.pid))
            with at_work(attack, address_of(attack.door, rig, port), key) as begin:
                found = stops_ms(rig, stops, begin)
            most_mb = max(most_mb, memory_mb(process.pid))
        text = f"median {np.median(found):.1f} ms of {stops}, quiet {calm_ms:.1f} ms"
        yield Row(f"stop under {attack.name}: slowest", max(found), "ms", text, MOST_STOP_MS)
    yield Row("memory of the host under attack", most_mb, "MB", f"before {calm_mb:.0f} MB", MOST_MB)


def address_of(door: str, rig: RigClient, port: int) -> str:
    """Where an attack goes to."""
    if door in ("keys", "viewer"):
        return f"tcp://127.0.0.1:{port if door == 'keys' else port + 3}"
    return str(getattr(rig.endpoints, door))


@contextmanager
def at_work(attack: Attack, address: str, key: Path | None = None) -> Iterator[Callable[[], object]]:
    """An attacker in a process of its own, which waits for the call of what this gives, and is at work when
    that returns.

    `key` is the file of any client's key, for those who shake hands by keys: the daemon's public one is in
    it.
    """
    how = attack.socket_type
    if attack.kind == "unknown" and key is not None:
        how = ClientKey.load(key).server_key
    command = [sys.executable, "-m", "tests.bench.attacker", attack.kind, address, "600", how]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert process.stdin is not None
    assert process.stdout is not None
    told, heard = process.stdin, process.stdout

    def begin() -> None:
        if not told.closed:
            told.close()
            heard.readline()

    try:
        yield begin
    finally:
        process.kill()
        process.wait()
        told.close()
        heard.close()


def stops_ms(rig: RigClient, stops: int, begin: Callable[[], object] = lambda: None) -> list[float]:
    """Arm and stop so many times; milliseconds from sending each STOP to the first tick that obeys.

    `begin` is called before each STOP: the first one meets an attack that has only begun, the others one that
    is known.
    """
    return [stop_ms(rig, begin) for _ in range(stops)]


def stop_ms(rig: RigClient, begin: Callable[[], object]) -> float:
    """Arm, stop, and look when the loop obeyed, ms. Raises RtctlError."""
    end = time.monotonic() + PATIENCE_S
    while (state := rig.status()["state"]) == State.STOPPING.name and time.monotonic() < end:
        time.sleep(0.01)
    if state != State.IDLE.name:
        rig.reset(timeout_s=PATIENCE_S)
    rig.arm(timeout_s=PATIENCE_S)
    with rig.ticks() as ticks:
        ticks.receive(PATIENCE_S)
        begin()
        sent_ns = time.monotonic_ns()
        rig.stop()
        while time.monotonic() < end:
            batch = ticks.receive(1.0)
            if batch is None:
                continue
            obeyed = (batch["state"] != State.ACTIVE) & (batch["time_ns"] + batch["wakeup_ns"] >= sent_ns)
            if obeyed.any():
                return max(0.0, (int(batch["time_ns"][np.argmax(obeyed)]) - sent_ns) / 1e6)
    raise RtctlError("a STOP was not obeyed")
