"""What `rtctl identify` measures of joints that are hard to turn evenly: `python -m
tests.bench.difficult_joints`.

`configs/mock-identify.toml` with one thing changed each, 14 speeds each way, 40 measurements. Prints the
table of docs/identify.md: largest error of a moving point and error of break-away, shares of the true
friction, and what was left out."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import click
import numpy as np
from click.testing import CliRunner

from rtctl.cli import cli
from rtctl.friction.point_reader import read_points
from rtctl.rig_file.config import load
from rtctl.simulation.friction_truth import true_friction_nm

CONFIG = Path(__file__).parents[2] / "configs" / "mock-identify.toml"
STRIBECK = {"stribeck_rad_s = 0.06 ": "stribeck_rad_s = 0.01 ", "second_share = 0.5 ": "second_share = 0.0 "}
STICTION = {"coulomb_nm = 0.25 ": "coulomb_nm = 0.35 ", "breakaway_nm = 0.35 ": "breakaway_nm = 0.6 "}
RIPPLE = {"ripple_nm = 0.003 ": "ripple_nm = 0.03 "}
STIFF = {
    'model = "lugre" ': 'model = "elasto_plastic" ',
    "bristle_stiffness_nm_rad = 250.0": "bristle_stiffness_nm_rad = 2000.0",
}
JOINTS = {
    "Stribeck speed .01 rad/s, one Stribeck speed": STRIBECK,
    "F_s .6, F_c .35 N m": STICTION,
    "both": STRIBECK | STICTION,
    "ripple 30 mN m": RIPPLE,
    "ripple 30 mN m, F_s .6, F_c .35": RIPPLE | STICTION,
    "elasto-plastic, sigma0 2000": STIFF,
}
"""Change as the document calls it -> text of the rig file -> other text."""


def row(name: str, changes: dict[str, str], folder: Path) -> str:
    """Identify one joint, and say what came of it."""
    text = CONFIG.read_text()
    for before, after in changes.items():
        assert text.count(before) == 1, before
        text = text.replace(before, after)
    path = folder / "rig.toml"
    path.write_text(text)
    words = ["--simulate", "--train", "14", "--test", "0", "--measurements", "40", "--json"]
    done = CliRunner().invoke(cli, ["identify", str(path), "--out", str(folder / "set"), *words])
    if done.exit_code:
        return f"| {name} | {done.output.strip()[-200:]} | | |"
    points = read_points(folder / "set" / "points_train.csv")
    true_nm = np.abs(true_friction_nm(load(path), 0, points.velocity_rad_s))
    moving = points.velocity_rad_s != 0
    off = 100 * (points.friction_nm / true_nm - 1)
    slowest = np.abs(points.velocity_rad_s[moving]).min()
    at_rest = max((100 * one["break_away_share"] for one in json.loads(done.stdout)["truth"]), key=abs)
    skipped = json.loads((folder / "set" / "dataset.json").read_text())["skipped"]
    left_out = ", ".join(one["name"] for one in skipped) or "0"
    return (
        f"| {name} | {np.abs(off[moving]).max():.2g} %, down to {slowest:.3g} rad/s | {at_rest:+.2g} % | "
        f"{left_out} |"
    )


@click.command()
def main() -> None:
    """Print the table."""
    click.echo("| change | moving points | break-away | left out |\n|---|---|---|---|")
    for name, changes in JOINTS.items():
        with tempfile.TemporaryDirectory() as folder:
            click.echo(row(name, changes, Path(folder)))


if __name__ == "__main__":
    main()
