"""Friction that a hand is left with under load, with and without load in the law:
`python -m tests.bench.load_in_law`.

The joint's friction grows with its load. It has two models: one as a lab measures it, unloaded; and one of
points under weights, whose curve is that without load and which carries the load's coefficients
(`rtctl fit --by-load`). A firm hand moves the joint freely, against a spring, and under a torque that hardly
changes (a weak spring far away). Friction left is hand's torque plus coupling's less inertia; the share is of
what compensation off leaves.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np

from hw.simulators.mock_records import Hand
from rtctl.check.stability_report import examine
from rtctl.check.verdict import Outcome
from rtctl.control.vocabulary import State
from rtctl.friction import artefact
from rtctl.friction.gain import of_axis
from rtctl.friction.learn import beside_speed
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.learn.point_evidence import with_evidence
from rtctl.friction.learn.unloaded import load_of, without_load
from rtctl.friction.model import FrictionModel
from rtctl.friction.point_reader import read_points
from rtctl.friction.points import FrictionPoints
from rtctl.rig_file.axis_tables import AxisTable
from rtctl.rig_file.config import LoadedConfig, load
from rtctl.simulation import campaign_still_cases, mock_points
from rtctl.simulation.campaign_still import QUIET_RAD_S
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.family import merged, with_plant
from tests.bench.drift_plants import moved
from tests.bench.load_on_mock import SHIPPED, points

WORLDS: Mapping[str, Mapping[str, Any]] = {
    "free": {"kind": "free"},
    "spring of 1 N m/rad": {"kind": "spring", "stiffness_nm_rad": 1.0, "center_rad": 0.0},
    "load of .5 N m": {"kind": "spring", "stiffness_nm_rad": 0.05, "center_rad": -10.0},
    "load of 1 N m": {"kind": "spring", "stiffness_nm_rad": 0.1, "center_rad": -10.0},
}

MOTIONS: Mapping[str, Mapping[str, Any]] = {
    "sine": {"kind": "sine", "amplitude_rad": 0.3, "frequency_hz": 0.5},
    "triangle": {"kind": "triangle", "amplitude_rad": 0.3, "speed_rad_s": 0.1},
}

INTENT_NM = 0.12
"""Where the largest help over the mass of a hand is proved not to buzz."""

LOAD_GAIN = 0.9

FIRM = {"stiffness_nm_rad": 40.0, "damping_nms_rad": 0.3}

COUPLING = {"stiffness_nm_rad": 10.0, "damping_nms_rad": 0.01}
"""Soft, so that what bounds the gain is what the models know, not the coupling."""


def learned(folder: Path) -> dict[str, Path]:
    """Model files by name, each measured on the plant."""
    plant = with_plant(load(SHIPPED), "load-dependent")
    csv = folder / "points.csv"
    mock_points.write_csv(mock_points.measure(plant, levels=24, measurements=16), csv)
    unloaded = read_points(csv)
    rig = plant.config.rig.name
    plain = with_evidence(fit_points(unloaded, rig=rig, epsilon_nm=0.002), unloaded)
    found = {"plain": folder / "plain.json", "by load": folder / "by_load.json"}
    artefact.save(plain, found["plain"])
    artefact.save(by_load(points(plant), rig, plain.presliding_rad), found["by load"])
    return found


def by_load(under_weights: FrictionPoints, rig: str, presliding_rad: float | None) -> FrictionModel:
    """The model of points under weights."""
    part = load_of(under_weights, beside_speed.judge_load(under_weights, "speed"))
    apart = without_load(under_weights, part)
    model = with_evidence(fit_points(apart, rig=rig, epsilon_nm=0.002), apart, presliding_rad)
    return replace(model, load=part)


def rig(
    model: Path, load_gain: float, world: Mapping[str, Any], hand: Mapping[str, Any], observer_gain: float
) -> LoadedConfig:
    """The plant with a model, a world and a hand."""
    plant = with_plant(load(SHIPPED), "load-dependent")
    axis = plant.config.axis[0]
    friction = axis.friction
    observer = friction.observer.model_copy(update={"gain": observer_gain})
    update = {"model": str(model), "load_gain": load_gain, "observer": observer, "intent_nm": INTENT_NM}
    update["gain"] = gain_of(artefact.load(model), axis, plant.config.period_s)
    changed = axis.model_copy(
        update={
            "friction": friction.model_copy(update=update),
            "environment": axis.environment.model_copy(update=dict(world)),
            "coupling": axis.coupling.model_copy(update=COUPLING),
        }
    )
    config = plant.config.model_copy(update={"axis": (changed,)})
    return moved(plant.model_copy(update={"config": config}), {**FIRM, **hand})


def gain_of(model: FrictionModel, axis: AxisTable, period_s: float) -> float:
    """Largest gain, to a hundredth below it, that leaves the damping which the coupling is proved with."""
    coupling = axis.coupling.model_copy(update=COUPLING)
    table = axis.model_copy(update={"coupling": coupling})
    return math.floor(100 * of_axis(model, table, period_s).gain_sampled_data) / 100


def left_nm(loaded: LoadedConfig, compensation: float) -> float:
    """RMS of the friction that the hand is left with over 12 s of its motion, N m; NaN where a fault stopped
    the run.
    """
    simulation = Simulation(loaded)
    simulation.arm(compensation=compensation)
    simulation.run(4.0)
    trace = simulation.run(12.0)
    if not (trace["state"] == int(State.ACTIVE)).all():
        return math.nan
    truth, axis = simulation.truth, loaded.config.axis[0]
    acceleration = np.gradient(truth["velocity_rad_s"][:, 0], loaded.config.period_s)
    rest = (
        truth["hand_torque_nm"][:, 0] + trace["coupling_torque_nm"][:, 0] - axis.inertia_kgm2 * acceleration
    )
    return float(np.sqrt(np.mean(rest**2)))


def shaken_rad_s(case: campaign_still_cases.Case, model: Path, load_gain: float) -> float:
    """RMS speed two to five seconds after a drawn hand has begun to hold still, rad/s; 0 where a fault
    stopped the run.
    """
    world = list(WORLDS.values())[case.index % len(WORLDS)]
    hand = {
        "kind": "sine",
        "stiffness_nm_rad": case.hand_stiffness_nm_rad,
        "damping_nms_rad": case.hand_damping_nms_rad,
        "inertia_kgm2": case.hand_inertia_kgm2,
        "amplitude_rad": case.amplitude_rad,
        "frequency_hz": 1 / campaign_still_cases.PERIOD_S,
    }
    loaded = rig(model, load_gain, world, hand, 0.9 if case.index % 8 < 4 else 0.0)
    axis, options = loaded.config.axis[0], dict(loaded.options)
    own = options["axis"][0]
    bristles = {
        "model": case.model,
        "bristle_stiffness_nm_rad": case.bristle_stiffness_nm_rad,
        "bristle_damping_nms_rad": case.bristle_damping_nms_rad,
    }
    options["axis"] = [merged(own, {"friction": bristles})]
    told = {"presliding_rad": own["friction"]["breakaway_nm"] / case.bristle_stiffness_nm_rad}
    axis = axis.model_copy(update={"friction": axis.friction.model_copy(update=told)})
    config = loaded.config.model_copy(update={"axis": (axis,)})
    simulation = Simulation(loaded.model_copy(update={"config": config, "options": options}))
    simulation.arm(compensation=1.0)
    p = simulation.plant_params
    begin_s = float(p["hand_start_s"][0, 0])
    moved_s = begin_s + campaign_still_cases.PERIODS * campaign_still_cases.PERIOD_S
    while moved_s <= simulation.time_s:
        moved_s += campaign_still_cases.PERIOD_S
    simulation.run(moved_s - simulation.time_s)
    p["hand_kind"] = int(Hand.REST)
    simulation.run(2.0)
    trace = simulation.run(3.0)
    if not (trace["state"] == int(State.ACTIVE)).all():
        return 0.0
    return float(np.sqrt(np.mean(simulation.truth["velocity_rad_s"][:, 0] ** 2)))


@click.command()
@click.option("--hands", type=int, default=0, help="drawn hands that hold still, in place of the table")
@click.option("--folder", type=click.Path(path_type=Path), required=True, help="where the models are kept")
def main(folder: Path, hands: int) -> None:
    """Print the shares left, or how many hands are shaken."""
    folder.mkdir(parents=True, exist_ok=True)
    models = {"plain": folder / "plain.json", "by load": folder / "by_load.json"}
    if not all(path.is_file() for path in models.values()):
        models = learned(folder)
    for load_gain in (0.0, LOAD_GAIN) if hands else ():
        cases = [campaign_still_cases.drawn(17, index) for index in range(hands)]
        # no hand without stiffness holds a joint still against a load
        cases = [one for one in cases if one.hand_stiffness_nm_rad > 0 or one.index % len(WORLDS) < 2]
        speeds = [shaken_rad_s(case, models["by load"], load_gain) for case in cases]
        shaken = [case.index for case, speed in zip(cases, speeds, strict=True) if speed > QUIET_RAD_S]
        click.echo(
            f"load_gain {load_gain}: {len(shaken)} of {len(cases)} shaken, worst {max(speeds):.4f} rad/s "
            f"{shaken}"
        )
    if hands:
        return
    for name, gain in (("plain", 0.0), ("by load", LOAD_GAIN)):
        made = rig(models[name], gain, WORLDS["free"], MOTIONS["sine"], 0.9)
        worst = [row for row in examine(made).verdicts if row.outcome == Outcome.FAIL]
        gain = made.config.axis[0].friction.gain
        click.echo(f"{name}: gain {gain}, check fails: {[row.name for row in worst] or 'nothing'}")
    click.echo(f"{'world, motion, observer':44}{'off, mN m':>12}{'plain':>10}{'by load':>10}")
    for world, table in WORLDS.items():
        for motion, hand in MOTIONS.items():
            for observer in (0.0, 0.9):
                off = left_nm(rig(models["plain"], 0.0, table, hand, observer), 0.0)
                plain = left_nm(rig(models["plain"], 0.0, table, hand, observer), 1.0)
                loaded = left_nm(rig(models["by load"], LOAD_GAIN, table, hand, observer), 1.0)
                told = f"{world}, {motion}, {'observer' if observer else 'alone'}"
                click.echo(f"{told:44}{1e3 * off:12.1f}{plain / off:10.3f}{loaded / off:10.3f}")


if __name__ == "__main__":
    main()
