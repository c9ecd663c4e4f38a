"""What `identify` says of an engine's joints beside what the engine was given, and models learned from it.
`python tests/foreign_engine/identified.py --engine dart --out FOLDER` (decision 0181).

The procedure of `rtctl identify` on the compiled law, as `--simulate` runs it; the models are for
`left.py --models FOLDER`.
"""

import argparse
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import click
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from foreign_files import rig_file

from foreign_engine import plants, rig
from foreign_engine.engines import ROWS
from foreign_engine.left import JOINTS
from rtctl.control.jit import records
from rtctl.experiments.simulated_identification import drive
from rtctl.identify.dataset import Dataset
from rtctl.identify.session import identify
from rtctl.identify.settings import rig_of, settings_of
from rtctl.tick import new_ticks


class Driven:
    """A rig as `drive` wants it."""

    def __init__(self, one):
        self.one, self.command = one, one.law[3]

    def run(self, seconds, **fields):
        """Ticks, after a command with these fields."""
        for name, value in fields.items():
            self.command[name][0] = value
        self.command["seq"] += bool(fields)
        trace = records(new_ticks(max(1, round(seconds / self.one.period_s)), 1))
        self.one.run(len(trace) * self.one.period_s, trace)
        return trace


def says_of(joint):
    """What a rig file says of a joint; its viscous friction is said right."""
    dry, says = joint.dry + joint.link_dry, {}
    if joint.link:
        both = 1 / joint.motor + 1 / joint.link
        says["drive"] = {"resonance_hz": float(np.sqrt(joint.gear * both)) / (2 * np.pi)}
    return says | {
        "inertia_kgm2": joint.motor + joint.link, "viscous_nms_rad": joint.viscous + joint.link_viscous,
        "torque_limit_nm": 8 * dry,
    }  # fmt: skip


def identified(joint, device, folder, **options):
    """Points of both directions, those of break-away at speed 0, as `dataset.json` has them."""
    loaded = rig_file("mock-identify.toml", [says_of(joint)], folder)
    settings = settings_of(loaded, options)
    of = rig_of(loaded, settings)
    made = Dataset.create(Path(folder) / "set", loaded, settings, simulated=True)
    one = Driven(rig.Rig(loaded, joint, plants.Hand("nobody"), plants.World(), device))
    drive(one, identify(of, settings, made, lambda *_: None, partial(click.echo, err=True)), 0, made.ticks)
    return made.document["points"]


def row(name, joint, points):
    """Dry and viscous friction by a line through the points that move, and what the ramps say."""
    moving = [one for one in points if one["target_rad_s"]]
    speed = np.abs([one["velocity_rad_s"] for one in moving])
    torque = np.abs([one["friction_torque_nm"] for one in moving])
    viscous, dry = np.polyfit(speed, torque, 1)
    off = torque - (dry + viscous * speed)
    ramps = [one for one in points if not one["target_rad_s"]]
    away = np.mean(np.abs([one["friction_torque_nm"] for one in ramps]))
    lengths = [(one["presliding_rad"], one["presliding_spread_rad"]) for one in ramps]
    given_dry, given_viscous = joint.dry + joint.link_dry, joint.viscous + joint.link_viscous
    return (
        f"| {name} | {len(points)} | {dry:.4f} / {given_dry:g} | {viscous:.4f} / {given_viscous:g} | "
        f"{1e3 * np.abs(off).max():.2f} | {away:.4f} | {lengths} |"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--engine", choices=ROWS, default="mujoco")
    parser.add_argument("--joint", nargs="+", choices=JOINTS, default=list(JOINTS))
    parser.add_argument("--step", type=float, default=2.5e-4, help="of the engine, s")
    parser.add_argument("--train", type=int, default=14, help="speeds each way")
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    device = plants.Device(force_noise=0.005, step_s=asked.step, engine=asked.engine)
    click.echo("| joint | points | dry, given | viscous, given | off, mN m | break-away | presliding, rad |")
    for name in asked.joint:
        with tempfile.TemporaryDirectory() as folder:
            points = identified(
                JOINTS[name], device, folder, train_levels=asked.train, test_levels=2, measurements=40
            )
            click.echo(row(name, JOINTS[name], points))
            subprocess.run(
                [sys.executable, "-m", "rtctl", "fit", f"{folder}/set/points_train.csv", "--rig", "mock",
                "--out", asked.out / f"{name}.json"],
                check=True, stdout=subprocess.DEVNULL,
            )  # fmt: skip


if __name__ == "__main__":
    main()
