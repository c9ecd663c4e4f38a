"""10 kHz with three subscribers: does every tick arrive at all three, and how many slots does the loop miss?"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from rtctl.errors import RtctlError
from rtctl.rig_file.config import load
from tests.bench import cyclictest
from tests.bench.loop import last_core, run_daemon
from tests.bench.row import Row

SUBSCRIBERS = 3


def rows(config: Path, seconds: float) -> list[Row]:
    """Run the daemon with subscribers for `seconds`, half before and half after cyclictest's `seconds`."""
    loaded = load(config)
    interval_us = round(1e6 / loaded.config.loop.rate_hz)
    priority = loaded.config.loop.priority
    before = cyclictest.run(seconds / 2, interval_us, priority, last_core())
    summary, seen = _daemon_with_subscribers(config, loaded.config.rig.name, seconds)
    after = cyclictest.run(seconds / 2, interval_us, priority, last_core())
    reference = (before + after).missed(interval_us)
    arrived = min(one["received"] / (one["last"] - one["first"] + 1 - one["missed"]) for one in seen)
    lost = sum(one["lost"] + one["gaps"] - one["missed"] for one in seen)
    ticks, missed = int(summary["ticks"]), int(summary["missed_ticks"])
    text = f"{ticks} ticks recorded; {[one['received'] for one in seen]} received since each joined"
    faults = f"; rig faults: {summary['fault_first']}" if summary["fault_first"] else ""
    return [
        Row(f"{loaded.config.loop.rate_hz:g} Hz, ticks arrived at the worst of {SUBSCRIBERS}", 100 * arrived, "%", text, 100.0, ">="),
        Row("ticks lost on the way, all subscribers", lost, "ticks", "running numbers in the messages", 0.0),
        Row("missed ticks against cyclictest", missed / max(1, reference), "x",
            f"ours {missed}, cyclictest {reference} at {interval_us} us, {seconds:g} s each{faults}", 1.2),
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
            summary = run_daemon(config, seconds, "--arm", "--runtime-dir", folder)
            outputs = [process.communicate(timeout=60)[0] for process in processes]
        finally:
            for process in processes:
                process.kill()
    if not all(outputs):
        raise RtctlError("a subscriber ended without a result")
    return summary, [json.loads(output) for output in outputs]
