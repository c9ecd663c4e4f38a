"""The loop against an empty loop and the wall clock: each in a process of its own, interleaved."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.errors import FaultError, RtctlError
from rtctl.rig_file.config import load
from rtctl.rt import core
from tests.bench import cyclictest
from tests.bench.cyclictest import Latencies
from tests.bench.row import Row, in_turns


def probe(kind: str, config: Path, seconds: float, rate_hz: float = 0.0, cpu: int = -1) -> np.ndarray:
    """Run `tests.bench.loop_wakeups` in a process of its own; see there for the rows."""
    command = [
        sys.executable,
        "-m",
        "tests.bench.loop_wakeups",
        kind,
        str(config),
        str(seconds),
        str(rate_hz),
        str(cpu),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RtctlError(f"the measuring process failed: {done.stderr.strip().splitlines()[-1]}")
    return np.array(json.loads(done.stdout))


def loop_core(asked: int = -1) -> int:
    """The core that the loop takes, as the daemon chooses it."""
    return core.choose(asked, os.sched_getaffinity(0)).core


def cycle_rows(config: Path, rounds: int, seconds: float) -> Iterator[Row]:
    """Work of one cycle, plant included, beside an empty loop in Python, six axes without a plant, and
    cyclictest, in turn.
    """
    loop = load(config).config.loop
    found: list[tuple[np.ndarray, np.ndarray, np.ndarray, Latencies | None]] = []

    def turns() -> Iterator[None]:
        for _ in range(rounds):
            bare, work, six = (probe(kind, config, seconds) for kind in ("empty", "loop", "six"))
            theirs = None
            if cyclictest.available():
                theirs = cyclictest.run(seconds, round(1e6 / loop.rate_hz), loop.priority, loop_core())
            found.append((work, bare, six, theirs))
            yield

    return in_turns(turns(), lambda: _cycle_rows(found))


def _cycle_rows(found: list[tuple[np.ndarray, np.ndarray, np.ndarray, Latencies | None]]) -> list[Row]:
    """Of all rounds."""
    work, bare, many = (np.concatenate(part, axis=1) for part in list(zip(*found, strict=True))[:3])
    theirs = [one[3] for one in found if one[3] is not None]
    done_us, bare_us = (np.percentile(part[0] + part[1], 99) / 1e3 for part in (work, bare))
    work_us, python_us, many_us = (np.percentile(part[1], [50, 99]) / 1e3 for part in (work, bare, many))
    ticks = f"{work.shape[1]} ticks"
    rows = [
        Row("cycle on the mock, p50", work_us[0], "us",
            f"{ticks}; empty loop in Python {python_us[0]:.2f} us", 2.0),
        Row("cycle on the mock, p99", work_us[1], "us",
            f"{ticks}; empty loop in Python {python_us[1]:.2f} us"),
        Row("cycle of six axes with models, no plant, p50", many_us[0], "us", f"p99 {many_us[1]:.2f} us",
            8.0),
        Row("deadline to command sent, p99", done_us, "us", f"empty loop in Python {bare_us:.1f} us", 10.0),
    ]  # fmt: skip
    if theirs:
        latest = sum(theirs, Latencies.of(np.zeros(0))).percentile_us(99.0)
        text = f"cyclictest only wakes up: {latest:.1f} us"
        rows.append(
            Row("deadline to command sent, p99, against cyclictest", done_us / latest, "x", text, 0.5)
        )
    return rows


def start_rows(config: Path, rounds: int) -> Iterator[Row]:
    """Time from starting `rtctl run` to its first tick, compiled code in the cache."""
    seconds: list[float] = []

    def turns() -> Iterator[None]:
        run_daemon(config, 0.3)  # fills the cache
        for _ in range(rounds):
            began = time.monotonic_ns()
            seconds.append((run_daemon(config, 0.3)["first_tick_ns"] - began) / 1e9)
            yield

    def row() -> Iterator[Row]:
        text = f"median of {len(seconds)}, quickest {min(seconds):.2f} s, slowest {max(seconds):.2f} s"
        yield Row("start of rtctl run to first tick", float(np.median(seconds)), "s", text, 1.0)

    return in_turns(turns(), row)


def run_daemon(config: Path, seconds: float, *more: str) -> dict[str, Any]:
    """`rtctl run CONFIG --for SECONDS --json`; returns its summary, also of a run that latched a fault.

    `cpu_s` in it is the processor time of all its processes, start and end included."""
    command = [sys.executable, "-m", "rtctl", "run", str(config), "--for", str(seconds), "--json", *more]
    before = _children_s()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    cpu_s = _children_s() - before
    if done.returncode not in (0, FaultError.exit_code):
        raise RtctlError(f"rtctl run failed: {done.stderr.strip() or done.stdout.strip()}")
    return {**json.loads(done.stdout.splitlines()[-1]), "cpu_s": cpu_s}


def _children_s() -> float:
    """Processor time of all processes that this one began and that have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
