"""What is left of the hand's torque on every plant of the mock's family, why, and what could be reached.
`python -m tests.bench.friction_left`.

Beside the default stands an oracle that knows the plant: help that gives the joint's own friction back at the
instant it acts, so much of it, is the joint with the rest of its friction, bristles and all, and no law runs.
Such a joint is passive in every hand. *Told* is the default whose rig file has the plant's own presliding
length F_s/sigma0 and the model of the shipped rig. *Of what*: by the joint's balance along the path it went,
tau_h = J dv/dt + b v + what is left of dry friction; RMS of each part over that of the hand without help,
what is left told apart within `TURN_S` after a turn and later."""

from __future__ import annotations

import argparse
from pathlib import Path

import click
import numpy as np

from rtctl.experiments.statistics import rms
from rtctl.experiments.virtual import FAST_SINE, SLOW_TRIANGLE, Change, Motion, Run, Variant, measure
from rtctl.rig_file.config import Config, LoadedConfig, load
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.family import FAMILY, with_plant

RIG = Path(__file__).parents[2] / "configs" / "mock.toml"
MOTIONS = (FAST_SINE, SLOW_TRIANGLE)
TURN_S = 0.2
PERFECT = (0.95, 0.999)
"""Shares of the friction that the oracle gives back: the shipped gain, and all."""
_DRY = ("coulomb_nm", "breakaway_nm", "bristle_stiffness_nm_rad", "bristle_damping_nms_rad", "bristle_max_nm")
"""Bristles of less friction are as long as they were."""


def with_dry_friction(share: float) -> Change:
    """Leave the joint so much of its dry friction: what a help that knows it makes of it."""

    def change(simulation: Simulation) -> None:
        p = simulation.plant_params
        for name in (
            *_DRY,
            *(one for one in p.dtype.names or () if one.startswith(("load_outside", "load_motor"))),
        ):
            p[name] *= share

    return change


def told(loaded: LoadedConfig) -> LoadedConfig:
    """The rig file with the plant's own presliding length."""
    friction = loaded.options["axis"][0]["friction"]
    table = loaded.config.model_dump(mode="json", by_alias=True)
    table["axis"][0]["friction"]["presliding_rad"] = (
        friction["breakaway_nm"] / friction["bristle_stiffness_nm_rad"]
    )
    return loaded.model_copy(update={"config": Config.model_validate(table)})


def left(loaded: LoadedConfig, motion: Motion, variant: Variant, seeds: int) -> list[Run]:
    """Runs of one controller."""
    return [measure(loaded, seed, motion, variant) for seed in range(seeds)]


def parts(run: Run) -> np.ndarray:
    """RMS of inertia, viscous part, and what is left of dry friction: in turns and later; N m."""
    p = run.simulation.params[0]
    T, v = run.simulation.plan.period_s, run.truth["velocity_rad_s"][:, 0]
    moved, viscous = p["inertia_kgm2"][0] * np.gradient(v, T), p["viscous_nms_rad"][0] * v
    rest = run.truth["hand_torque_nm"][:, 0] - moved - viscous
    turned = np.flatnonzero(np.diff(np.sign(v)) != 0)
    since = np.arange(len(v)) - turned[np.maximum(np.searchsorted(turned, np.arange(len(v))) - 1, 0)]
    turns = np.abs(since) * T < TURN_S
    return np.array([rms(one) for one in (moved, viscous, rest * turns, rest * ~turns)])


def row(plant: str, seeds: int) -> str:
    """One line of the table: of each controller sine / triangle in %, then the parts of both."""
    loaded = with_plant(load(RIG), plant)
    default = Variant("default")
    asked = [(loaded, default), (told(loaded), default)]
    asked += [(loaded, Variant("oracle", 0.0, with_dry_friction(1 - share))) for share in PERFECT]
    cells: list[list[str]] = [[] for _ in asked]
    why = []
    for motion in MOTIONS:
        off = [rms(one.truth["hand_torque_nm"]) for one in left(loaded, motion, Variant("off", 0.0), seeds)]
        for at, (rig, variant) in enumerate(asked):
            runs = left(rig, motion, variant, seeds)
            shares = [
                rms(one.truth["hand_torque_nm"]) / without for one, without in zip(runs, off, strict=True)
            ]
            cells[at].append(f"{100 * np.mean(shares):.1f}")
            if at == 0:
                of = np.mean([parts(one) / without for one, without in zip(runs, off, strict=True)], axis=0)
                why.append(" ".join(f"{100 * part:.1f}" for part in of))
    return f"| {plant} | " + " | ".join([" / ".join(one) for one in cells] + why) + " |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--plant", nargs="+", choices=FAMILY, default=list(FAMILY))
    asked = parser.parse_args()
    oracles = " | ".join(f"{share:g} given back" for share in PERFECT)
    click.echo(f"| plant | default | told | {oracles} | sine: inertia, viscous, turns, later | triangle |")
    click.echo("|---|---|---|---|---|---|---|")
    for plant in asked.plant:
        click.echo(row(plant, asked.seeds))


if __name__ == "__main__":
    main()
