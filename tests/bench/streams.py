"""10 kHz with ten subscribers and a recording: does every tick arrive everywhere, and how many slots does the
loop miss, beside cyclictest?
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.errors import RtctlError
from rtctl.rig_file.config import load
from tests.bench import cyclictest
from tests.bench.cyclictest import Latencies
from tests.bench.loop import last_core, run_daemon
from tests.bench.row import Row

SUBSCRIBERS = 10


def rows(config: Path, seconds: float, rounds: int = 1) -> list[Row]:
    """`rounds` times: the daemon with recording and subscribers for `seconds`, half before and half after it
    as much of cyclictest.

    cyclictest has the machine to itself. The sum of what was missed is mostly a few standstills of a shared
    machine, which fall where they like: the median of the rounds says what is missed besides.
    """
    loaded = load(config)
    loop = loaded.config.loop
    interval_us = round(1e6 / loop.rate_hz)
    theirs: list[Latencies] = []
    runs = []
    for _ in range(rounds):
        before = cyclictest.run(seconds / 2, interval_us, loop.priority, last_core())
        runs.append(_daemon_with_subscribers(config, loaded.config.rig.name, seconds))
        theirs.append(before + cyclictest.run(seconds / 2, interval_us, loop.priority, last_core()))
    references = [one.missed(interval_us) for one in theirs]
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
    rate = f"{loop.rate_hz:g} Hz"
    return [
        Row(f"{rate}, ticks arrived at the worst of {SUBSCRIBERS}", 100 * arrived, "%", text, 100.0, ">="),
        Row("ticks lost on the way, all subscribers", lost, "ticks", "running numbers in the messages", 0.0),
        Row("ticks that the recording dropped meanwhile", unwritten, "ticks", f"of {ticks}", 0.0),
        Row(f"missed ticks against cyclictest, {rate}, recording, {SUBSCRIBERS} subscribers",
            missed / max(1, reference), "x",
            f"ours {missed}, cyclictest {reference} at {interval_us} us, {rounds} x {seconds:g} s each, in "
            f"turn{told}", 0.8),
        Row("the same, median of the rounds", usual / max(1, usual_reference), "x",
            f"ours {usual:g}, {max(ours)} in the worst; cyclictest {usual_reference:g}, {max(references)} "
            "in the worst"),
    ]  # fmt: skip


def _daemon_with_subscribers(
    config: Path, rig: str, seconds: float
) -> tuple[dict[str, Any], list[dict[str, int]]]:
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
