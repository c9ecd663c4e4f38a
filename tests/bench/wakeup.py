"""How late a tick of the whole loop starts, beside cyclictest: at three rates, idle and under named loads, in
turns; what it costs.

Ours is the real loop on the mock, each wake-up from the deadline of its slot on. Beside both stands a loop
that never sleeps (`tests.bench.looking`): how late it is, nobody can be earlier on this machine. Priority,
core and interval are the same for all; every round runs one after the other, so that what the machine does
meanwhile meets all.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.errors import RtctlError
from rtctl.rig_file.config import load
from tests.bench import cyclictest, loads
from tests.bench.cyclictest import Latencies
from tests.bench.loop import loop_core, probe
from tests.bench.row import Row, in_turns

RATES_HZ = (1000.0, 4000.0, 10_000.0)
TARGETS = ((50.0, 0.05), (99.0, 0.5), (99.9, 1.0))
"""Percentile, and most that it may be of cyclictest's."""

BESIDES_S = 10.0
"""A turn takes that much longer than both measurements: starting, and what looking costs."""

MOST_COST = 0.08
"""Share of the loop's core that looking early may take at 1 kHz."""


@dataclass
class Beside:
    """Wake-ups of both at one rate under one load."""

    rate_hz: float
    load: str
    core: int = field(default_factory=loop_core)
    apart: bool = False
    ours: Latencies = field(default_factory=lambda: Latencies.of(np.zeros(0)))
    theirs: Latencies = field(default_factory=lambda: Latencies.of(np.zeros(0)))
    awake: Latencies = field(default_factory=lambda: Latencies.of(np.zeros(0)))
    cost: list[float] = field(default_factory=list)
    early_us: list[float] = field(default_factory=list)
    missed: int = 0

    @property
    def name(self) -> str:
        """For a row."""
        return f"{self.rate_hz / 1000:g} kHz, {self.load}{' on other cores' if self.apart else ''}"

    def round(self, config: Path, seconds: float) -> None:
        """One turn of each."""
        loop = load(config).config.loop
        with loads.running(self.load, self.core if self.apart else -1):
            theirs = cyclictest.run(seconds, round(1e6 / self.rate_hz), loop.priority, self.core)
            ours = probe("loop", config, seconds, self.rate_hz, self.core)
            looked = _looked(self.rate_hz, loop.priority, self.core)
        self.theirs += theirs
        # slots missed meanwhile: `wakeup_ns` counts from the last of them
        passed = np.diff(ours[2], prepend=ours[2][:1])
        self.ours += Latencies.of(ours[0] + passed * round(1e9 / self.rate_hz))
        self.missed += int(ours[2][-1] - ours[2][0])
        self.awake += Latencies.of(np.array(looked["awake_ns"]))
        self.cost.append(looked["share"])
        self.early_us.append(looked["early_us"])

    def rows(self) -> Iterator[Row]:
        """What is asked of wake-ups, and what looking early costs."""
        for percent, most in TARGETS:
            mine, reference = self.ours.percentile_us(percent), self.theirs.percentile_us(percent)
            floor = self.awake.percentile_us(percent)
            text = f"ours {mine:.2f} us, cyclictest {reference:.1f} us; who never sleeps {floor:.2f} us"
            yield Row(
                f"start against cyclictest, p{percent:g}, {self.name}",
                mine / max(reference, 1e-9),
                "x",
                text,
                most,
            )
        text = f"ours {self.ours.largest_us()} us, cyclictest {self.theirs.largest_us()} us"
        ratio = self.ours.largest_us() / max(self.theirs.largest_us(), 1)
        yield Row(f"start against cyclictest, latest, {self.name}", ratio, "x", text)
        target = MOST_COST if self.rate_hz == RATES_HZ[0] else None
        slots, theirs = 1e6 / self.rate_hz, self.theirs.missed(1e6 / self.rate_hz)
        text = f"{self.missed} missed, cyclictest {theirs}; of {slots:g} us each"
        yield Row(f"missed slots, {self.name}", self.missed / max(theirs, 1), "x", text)
        text = f"on core {self.core}; awake {np.mean(self.early_us):.0f} us before a deadline at the end"
        yield Row(f"looking at the clock, {self.name}", float(np.mean(self.cost)), "of a core", text, target)


@dataclass(frozen=True)
class Conditions:
    """What is measured under: idle and these loads; apart: each of them a second time, with the core of the
    loop left to the loop.
    """

    loads: tuple[str, ...] = ()
    apart: bool = False
    cpu: int = -1

    def pairs(self) -> list[Beside]:
        """One for each condition and rate; nothing is measured yet."""
        core = loop_core(self.cpu)
        every = [
            ("idle", False),
            *((one, away) for one in self.loads for away in ((False, True) if self.apart else (False,))),
        ]
        return [Beside(rate, load, core, away) for load, away in every for rate in RATES_HZ]


def rows(
    config: Path, rounds: int, seconds: float, conditions: Conditions, drawn: Path | None = None
) -> Iterator[Row]:
    """Measure at every rate and under all `conditions`, `rounds` turns of `seconds` each; and the picture."""
    pairs = conditions.pairs()

    def turns() -> Iterator[None]:
        for _ in range(rounds):
            for pair in pairs:
                pair.round(config, seconds)
                yield

    def found() -> Iterator[Row]:
        measured = [pair for pair in pairs if pair.cost]
        if drawn is not None:
            picture(measured, drawn)
        for pair in measured:
            yield from pair.rows()

    return in_turns(turns(), found)


def rounds_in(minutes: float, seconds: float, conditions: Conditions) -> int:
    """Rounds of `seconds` for each of both that fit into these minutes, at least one."""
    return max(1, round(60 * minutes / ((2 * seconds + BESIDES_S) * len(conditions.pairs()))))


def picture(pairs: list[Beside], path: Path) -> None:
    """Histograms of both, one panel for each rate and load, on logarithmic axes."""
    from matplotlib.figure import Figure

    across = len(RATES_HZ)
    down = -(-len(pairs) // across)
    figure = Figure(figsize=(4.2 * across, 2.8 * down), layout="constrained")
    for i, pair in enumerate(pairs):
        axes = figure.add_subplot(down, across, i + 1)
        for label, one, colour in (("rtctl", pair.ours, "C0"), ("cyclictest", pair.theirs, "C1")):
            cells = np.flatnonzero(one.counts)
            axes.step(np.maximum(cells, 0.5), one.counts[cells], where="mid", color=colour, label=label)
        axes.set(
            xscale="log", yscale="log", title=pair.name, xlabel="start after the deadline, us", ylabel="ticks"
        )
        axes.grid(visible=True, which="major", alpha=0.3)
    figure.axes[0].legend()
    figure.savefig(path, dpi=120)


def _looked(rate_hz: float, priority: int, cpu: int) -> dict[str, Any]:
    command = [sys.executable, "-m", "tests.bench.looking", *map(str, (rate_hz, priority, cpu))]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RtctlError(f"the measuring process failed: {done.stderr.strip().splitlines()[-1]}")
    found: dict[str, Any] = json.loads(done.stdout)
    return found
