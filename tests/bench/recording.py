"""Recording at 10 kHz: does every tick reach the disk, what does that cost, does the loop notice, how quick
is a replay?

Runs with and without a recording, in turn.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.recording.reader import RecordingReader
from rtctl.recording.replay import Replay, Verdict
from rtctl.rig_file.config import load
from tests.bench.loop import run_daemon
from tests.bench.row import Row, in_turns

MOST_SHARE_PERCENT = 5.0
"""Most of one core that a recording may take: its thread, and all that the daemon does more."""

MOST_BYTES = 110.0
"""Wanted on disk, bytes a tick."""

LEAST_REPLAY = 100.0
"""How many times quicker than the rig a replay is to be."""

NOTICED_PERCENT = 5.0
"""Most that the loop's p99 may rise, in percent of its period."""


Recorded = tuple[dict[str, Any], int, Verdict]
"""Summary of a run that recorded, ticks in its file, and their replay."""


def rows(config: Path, rounds: int, seconds: float) -> Iterator[Row]:
    """`rounds` pairs of runs of `seconds`, every other pair in reverse order, so that a drift of the machine
    cancels.
    """
    period_us = 1e6 / load(config).config.loop.rate_hz
    pairs: list[tuple[dict[str, Any], Recorded]] = []

    def turns() -> Iterator[None]:
        for i in range(rounds):
            before = run_daemon(config, seconds, "--arm") if i % 2 == 0 else None
            recorded = _recorded(config, seconds)
            pairs.append((before or run_daemon(config, seconds, "--arm"), recorded))
            yield

    return in_turns(turns(), lambda: _rows(pairs, seconds, period_us))


def _rows(pairs: list[tuple[dict[str, Any], Recorded]], seconds: float, period_us: float) -> list[Row]:
    """Of all pairs."""
    without, rounds = [one for one, _ in pairs], len(pairs)
    recorded, replays = [one[0] for _, one in pairs], [one[2] for _, one in pairs]
    in_files = sum(one[1] for _, one in pairs)
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
    return [
        lost,
        _more(without, recorded, 1e6 / period_us),
        *_costs(recorded, replays, 1e6 / period_us),
        *(_noticed(name, label, without, recorded, period_us) for name, label in LABELS.items()),
    ]


def _more(without: list[dict[str, Any]], recorded: list[dict[str, Any]], rate_hz: float) -> Row:
    """What the processes of a rig take more with a recording, per second of ticks; median of the pairs."""
    shares = [
        np.array([100 * float(one["cpu_s"]) * rate_hz / max(int(one["ticks"]), 1) for one in runs])
        for runs in (without, recorded)
    ]
    more = shares[1] - shares[0]
    text = (
        f"{np.median(shares[0]):.1f} % without, start and end included; "
        f"pairs {', '.join(f'{x:+.1f}' for x in more)}"
    )
    name = "all processes while recording, above without, share of a core"
    return Row(name, float(np.median(more)), "%", text, MOST_SHARE_PERCENT)


def _costs(recorded: list[dict[str, Any]], replays: list[Verdict], rate_hz: float) -> list[Row]:
    """What a recording costs in processor time and bytes, and how quick the law goes over it again."""
    statuses = [one["recording"] for one in recorded]
    ticks = sum(int(status["ticks"]) for status in statuses)
    cpu_s, size = (sum(float(status[name]) for status in statuses) for name in ("cpu_s", "bytes"))
    span_s, took_s = sum(verdict.span_s for verdict in replays), sum(verdict.took_s for verdict in replays)
    law_us = 1e6 * sum(verdict.law_s for verdict in replays) / max(ticks, 1)
    differ = sum(verdict.first is not None for verdict in replays)
    loop_s = ticks / rate_hz  # a run lasts longer than it was asked to: it arms first
    share = 100 * cpu_s / max(loop_s, 1e-9)
    return [
        Row(
            "recorder, share of a core",
            share,
            "%",
            f"{1e6 * cpu_s / max(ticks, 1):.2f} us of processor time a tick",
            MOST_SHARE_PERCENT,
        ),
        Row("recording, bytes a tick on disk", size / max(ticks, 1), "B", f"{ticks} ticks", MOST_BYTES),
        Row(
            "replay, law compared bit for bit",
            span_s / max(took_s, 1e-9),
            "x real time",
            f"the law {law_us:.2f} us a tick; {differ} differ",
            LEAST_REPLAY,
            ">=",
        ),
    ]


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


def _recorded(config: Path, seconds: float) -> Recorded:
    """A recorded run: its summary, the ticks found in its files, and what their replay found."""
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        summary = run_daemon(config, seconds, "--arm", "--record", folder)
        parts = sorted(Path(folder).rglob("*.mcap"))
        replay = Replay(RecordingReader(parts)).check()
        return summary, sum(len(batch.rows) for batch in RecordingReader(parts).batches()), replay
