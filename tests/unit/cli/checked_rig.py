"""A rig file with a model, written with the changes a test asks for."""

from functools import cache

import numpy as np

from rtctl.check.stability_report import examine
from rtctl.friction import artefact
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.points import FrictionPoints
from rtctl.rig_file.config import load

RIG = """
schema = 1
[rig]
name = "bench"
[[axis]]
name = "joint"
inertia_kgm2 = 0.012
viscous_nms_rad = 0.05
encoder_counts_per_rev = 160000
torque_constant_nm_a = 0.0134
gear_ratio = 80.0
lever_m = [0.0, 0.1, 0.0]
torque_limit_nm = 2.0
torque_rate_nm_s = 200.0
velocity_limit_rad_s = {limit}
[axis.coupling]
stiffness_nm_rad = {k_c}
damping_nms_rad = {b_c}
delay_ticks = {d}
[axis.environment]
kind = "spring"
stiffness_nm_rad = 40.0
[axis.friction]
model = "{model}"
gain = {gain}
policy = "{policy}"
drift_nm = {drift}
[[device]]
kind = "mock"
"""


DEFAULTS = {
    "k_c": 60.0,
    "b_c": 0.01,
    "d": 0,
    "model": "",
    "gain": 0.9,
    "policy": "hybrid",
    "drift": 0.0,
    "limit": 2.0,
}


@cache
def learned():
    """A model of 0.25 to 0.35 N m with a Stribeck peak, fitted once."""
    v = np.concatenate([[0.0], np.geomspace(0.01, 2, 60)])
    rows = [(s * x, 0.25 + 0.1 * np.exp(-((x / 0.1) ** 2)) + 0.05 * x, s, 0, 1) for s in (1, -1) for x in v]
    points = FrictionPoints.from_rows(rows, "p.csv", "0" * 64)
    return fit_points(points, rig="bench", epsilon_nm=1e-4, c=1e4)


def writer(folder, model):
    """Writes the rig file with changes into `folder`, beside the model; returns its path."""
    artefact.save(model, folder / "model.json")

    def write(**changes):
        path = folder / "rig.toml"
        path.write_text(RIG.format(**(DEFAULTS | changes)))
        return path

    return write


def rows_of(path):
    return {row.name: row for row in examine(load(path)).axes[0].verdicts}


def edited(path, *changes):
    text = path.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text)
    return path
