"""10 kHz with ten subscribers and a recording: does every tick arrive everywhere, and how many slots does the
loop miss, beside cyclictest?
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.errors import RtctlError
from rtctl.rig_file.config import load
from tests.bench import cyclictest
from tests.bench.cyclictest import Latencies
from tests.bench.loop import last_core, run_daemon
from tests.bench.row import Row, in_turns

SUBSCRIBERS = 10


Run = tuple[dict[str, Any], list[dict[str, int]]]
"""Summary of a daemon, and what each subscriber saw."""


def rows(config: Path, seconds: float, rounds: int = 1) -> Iterator[Row]:
    """`rounds` times: the daemon with recording and subscribers for `seconds`, half before and half after it
    as much of cyclictest.

    cyclictest has the machine to itself. The sum of what was missed is mostly a few standstills of a shared
    machine, which fall where they like: the median of the rounds says what is missed besides.
    """
    loaded = load(config)
    loop = loaded.config.loop
    interval_us = round(1e6 / loop.rate_hz)
    found: list[tuple[Run, Latencies]] = []

    def turns() -> Iterator[None]:
        for _ in range(rounds):
            before = cyclictest.run(seconds / 2, interval_us, loop.priority, last_core())
            run = _daemon_with_subscribers(config, loaded.config.rig.name, seconds)
            after = cyclictest.run(seconds / 2, interval_us, loop.priority, last_core())
            found.append((run, before + after))
            yield

    return in_turns(turns(), lambda: _rows(found, interval_us, seconds))


def _rows(found: list[tuple[Run, Latencies]], interval_us: int, seconds: float) -> list[Row]:
    """Of all rounds."""
    runs = [run for run, _ in found]
    references = [theirs.missed(interval_us) for _, theirs in found]
    reference = sum(references)
    ours = [int(summary["missed_ticks"]) for summary, _ in runs]
    usual, usual_reference = (float(np.median(values)) for values in (ours, references))
    seen = [one for _, those in runs for one in those]
    arrived = min(one["received"] / (one["last"] - one["first"] + 1 - one["missed"]) for one in seen)
    lost = sum(max(one["lost"], one["gaps"] - one["missed"]) for one in seen)  # each loss shows in both
    ticks, missed, unwritten = (
        sum(int(value) for value in values)
        for values in zip(
            *((s["ticks"], s["missed_ticks"], s["recording"]["dropped"]) for s, _ in runs), strict=True
        )
    )
    text = f"{ticks} ticks; {min(one['received'] for one in seen)} or more received since each joined"
    faults = sorted({summary["fault_first"] for summary, _ in runs if summary["fault_first"]})
    told = f"; rig faults: {', '.join(faults)}" if faults else ""
    rate = f"{1e6 / interval_us:g} Hz"
    return [
        Row(f"{rate}, ticks arrived at the worst of {SUBSCRIBERS}", 100 * arrived, "%", text, 100.0, ">="),
        Row("ticks lost on the way, all subscribers", lost, "ticks", "running numbers in the messages", 0.0),
        Row("ticks that the recording dropped meanwhile", unwritten, "ticks", f"of {ticks}", 0.0),
        Row(f"missed ticks against cyclictest, {rate}, recording, {SUBSCRIBERS} subscribers",
            missed / max(1, reference), "x",
            f"ours {missed}, cyclictest {reference} at {interval_us} us, {len(found)} x {seconds:g} s each, "
            f"in turn{told}", 0.8),
        Row("the same, median of the rounds", usual / max(1, usual_reference), "x",
            f"ours {usual:g}, {max(ours)} in the worst; cyclictest {usual_reference:g}, {max(references)} "
            "in the worst"),
    ]  # fmt: skip


def _daemon_with_subscribers(config: Path, rig: str, seconds: float) -> Run:
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "tests.bench.subscriber", rig, folder]
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
        processes = [
            subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
            for _ in range(SUBSCRIBERS)
        ]
        try:
            summary = run_daemon(
                config, seconds, "--arm", "--runtime-dir", folder, "--record", f"{folder}/log"
            )
            outputs = [process.communicate(timeout=60)[0] for process in processes]
        finally:
            for process in processes:
                process.kill()
    if not all(outputs):
        raise RtctlError("a subscriber ended without a result")
    return summary, [json.loads(output) for output in outputs]
