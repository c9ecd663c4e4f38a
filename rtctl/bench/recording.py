"""Recording at 10 kHz: does every tick reach the disk, and does the loop notice? Runs with and without, in turn."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.bench.loop import run_daemon
from rtctl.bench.row import Row
from rtctl.config import load
from rtctl.recording.reader import RecordingReader

NOTICED_PERCENT = 5.0
"""Most that the loop's p99 may rise, in percent of its period."""


def rows(config: Path, rounds: int, seconds: float) -> list[Row]:
    """`rounds` pairs of runs of `seconds`, every other pair in reverse order, so that a drift of the machine cancels."""
    period_us = 1e6 / load(config).config.loop.rate_hz
    without: list[dict[str, Any]] = []
    recorded: list[dict[str, Any]] = []
    in_files = 0
    for i in range(rounds):
        for record in (False, True) if i % 2 == 0 else (True, False):
            if record:
                summary, ticks = _recorded(config, seconds)
                recorded.append(summary)
                in_files += ticks
            else:
                without.append(run_daemon(config, seconds, "--arm"))
    ticks = sum(int(one["ticks"]) for one in recorded)
    dropped = sum(int(one["recording"]["dropped"]) for one in recorded)
    size_mb = sum(int(one["recording"]["bytes"]) for one in recorded) / 1e6
    rate = f"{ticks} ticks in {rounds} x {seconds:g} s, {size_mb / (rounds * seconds):.1f} MB/s"
    lost = Row(
        "recording at 10 kHz, ticks not in the file",
        ticks - in_files,
        "ticks",
        f"{rate}; {dropped} dropped",
        0.0,
    )
    return [lost, *(_noticed(name, label, without, recorded, period_us) for name, label in LABELS.items())]


LABELS = {"wakeup_us": "wake-up", "cycle_us": "cycle"}


def _noticed(
    name: str, label: str, without: list[dict[str, Any]], recorded: list[dict[str, Any]], period_us: float
) -> Row:
    """How much the p99 rose, median over the pairs."""
    calm, busy = (np.array([one[name]["p99"] for one in runs]) for runs in (without, recorded))
    rise = 100 * (busy - calm) / period_us
    text = (
        f"recording {np.median(busy):.1f} us, without {np.median(calm):.1f} us; "
        f"pairs {', '.join(f'{x:+.1f}' for x in rise)}"
    )
    return Row(
        f"{label} p99 while recording, above without", float(np.median(rise)), "% of T", text, NOTICED_PERCENT
    )


def _recorded(config: Path, seconds: float) -> tuple[dict[str, Any], int]:
    """A recorded run: its summary, and the ticks found in its files."""
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        summary = run_daemon(config, seconds, "--arm", "--record", folder)
        parts = sorted(Path(folder).rglob("*.mcap"))
        return summary, sum(len(batch.rows) for batch in RecordingReader(parts).batches())
