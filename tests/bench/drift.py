"""False alarms and missed drifts of the watch over the friction: every plant of the mock's family, moved as people move.

Each plant has a model of its own, measured on it as a lab does (the one with a slow device: that of the same joint with a quick one). Half of the time nothing drifts: every warning is false. Then dry
friction changes by a tenth, and what counts is the motion until that is told, and the factor after a minute of motion.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hw import registry
from hw.mock.family import FAMILY
from rtctl.friction import artefact, truth
from rtctl.friction.drift_deployed import Deployed
from rtctl.friction.drift_watch import RigWatch
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.learn.point_evidence import with_evidence
from rtctl.friction.points import mock as mock_points
from rtctl.friction.points.reader import read_points
from rtctl.rig_file.config import LoadedConfig, load
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.family import with_plant
from tests.bench.learned_by_place import learned_by_place
from tests.bench.row import Row

Hand = Mapping[str, Any]

MOTIONS: Mapping[str, Hand] = {
    "swing": {"kind": "sine", "amplitude_rad": 0.3, "frequency_hz": 0.5},
    "to and fro": {"kind": "triangle", "amplitude_rad": 0.3, "speed_rad_s": 0.2},
    "slowly": {"kind": "triangle", "amplitude_rad": 0.1, "speed_rad_s": 0.05},
    "exploring": {"kind": "sines", "sines": [[0.2, 0.23], [0.1, 0.61], [0.05, 1.37], [0.01, 2.9]]},
    "wiggling": {"kind": "sines", "sines": [[0.03, 1.7], [0.012, 2.9], [0.05, 0.13]]},
    "trembling": {"kind": "sines", "sines": [[0.008, 1.1], [0.004, 2.3], [0.001, 9.0]]},
    "pushing": {"kind": "push", "amplitude_rad": 0.4, "speed_rad_s": 0.5, "hold_s": 0.4, "rest_s": 0.3},
    "firmly": {
        "kind": "sine",
        "amplitude_rad": 0.2,
        "frequency_hz": 1.2,
        "stiffness_nm_rad": 40.0,
        "damping_nms_rad": 0.3,
    },
}

LOADED = "load-dependent"
"""Its friction grows with the hand's own torque: what is told of it is no false alarm, and is counted by itself."""

LOCAL = "harmonic-drive"
"""Its friction differs by 18 % over the turn, and a hand works at one place: watched by speed alone the factor is that of the place."""

BY_PLACE = f"{LOCAL}, by place"
"""The same with a model by place, and an encoder that knows it."""

DRIFTED = "drifted"
CHUNK_S = 2.0
MOVING_RAD_S = 0.03
WARM_UP_S = 120.0
MOTION_S = 60.0


@dataclass
class Sum:
    """What was seen so far: hours watched, false warnings and STOPs, factors, and of drifts how soon they were told."""

    hours: float = 0.0
    alarms: list[str] = field(default_factory=list)
    stops: list[str] = field(default_factory=list)
    factors: list[float] = field(default_factory=list)
    told: list[float] = field(default_factory=list)
    missed: list[str] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    silent: list[str] = field(default_factory=list)


def rows(config: Path, minutes: float, say: Callable[[str], None] = lambda _text: None) -> list[Row]:
    """Watch `minutes` of motion without drift in all, then a tenth more and less on each plant and motion."""
    names = [name for name in FAMILY if name != DRIFTED] + [BY_PLACE]
    seconds = 60.0 * minutes / (len(names) * len(MOTIONS))
    quiet, load_sum, local = Sum(), Sum(), Sum()
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            plant = _plant(load(config), name, Path(folder))
            into = {LOADED: load_sum, LOCAL: local}.get(name, quiet)
            for motion, hand in MOTIONS.items():
                undrifted(moved(plant, hand), f"{name}, {motion}", seconds, into)
                if name != LOADED:
                    for factor in (0.9, 1.1):
                        about = f"{name}, {motion}, x {factor:g}"
                        _drifting(plant, hand, about, factor, local if name == LOCAL else quiet)
            say(f"{name}: {len(into.alarms)} alarms so far, factors {_range(into.factors)}")
    for text in (*quiet.alarms, *quiet.missed, *quiet.silent, *local.alarms, *local.missed):
        say(text)
    return _figures(quiet, load_sum, local)


def _figures(quiet: Sum, load_sum: Sum, local: Sum) -> list[Row]:
    hours = quiet.hours + local.hours
    beside = f"{hours:.1f} h simulated"
    drifts = f"{len(quiet.told) + len(quiet.missed)} drifts of a tenth"

    def row(name: str, value: float, unit: str, against: str, target: float | None = None) -> Row:
        return Row(f"friction drift: {name}", value, unit, against, target)

    return [
        row("false warnings", float(len(quiet.alarms) + len(local.alarms)), "1", beside, 0.0),
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


def _plant(loaded: LoadedConfig, name: str, folder: Path) -> LoadedConfig:
    """The plant with a model of its own; a servo at a slow device rings, and the shipped model is of this very friction."""
    if name == BY_PLACE:
        plant = with_plant(loaded, LOCAL)
        return learned_by_place(moved(plant, {"kind": "none"}), plant, folder)
    plant = with_plant(loaded, name)
    return plant if FAMILY[name].device else _learned(plant, folder)


def _learned(loaded: LoadedConfig, folder: Path) -> LoadedConfig:
    """The plant with a model that was measured on it."""
    points = folder / "points.csv"
    mock_points.write_csv(mock_points.measure(loaded, levels=24, measurements=16), points)
    measured = read_points(points)
    model = with_evidence(fit_points(measured, rig=loaded.config.rig.name, epsilon_nm=0.002), measured)
    path = folder / "model.json"
    artefact.save(model, path)
    axis = loaded.config.axis[0]
    friction = axis.friction.model_copy(update={"model": str(path)})
    changed = axis.model_copy(update={"friction": friction})
    return loaded.model_copy(update={"config": loaded.config.model_copy(update={"axis": (changed,)})})


def moved(loaded: LoadedConfig, hand: Hand, drift: list[list[float]] | None = None) -> LoadedConfig:
    """The rig in another hand; `drift`: time (s), factors of dry and viscous friction."""
    options = {**loaded.options, "hand": [{**one, **hand} for one in loaded.options["hand"]]}
    if drift is not None:
        options["axis"] = [{**one, "drift": {"points": drift}} for one in options["axis"]]
    checked = registry.options_model("mock").model_validate(options, context={"n_axes": 1})
    return loaded.model_copy(update={"options": checked.model_dump(mode="json")})


def _watched(loaded: LoadedConfig) -> tuple[Simulation, RigWatch]:
    simulation = Simulation(loaded)
    watch = RigWatch(
        simulation.plan.params, simulation.plan.model, [axis.friction.drift for axis in loaded.config.axis]
    )
    watch.follow(simulation.arm(compensation=1.0))
    return simulation, watch


def undrifted(loaded: LoadedConfig, name: str, seconds: float, into: Sum) -> None:
    """Watch a rig whose friction is what was learned: every warning is false."""
    simulation, watch = _watched(loaded)
    (axis,) = watch.axes
    assert axis is not None
    warned = stopped = False
    for _ in range(math.ceil(seconds / CHUNK_S)):
        watch.follow(simulation.run(CHUNK_S))
        if axis.warning and not warned:
            into.alarms.append(f"FALSE: {name}: {axis.warning}")
        if axis.stopped and not stopped:
            into.stops.append(name)
        warned, stopped = bool(axis.warning), bool(axis.stopped)
        if axis.found is not None:
            into.factors.append(axis.found.factor)
    into.hours += seconds / 3600.0


def _drifting(plant: LoadedConfig, hand: Hand, name: str, factor: float, into: Sum) -> None:
    points = [[0.0, 1.0, 1.0], [WARM_UP_S, 1.0, 1.0], [WARM_UP_S + 0.01, factor, 1.0]]
    simulation, watch = _watched(moved(plant, hand, points))
    (axis,) = watch.axes
    assert axis is not None
    while simulation.time_s < WARM_UP_S:
        watch.follow(simulation.run(CHUNK_S))
    if axis.found is None:
        into.silent.append(
            f"cannot tell: {name}: {axis.strokes.rows / axis.rate_hz:.0f} s of sliding in {WARM_UP_S:g} s"
        )
        return
    before, moved_s, velocities = axis.found.factor, 0.0, list[np.ndarray]()
    told: float | None = None
    for _ in range(round(5 * MOTION_S / CHUNK_S)):
        ticks = simulation.run(CHUNK_S)
        watch.follow(ticks)
        velocities.append(ticks["velocity_rad_s"][:, 0].copy())
        moved_s += CHUNK_S * float((np.abs(velocities[-1]) > MOVING_RAD_S).mean())
        told = moved_s if told is None and axis.warning else told
        if moved_s >= MOTION_S:
            break
    wanted = before * (1.0 + (factor - 1.0) * _dry_share(plant, axis.by, np.concatenate(velocities)))
    into.errors.append(abs(axis.found.factor - wanted))
    if told is None:
        into.missed.append(
            f"MISSED: {name}: {before:.3f} before, {axis.found.factor:.3f} after {moved_s:.0f} s of motion"
        )
    else:
        into.told.append(told)


def _dry_share(plant: LoadedConfig, by: Deployed, velocity: np.ndarray) -> float:
    """How much of what the model takes for dry friction is dry in truth, as a regression over these velocities weighs it."""
    pure = [
        {**one["friction"], "viscous_nms_rad": 0.0, "thinning_nms_rad": 0.0} for one in plant.options["axis"]
    ]
    axes = [{**one, "friction": dry} for one, dry in zip(plant.options["axis"], pure, strict=True)]
    alone = plant.model_copy(update={"options": {**plant.options, "axis": axes}})
    v = velocity[np.abs(velocity) > by.speed_min_rad_s][::20]
    model = by.dry_nm(v)
    return float(model @ truth.true_friction_nm(alone, 0, v) / (model @ model))
