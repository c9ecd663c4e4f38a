"""A simulated joint's friction learned by place, as a lab does it: `rtctl identify --sweep`, then
`rtctl fit --places --sweep`.
"""

from __future__ import annotations

import math
from pathlib import Path

from rtctl.cli.fit_places import learn, read
from rtctl.experiments.simulated_identification import drive
from rtctl.friction import artefact
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.learn.point_evidence import with_evidence
from rtctl.friction.point_reader import read_points
from rtctl.identify.dataset import Dataset
from rtctl.identify.session import identify
from rtctl.identify.settings import Settings, rig_of, without_feedforward
from rtctl.rig_file.config import LoadedConfig
from rtctl.simulation.closed_loop import Simulation

SETTINGS = Settings(train_levels=20, test_levels=0, measurements=40, warm_up_s=5.0, sweep_rad_s=0.1)
"""Fewer speeds and measurements than a rig is given: 20 s of a core instead of 90."""


def learned_by_place(free: LoadedConfig, plant: LoadedConfig, folder: Path) -> LoadedConfig:
    """`plant` with a model by place, in a rig file that says that the encoder is absolute; `free` is the same
    with nobody at its handle.
    """
    bare = without_feedforward(free)
    rig = rig_of(bare, SETTINGS)
    data = Dataset.create(folder / "set", bare, SETTINGS, simulated=True)
    drive(
        Simulation(bare),
        identify(rig, SETTINGS, data, lambda *_: None, lambda *_: None),
        rig.axis,
        data.ticks,
    )
    measured = read_points(folder / "set" / "points_train.csv")
    model = fit_points(measured, rig=plant.config.rig.name)
    places, sweep = (folder / "set" / name for name in ("points_places.csv", "points_sweep.csv"))
    gear_ratio = float(plant.config.hardware().gear_ratio[0])
    over = read(places, sweep, "rotary", 2 * math.pi)
    model, _, _ = learn(model, over, 2 * math.pi / gear_ratio)
    path = folder / "by-place.json"
    artefact.save(with_evidence(model, measured), path)
    axis = plant.config.axis[0]
    friction = axis.friction.model_copy(update={"model": str(path), "place": "given"})
    changed = axis.model_copy(update={"friction": friction})
    return replace_axis(plant, changed)


def replace_axis(loaded: LoadedConfig, axis: object) -> LoadedConfig:
    """The rig with this axis as its only one."""
    return loaded.model_copy(update={"config": loaded.config.model_copy(update={"axis": (axis,)})})
