"""The daemon under floods: the loop beside a quiet run of the same daemon, STOP, memory, targets,
connecting.
"""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rtctl.client import RigClient
from rtctl.errors import RtctlError
from rtctl.rig_file.config import load
from rtctl.wire.keys import KeyStore
from tests.bench.child import START_S, daemon
from tests.bench.flooder import CONNECTIONS, RATE_HZ
from tests.bench.row import Row, in_turns

SETTLE_S = 0.5
STOP_PERIOD_S = 0.1
AFTERWARDS_S = 0.005
"""After a target, before the ticks are looked at."""
CONNECT_PERIOD_S = 0.25
"""Between two clients that connect: the daemon counts one that has gone for some seconds more."""


@dataclass
class Sample:
    """What the loop did over some seconds, and how soon stops were obeyed."""

    wakeup_ns: list[np.ndarray] = field(default_factory=list)
    cycle_ns: list[np.ndarray] = field(default_factory=list)
    stop_s: list[float] = field(default_factory=list)

    def p99_us(self, name: str) -> float:
        """99th percentile of `wakeup_ns` or `cycle_ns`, us."""
        return float(np.percentile(np.concatenate(getattr(self, name)), 99)) / 1e3


KINDS = ("junk", "valid", "targets")


@dataclass
class Found:
    """What is known by now of one daemon, quiet and under each kind of flood."""

    quiet: Sample = field(default_factory=Sample)
    floods: dict[str, Sample] = field(default_factory=lambda: {kind: Sample() for kind in KINDS})
    taken_per_s: dict[str, list[float]] = field(default_factory=lambda: {kind: [] for kind in KINDS})
    idle_mb: float = float("nan")
    flooded_mb: float = float("nan")
    latency_us: np.ndarray = field(default_factory=lambda: np.zeros(0))
    alone_ms: list[float] = field(default_factory=list)
    crowded_ms: list[float] = field(default_factory=list)


def rows(config: Path, seconds: float, rounds: int) -> Iterator[Row]:
    """Quiet and flooded in turn, `rounds` times `seconds` each; then targets, and connections."""
    period_us = 1e6 / load(config).config.loop.rate_hz
    found = Found()
    return in_turns(_turns(config, seconds, rounds, found), lambda: _rows(found, period_us))


def _turns(config: Path, seconds: float, rounds: int, found: Found) -> Iterator[None]:
    with (
        daemon_on_loopback(config) as (process, folder, key, port),
        RigClient(_rig(config), runtime_dir=folder) as rig,
    ):
        rig.timeout_s = START_S
        rig.hello()
        found.idle_mb = memory_mb(process.pid)
        for _ in range(rounds):
            _measure(rig, found.quiet, seconds)
            for kind, sample in found.floods.items():
                address = rig.endpoints.targets if kind == "targets" else rig.endpoints.command
                with flooding(kind, address, seconds + 2 * SETTLE_S) as flooder:
                    _measure(rig, sample, seconds)
                    counts = json.loads(flooder.communicate(timeout=60)[0])
                    found.taken_per_s[kind].append(counts["taken"] / (seconds + 2 * SETTLE_S))
            found.flooded_mb = memory_mb(process.pid)
            yield
        found.latency_us = 1e6 * np.array(_target_latency_s(rig, seconds))
        found.alone_ms = _connect_ms(port, key, seconds)
        with flooding("connections", f"tcp://127.0.0.1:{port}", seconds + 5.0):
            time.sleep(SETTLE_S)
            found.crowded_ms = _connect_ms(port, key, seconds)
        yield


def _rows(found: Found, period_us: float) -> Iterator[Row]:
    for kind, sample in found.floods.items():
        yield from _under(kind, sample, found.quiet, float(np.mean(found.taken_per_s[kind])), period_us)
    text = f"before {found.idle_mb:.0f} MB"
    yield Row("memory of the host under flood", found.flooded_mb, "MB", text, 200.0)
    latency_us, alone_ms, crowded_ms = found.latency_us, found.alone_ms, found.crowded_ms
    if not crowded_ms:  # it was ended before
        return
    text = f"p99 {np.percentile(latency_us, 99):.0f} us of {len(latency_us)}; period {period_us:.0f} us"
    p50_us = float(np.median(latency_us))
    yield Row("target by ipc: sent to tick that takes it, p50", p50_us, "us", text, period_us + 150.0)
    text = f"alone {np.median(alone_ms):.1f} ms; slowest {max(crowded_ms):.1f} ms of {len(crowded_ms)}"
    name = f"connect beside {CONNECTIONS} noisy and {CONNECTIONS} silent, median"
    yield Row(name, float(np.median(crowded_ms)), "ms", text, 50.0)


def _under(kind: str, sample: Sample, quiet: Sample, taken_per_s: float, period_us: float) -> list[Row]:
    """What a flood of this kind does to the loop and to a stop, beside the quiet daemon."""
    out = []
    offered = f"{RATE_HZ:g} messages/s offered, {taken_per_s:.0f}/s taken"
    for name, label in (("wakeup_ns", "wake-up"), ("cycle_ns", "cycle")):
        flooded, calm = sample.p99_us(name), quiet.p99_us(name)
        text = f"flooded {flooded:.1f} us, quiet {calm:.1f} us; {offered}"
        out.append(
            Row(
                f"{label} p99 under {kind}, above quiet",
                100 * (flooded - calm) / period_us,
                "% of T",
                text,
                10.0,
            )
        )
    stops, calm_ms = 1e3 * np.array(sample.stop_s), 1e3 * float(np.median(quiet.stop_s))
    text = f"quiet {calm_ms:.2f} ms; slowest {stops.max():.1f} ms of {len(stops)}"
    out.append(Row(f"stop under {kind}: sent to obeyed, median", float(np.median(stops)), "ms", text, 20.0))
    return out


def _rig(config: Path) -> str:
    return load(config).config.rig.name


@contextmanager
def daemon_on_loopback(
    config: Path, seconds: float = 3000.0, *, viewer: bool = False
) -> Iterator[tuple[subprocess.Popen[bytes], str, Path, int]]:
    """The daemon with a TCP door of its own on 127.0.0.1: process, runtime folder, an operator's key, port.

    With `viewer` also the port for viewers without keys, three further on; `config` must not have [telemetry]
    then.
    """
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        root = Path(folder)
        key = KeyStore(root / "keys").new("bench", "operator", root / "bench.key")
        port = _free_port()
        door = f'[gateway]\nbind = "127.0.0.1"\nport = {port}\ncurve_dir = "keys"\n'
        if viewer:
            door += f"[telemetry]\nplotjuggler = true\nplotjuggler_port = {port + 3}\n"
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
        with daemon(config, root, door, environment=environment, seconds=seconds) as process:
            yield process, folder, key, port


@contextmanager
def flooding(kind: str, address: str, seconds: float) -> Iterator[subprocess.Popen[str]]:
    """A flood from a process of its own, on its way when this returns."""
    command = [sys.executable, "-m", "tests.bench.flooder", kind, address, str(seconds)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        time.sleep(SETTLE_S)
        yield process
    finally:
        process.kill()
        process.communicate()


def _measure(rig: RigClient, sample: Sample, seconds: float) -> None:
    """Follow the ticks for `seconds`, and ask for a stop now and then."""
    end = time.monotonic() + seconds
    next_stop = time.monotonic()
    asked: dict[int, float] = {}
    with rig.ticks() as ticks:
        while (now := time.monotonic()) < end:
            if now >= next_stop:
                next_stop = now + STOP_PERIOD_S
                seq = rig._call("stop")["result"]["command_seq"]
                asked[seq] = now
            batch = ticks.receive(0.02)
            if batch is None:
                continue
            sample.wakeup_ns.append(batch["wakeup_ns"])
            sample.cycle_ns.append(batch["cycle_ns"])
            for seq in [seq for seq in asked if seq <= batch["command_seq"][-1]]:
                obeyed_ns = batch["time_ns"][np.searchsorted(batch["command_seq"], seq)]
                sample.stop_s.append(max(0.0, obeyed_ns * 1e-9 - asked.pop(seq)))
    if not sample.cycle_ns or not sample.stop_s:
        raise RtctlError("the daemon sent no ticks, or obeyed no stop")


def _target_latency_s(rig: RigClient, seconds: float) -> list[float]:
    """Times from sending a target to the grid time of the tick that takes it, s; now and then a target.

    The ticks that tell are read `AFTERWARDS_S` later: decoding them at once keeps the thread of ZeroMQ that
    sends from the core for 0.3 ms where cores are few, and it is the measurement that decodes them, not a
    renderer.
    """
    rig.set_environment(0, "remote")
    rig.status()
    sent: list[float] = []
    taken: list[float] = []
    draw = np.random.default_rng(1)
    end = time.monotonic() + seconds
    with rig.lease() as lease, rig.ticks() as ticks:
        ticks.receive(1.0)
        while time.monotonic() < end:
            time.sleep(0.010 + 0.01 * draw.random())
            sent.append(time.monotonic())
            lease.set_target(lease.start_rad)
            time.sleep(AFTERWARDS_S)
            while (batch := ticks.receive(0.0)) is not None:
                taken += (batch["time_ns"][batch["target_age_ticks"] == 0] * 1e-9).tolist()
        while (batch := ticks.receive(0.1)) is not None and batch["time_ns"][-1] * 1e-9 < sent[-1] + 0.1:
            taken += (batch["time_ns"][batch["target_age_ticks"] == 0] * 1e-9).tolist()
    first_after = np.searchsorted(taken, sent)
    return [taken[i] - at for i, at in zip(first_after, sent, strict=True) if i < len(taken)]


def _connect_ms(port: int, key: Path, seconds: float) -> list[float]:
    """Times from a new client to the reply it waits for, ms."""
    times = []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        began = time.monotonic()
        with RigClient(address=f"127.0.0.1:{port}", key=key, timeout_s=10.0) as client:
            client.hello()
            times.append(1e3 * (time.monotonic() - began))
        time.sleep(CONNECT_PERIOD_S)
    return times


def memory_mb(pid: int) -> float:
    """Largest resident memory of a process so far, MB."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return float(line.split()[1]) / 1024
    return float("nan")


def _free_port() -> int:
    """A port with the three after it free now."""
    for first in range(29_860, 60_000, 7):
        try:
            for port in range(first, first + 4):
                socket.create_server(("127.0.0.1", port)).close()
        except OSError:
            continue
        return first
    raise RtctlError("no four free TCP ports in a row")
