"""10 kHz with ten subscribers and a recording: does every tick arrive everywhere, and how many slots does the
loop miss, beside cyclictest?

A virtual machine whose other core is busy stands still more often than an idle one: cyclictest beside one
endless loop on the other core missed four times as much as cyclictest alone. So it is asked twice: with the
machine to itself, which is what the machine can do at its best, and while another such daemon with as many
subscribers and a recording keeps the other cores busy, which is what is left of that beside this work.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import timeit
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import chain
from pathlib import Path
from typing import Any

import msgpack
import numpy as np

from rtctl.errors import RtctlError
from rtctl.rig_file.config import LoadedConfig, load
from rtctl.tick import new_ticks
from tests.bench import cyclictest
from tests.bench.cyclictest import Latencies
from tests.bench.loop import loop_core, run_daemon
from tests.bench.row import Row, in_turns

SUBSCRIBERS = 10

BATCH_S = 0.008
"""Of ticks in a message, about."""

Run = tuple[dict[str, Any], list[dict[str, int]]]
"""Summary of a daemon, and what each subscriber saw."""


def rows(config: Path, seconds: float, rounds: int = 1) -> Iterator[Row]:
    """`rounds` times: the daemon with recording and subscribers for `seconds`, half before and half after it
    as much of cyclictest with the machine to itself, then as much of it beside the same work on other cores.

    The sum of what was missed is mostly a few standstills of a shared machine, which fall where they like:
    the median of the rounds says what is missed besides.
    """
    loaded = load(config)
    loop, rig = loaded.config.loop, loaded.config.rig.name
    interval_us = round(1e6 / loop.rate_hz)
    found: list[tuple[Run, Latencies, Latencies | None]] = []

    def reference(seconds: float) -> Latencies:
        return cyclictest.run(seconds, interval_us, loop.priority, loop_core())

    def turns() -> Iterator[None]:
        for _ in range(rounds):
            before = reference(seconds / 2)
            run = _daemon_with_subscribers(config, rig, seconds)
            after = reference(seconds / 2)
            beside = None
            if others := os.sched_getaffinity(0) - {loop_core()}:
                with ThreadPoolExecutor(1, initializer=os.sched_setaffinity, initargs=(0, others)) as pool:
                    work = pool.submit(_daemon_with_subscribers, config, rig, seconds)
                    beside = reference(seconds)
                    work.result()
            found.append((run, before + after, beside))
            yield

    return chain(in_turns(turns(), lambda: _rows(found, interval_us, seconds)), _batch_rows(loaded))


def _rows(
    found: list[tuple[Run, Latencies, Latencies | None]], interval_us: int, seconds: float
) -> Iterator[Row]:
    """All rounds together."""
    runs = [run for run, _, _ in found]
    seen = [one for _, those in runs for one in those]
    arrived = min(one["received"] / (one["last"] - one["first"] + 1 - one["missed"]) for one in seen)
    lost = sum(max(one["lost"], one["gaps"] - one["missed"]) for one in seen)  # each loss shows in both
    ticks, unwritten = (
        sum(int(value) for value in values)
        for values in zip(*((s["ticks"], s["recording"]["dropped"]) for s, _ in runs), strict=True)
    )
    text = f"{ticks} ticks; {min(one['received'] for one in seen)} or more received since each joined"
    rate = f"{1e6 / interval_us:g} Hz"
    yield Row(f"{rate}, ticks arrived at the worst of {SUBSCRIBERS}", 100 * arrived, "%", text, 100.0, ">=")
    yield Row("ticks lost on the way, all subscribers", lost, "ticks", "running numbers in the messages", 0.0)
    yield Row("ticks that the recording dropped meanwhile", unwritten, "ticks", f"of {ticks}", 0.0)
    faults = sorted({summary["fault_first"] for summary, _ in runs if summary["fault_first"]})
    told = f"; rig faults: {', '.join(faults)}" if faults else ""
    told = f"at {interval_us} us, {len(found)} x {seconds:g} s each, in turn{told}"
    ours = [int(summary["missed_ticks"]) for summary, _ in runs]
    alone = [theirs.missed(interval_us) for _, theirs, _ in found]
    beside = [theirs.missed(interval_us) for _, _, theirs in found if theirs is not None]
    yield from _against("with the machine to itself", ours, alone, told)
    if beside:
        yield from _against("beside the same work", ours, beside, told)


def _batch_rows(loaded: LoadedConfig) -> Iterator[Row]:
    """What a batch of ticks costs: the host once, and each of its subscribers."""
    from rtctl.client.samples import tick_rows
    from rtctl.host.exchange.samples import tick_columns

    n = max(1, round(BATCH_S * loaded.config.loop.rate_hz))
    ticks = new_ticks(n, loaded.config.n_axes)
    message = msgpack.unpackb(msgpack.packb({"rows": n, "columns": tick_columns(ticks)}))
    for name, work in (
        ("made into columns", lambda: tick_columns(ticks)),
        ("read by a subscriber", lambda: tick_rows(message)),
    ):
        best_s = min(timeit.repeat(work, number=100, repeat=20)) / 100
        yield Row(f"{n} ticks {name}", 1e6 * best_s, "us", f"quickest of 20; {1 / BATCH_S:g} times a second")


def _against(how: str, ours: list[int], theirs: list[int], told: str) -> Iterator[Row]:
    """What was missed in each round, against what cyclictest missed that ran as `how` says."""
    name = f"missed ticks, recording, {SUBSCRIBERS} subscribers, against cyclictest {how}"
    yield Row(name, sum(ours) / max(1, sum(theirs)), "x",
              f"ours {sum(ours)}, cyclictest {sum(theirs)} {told}", 0.8)  # fmt: skip
    usual, reference = (float(np.median(values)) for values in (ours, theirs))
    yield Row("the same, median of the rounds", usual / max(1, reference), "x",
              f"ours {usual:g}, {max(ours)} in the worst; cyclictest {reference:g}, {max(theirs)} "
              "in the worst")  # fmt: skip


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
