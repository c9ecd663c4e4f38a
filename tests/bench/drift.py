"""False alarms and missed drifts of the watch over the friction: every plant of the mock's family, moved as
people move.

Nothing drifts at first: every warning is false, and so is every fault of the energy accounts, in free motion
(among them triangles), in a spring and at a wall. Then dry friction changes by a tenth, and what counts is
the motion until that is told, and the factor after a minute of motion. A hand that does not move the joint
for a minute, or turns before its bristles slide, shows no friction, whatever watches it: such drifts are
counted by themselves.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from copy import deepcopy
from dataclasses import dataclass, field, fields
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from rtctl.control.vocabulary import Fault
from rtctl.friction.drift_deployed import Deployed
from rtctl.friction.drift_estimate import STROKES_MIN
from rtctl.friction.drift_watch import RigWatch
from rtctl.rig_file.config import LoadedConfig, load
from rtctl.simulation import friction_truth
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.family import FAMILY
from tests.bench.drift_plants import (
    BY_PLACE,
    LOADED,
    LOCAL,
    MOTIONS,
    SEEN,
    WORLDS,
    Hand,
    Plant,
    continued,
    moved,
    plant,
    watched,
)
from tests.bench.row import Row, in_turns

DRIFTED = "drifted"
CHUNK_S = 2.0
MOVING_RAD_S = 0.03
WARM_UP_S = 120.0
MOTION_S = 60.0
PATIENCE_S = 1500.0
"""Simulated time in which a hand moves the joint for `MOTION_S`, or does not."""

OF_ACCOUNT = int(Fault.PASSIVITY | Fault.PASSIVITY_GROSS)


@dataclass
class Sum:
    """What was seen so far: hours watched, false warnings and STOPs, factors, and of drifts how soon they
    were told.
    """

    hours: float = 0.0
    alarms: list[str] = field(default_factory=list)
    stops: list[str] = field(default_factory=list)
    factors: list[float] = field(default_factory=list)
    told: list[float] = field(default_factory=list)
    missed: list[str] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    silent: list[str] = field(default_factory=list)
    of_account: list[str] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)

    def add(self, other: Sum) -> None:
        """Take what another one saw."""
        for one in fields(self):
            setattr(self, one.name, getattr(self, one.name) + getattr(other, one.name))

    @property
    def said(self) -> str:
        """In a line."""
        return (
            f"{self.hours:.1f} h, {len(self.alarms)} alarms, factors {_range(self.factors)}, "
            f"{len(self.told)} told, {len(self.missed)} missed, {len(self.silent)} cannot be told"
        )


def rows(config: Path, minutes: float, say: Callable[[str], None] = lambda _text: None) -> Iterator[Row]:
    """Watch `minutes` of motion without drift in all, then a tenth more and less on each plant and motion;
    `say` has each plant's sum as it comes.
    """
    names = [name for name in FAMILY if name != DRIFTED] + [BY_PLACE, SEEN]
    seconds = 60.0 * minutes / (len(names) * len(MOTIONS) * len(WORLDS))
    sums = Sum(), Sum(), Sum()
    return in_turns(_turns(config, names, seconds, sums, say), lambda: _figures(*sums))


def _turns(
    config: Path, names: list[str], seconds: float, sums: tuple[Sum, Sum, Sum], say: Callable[[str], None]
) -> Iterator[None]:
    quiet, load_sum, local = sums
    cores = len(os.sched_getaffinity(0))
    with ProcessPoolExecutor(cores, get_context("spawn")) as pool:
        asked = {pool.submit(_of_plant, config, name, seconds): name for name in names}
        for done, one in enumerate(as_completed(asked), 1):
            name, found = asked[one], one.result()
            {LOADED: load_sum, LOCAL: local}.get(name, quiet).add(found)
            say(f"{done} of {len(names)}: {name}: {found.said}")
            of_drift = () if name == LOADED else (*found.alarms, *found.missed, *found.silent)
            for text in (*of_drift, *found.of_account, *found.faults):
                say(f"    {text}")
            yield


def _of_plant(config: Path, name: str, seconds: float) -> Sum:
    """What is seen of one plant: `seconds` without drift in each motion and world, and its drifts."""
    into = Sum()
    with tempfile.TemporaryDirectory() as folder:
        made = plant(load(config), name, Path(folder))
        for motion, hand in MOTIONS.items():
            for seed, world in enumerate(WORLDS, 1):
                rig = Plant(moved(made.loaded, hand, seed=seed), made.places)
                undrifted(rig, f"{name}, {motion}, {world}", seconds, into, world)
            if name != LOADED:
                _drifting(made, hand, f"{name}, {motion}", into)
    return into


def _figures(quiet: Sum, load_sum: Sum, local: Sum) -> list[Row]:
    hours, every = quiet.hours + local.hours, (quiet, load_sum, local)
    beside = f"{hours:.1f} h simulated"
    drifts = f"{len(quiet.told) + len(quiet.missed)} drifts of a tenth"

    def row(name: str, value: float, unit: str, against: str, target: float | None = None) -> Row:
        return Row(f"friction drift: {name}", value, unit, against, target)

    return [
        row("false warnings", float(len(quiet.alarms) + len(local.alarms)), "1", beside, 0.0),
        row(
            "false faults of the energy accounts",
            float(sum(len(one.of_account) for one in every)),
            "1",
            f"{sum(one.hours for one in every):.1f} h in {', '.join(WORLDS)}",
            0.0,
        ),
        row("other faults", float(sum(len(one.faults) for one in every)), "1", "likewise", 0.0),
        row("false STOPs", float(len(quiet.stops) + len(local.stops)), "1", beside, 0.0),
        row("largest error of the factor, undrifted", _most_off(quiet.factors), "1", beside, 0.02),
        row(
            "the same where friction is a place's, and the model knows speed alone",
            _most_off(local.factors),
            "1",
            f"{LOCAL}, 18 % over a turn",
        ),
        row(
            "drifts not told",
            float(len(quiet.missed)),
            "1",
            f"{drifts}, {len(quiet.silent)} more stick or creep",
            0.0,
        ),
        row("motion until told, median", _at(quiet.told, 50), "s", drifts, MOTION_S),
        row("motion until told, longest", _at(quiet.told, 100), "s", drifts, MOTION_S),
        row("error of the factor after 60 s of motion, 95 %", _at(quiet.errors, 95), "1", drifts, 0.02),
        row("error of the factor after 60 s of motion, largest", _at(quiet.errors, 100), "1", drifts),
        row(
            "drifts not told where friction is a place's, and the model knows speed alone",
            float(len(local.missed)),
            "1",
            f"of {len(local.told) + len(local.missed)} on {LOCAL}",
        ),
        row(
            f"warnings on {LOADED}",
            float(len(load_sum.alarms)),
            "1",
            f"factors {_range(load_sum.factors)}: the hand's own torque",
        ),
    ]


def _at(values: list[float], percent: float) -> float:
    return float(np.percentile(values, percent)) if values else math.nan


def _most_off(factors: list[float]) -> float:
    return max((abs(k - 1.0) for k in factors), default=math.nan)


def _range(factors: list[float]) -> str:
    return f"{min(factors):.3f} to {max(factors):.3f}" if factors else "none"


def undrifted(rig: Plant, name: str, seconds: float, into: Sum, world: str = "free") -> None:
    """Watch a rig whose friction is what was learned: every warning is false, and every fault."""
    _unchanged(*watched(rig.loaded, world, rig.places), name, seconds, into)


def _unchanged(simulation: Simulation, watch: RigWatch, name: str, seconds: float, into: Sum) -> bool:
    """Watch what does not drift; whether there was no fault."""
    (axis,) = watch.axes
    assert axis is not None
    warned = stopped = False
    for _ in range(math.ceil(seconds / CHUNK_S)):
        ticks = simulation.run(CHUNK_S)
        watch.follow(ticks)
        if axis.warning and not warned:
            into.alarms.append(f"FALSE: {name}: {axis.warning}")
        if axis.stopped and not stopped:
            into.stops.append(name)
        warned, stopped = bool(axis.warning), bool(axis.stopped)
        if axis.found is not None:
            into.factors.append(axis.found.factor)
        into.hours += CHUNK_S / 3600.0
        if faulty(ticks, name, into):
            return False
    return True


def faulty(ticks: np.ndarray, name: str, into: Sum) -> bool:
    """Whether there was a fault, which ends it: the motor is off."""
    faults = int(np.bitwise_or.reduce(ticks["faults"]))
    if faults:
        text = f"FAULT: {name}, tick {int(ticks['tick'][0])}: {Fault(faults)!r}"
        (into.of_account if faults & OF_ACCOUNT else into.faults).append(text)
    return bool(faults)


def _drifting(plant: Plant, hand: Hand, name: str, into: Sum) -> None:
    """A tenth less and a tenth more, both from the same motion without drift."""
    simulation, watch = watched(moved(plant.loaded, hand), places=plant.places)
    if not _unchanged(simulation, watch, f"{name}, to drift", WARM_UP_S, into):
        return
    (axis,) = watch.axes
    assert axis is not None
    for factor in (0.9, 1.1):
        text = f"{name}, x {factor:g}"
        if axis.found is None:
            slid_s = axis.strokes.rows / axis.rate_hz
            into.silent.append(f"cannot tell: {text}: {slid_s:.0f} s of sliding in {WARM_UP_S:g} s")
        else:
            drift = [[0.0, factor, 1.0], [1.0, factor, 1.0]]
            other = continued(simulation, moved(plant.loaded, hand, drift))
            _told(other, deepcopy(watch), plant.loaded, factor, text, into)


def _told(
    simulation: Simulation, watch: RigWatch, loaded: LoadedConfig, factor: float, name: str, into: Sum
) -> None:
    """Whether and when a drift is told, and the factor after a minute of motion."""
    (axis,) = watch.axes
    assert axis is not None
    first, strokes = axis.found, axis.strokes.taken
    assert first is not None
    before = first.factor
    moved_s, until_s, velocities = 0.0, simulation.time_s + PATIENCE_S, list[np.ndarray]()
    told: float | None = None
    while moved_s < MOTION_S and simulation.time_s < until_s:
        ticks = simulation.run(CHUNK_S)
        watch.follow(ticks)
        velocities.append(ticks["velocity_rad_s"][:, 0].copy())
        moved_s += CHUNK_S * float((np.abs(velocities[-1]) > MOVING_RAD_S).mean())
        told = moved_s if told is None and axis.warning else told
        if faulty(ticks, name, into):
            break
    strokes = axis.strokes.taken - strokes
    if told is not None:
        into.told.append(told)
    elif strokes < 2 * STROKES_MIN or moved_s < MOTION_S:
        into.silent.append(f"cannot tell: {name}: {strokes} strokes of sliding, {moved_s:.0f} s of motion")
        return
    else:
        now = "nothing" if axis.found is None else f"{axis.found.factor:.3f}"
        into.missed.append(f"MISSED: {name}: {before:.3f} before, {now} after {moved_s:.0f} s of motion")
    if axis.found is not None:
        share = _dry_share(loaded, axis.by, np.concatenate(velocities))
        into.errors.append(abs(axis.found.factor - before * (1.0 + (factor - 1.0) * share)))


def _dry_share(plant: LoadedConfig, by: Deployed, velocity: np.ndarray) -> float:
    """How much of what the model takes for dry friction is dry in truth, as a regression over these
    velocities weighs it.
    """
    pure = [
        {**one["friction"], "viscous_nms_rad": 0.0, "thinning_nms_rad": 0.0} for one in plant.options["axis"]
    ]
    axes = [{**one, "friction": dry} for one, dry in zip(plant.options["axis"], pure, strict=True)]
    alone = plant.model_copy(update={"options": {**plant.options, "axis": axes}})
    v = velocity[np.abs(velocity) > by.speed_min_rad_s][::20]
    model = by.dry_nm(v)
    return float(model @ friction_truth.true_friction_nm(alone, 0, v) / (model @ model))
