"""Campaigns over many rigs, on all cores, and the one command that shows a violation again."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.control.vocabulary import Fault, Program, State
from rtctl.simulation import campaign_workers
from rtctl.simulation.campaign_drive import drive
from rtctl.simulation.campaign_monitor import INVARIANTS
from rtctl.simulation.campaign_rigs import Rig, make
from rtctl.simulation.family import shipped_rig
from rtctl.simulation.jit import records
from rtctl.whole_files import whole

TRACE_TICKS = 2000

TWO_AXES_OF = 8
"""Every so many rigs one has two axes."""


@dataclass(frozen=True)
class Order:
    """What to run; a rig follows from it and its number."""

    seed: int = 1
    rigs: int = 1000
    ticks: int = 10_000
    faults: int = 10
    passive: bool = False

    def reproduce(self, index: int) -> str:
        """The command that runs rig `index` alone."""
        passive = " --passive" if self.passive else ""
        return (
            f"rtctl campaign --seed {self.seed} --rig {index} --ticks {self.ticks} --faults "
            f"{self.faults}{passive}"
        )


@dataclass
class Violation:
    """A rig that broke an invariant."""

    index: int
    tick: int
    invariants: list[int]
    command: str

    def text(self) -> str:
        """For a person."""
        what = "; ".join(f"{number} ({INVARIANTS[number]})" for number in self.invariants)
        return f"rig {self.index}, tick {self.tick}: invariant {what}\n    {self.command}"


@dataclass
class Result:
    """Sums over the rigs that have run."""

    ticks: int = 0
    rigs: int = 0
    faults_scheduled: int = 0
    seconds: float = 0.0
    visits: np.ndarray = field(default_factory=lambda: np.zeros(len(State), np.int64))
    seen: np.ndarray = field(default_factory=lambda: np.zeros(64, np.int64))
    programs: np.ndarray = field(default_factory=lambda: np.zeros(len(Program), np.int64))
    violations: list[Violation] = field(default_factory=list)

    def add(self, other: Result) -> None:
        """Add another part."""
        # `seconds` is not added: parts run beside each other
        self.ticks += other.ticks
        self.rigs += other.rigs
        self.faults_scheduled += other.faults_scheduled
        self.visits += other.visits
        self.seen += other.seen
        self.programs += other.programs
        self.violations += other.violations

    def as_dict(self) -> dict[str, object]:
        """Plain values for JSON."""
        return {
            "rigs": self.rigs,
            "ticks": self.ticks,
            "seconds": round(self.seconds, 2),
            "faults_scheduled": self.faults_scheduled,
            "ticks_in_state": {state.name: int(self.visits[state]) for state in State},
            "axis_ticks_in_program": {kind.name: int(self.programs[kind]) for kind in Program},
            # appeared, and not present: one that stays counts once
            "faults_appeared": {fault.name: int(self.seen[fault.value.bit_length() - 1]) for fault in Fault},
            "violations": [vars(violation) for violation in self.violations],
        }


def run_traced(order: Order, index: int, keep: int = TRACE_TICKS) -> tuple[Result, Rig, np.ndarray]:
    """Run rig `index` in this process; also the rig, and its last `keep` ticks."""
    # by the number: a rig can be made again alone
    name = "mock-2axis.toml" if index % TWO_AXES_OF == 0 else "mock.toml"
    # made and not kept: a rig follows from seed and number
    rig = make(
        shipped_rig(name), order.seed, index, passive=order.passive, faults=order.faults, ticks=order.ticks
    )
    simulation, result = rig.simulation, Result(rigs=1, faults_scheduled=len(rig.faults))
    trace = records(np.zeros(keep, simulation.tick.dtype))
    # one call for all ticks: between two of them nothing of Python runs
    bits, result.ticks = drive(
        simulation.addresses(),
        simulation.params,
        simulation.state,
        simulation.command,
        simulation.model,
        simulation.plant_params,
        simulation.plant_state,
        simulation.tick,
        rig.memory,
        records(np.zeros_like(simulation.state)),
        # as it is at the start: the monitor begins anew with a law that is started again
        rig.memory.copy(),
        rig.rng,
        rig.foe,
        order.ticks,
        order.passive,
        result.visits,
        result.seen,
        result.programs,
        trace,
    )
    if bits:
        # all of them, not the first: one cause often breaks several
        numbers = [number for number in INVARIANTS if bits >> number & 1]
        result.violations.append(Violation(index, result.ticks, numbers, order.reproduce(index)))
    # of a ring: the oldest of the last ones is where the next would be written
    rows = min(keep, result.ticks)  # a rig that violates early has fewer
    last = np.take(trace, np.arange(result.ticks - rows, result.ticks) % keep) if rows else trace
    return result, rig, last


def save_trace(path: Path, rows: np.ndarray) -> None:
    """Write ticks as one array per field (npz); nothing half-written is left behind. Raises DataError."""
    columns: dict[str, Any] = {name: rows[name] for name in rows.dtype.names or ()}
    with whole(path) as new, new.open("wb") as file:
        np.savez_compressed(file, **columns)


def run_part(order: Order, indices: range) -> Result:
    """Run these rigs in this process."""
    total = Result()
    for index in indices:  # one after another: the next process does the next part
        # keep=0: two thousand ticks of each rig would be copied for nobody
        total.add(run_traced(order, index, keep=0)[0])
    return total


def _parts(order: Order) -> Iterator[range]:
    # at some 50,000 ticks a second and core 40 s of work at most: progress is told, and cores stay busy
    size = max(1, min(20, 2_000_000 // order.ticks))
    for first in range(0, order.rigs, size):
        yield range(first, min(first + size, order.rigs))


def run(order: Order, jobs: int = 0, progress: Callable[[int], None] = lambda _rigs: None) -> Result:
    """Run the whole campaign on `jobs` processes (0: one per core).

    `progress` is told how many rigs were done since the last call."""
    began, total = time.monotonic(), Result()
    parts = list(_parts(order))
    for part in campaign_workers.results(run_part, [order] * len(parts), parts, jobs=jobs):
        total.add(part)
        progress(part.rigs)
    # on the wall, all cores together: ticks a second are of the machine
    total.seconds = time.monotonic() - began
    return total
