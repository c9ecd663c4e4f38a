"""What `rtctl campaign --admittance` runs, as it is drawn: rigs that `rtctl check` certifies, hands and
worlds of their box."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np

from rtctl.check import stability_report
from rtctl.control.environments.table import Environment
from rtctl.control.proofs import admittance_help, admittance_margin, admittance_sticking
from rtctl.control.proofs.admittance_loop import AdmittanceLoop
from rtctl.control.proofs.less_late import quicker_sensors
from rtctl.rig_file.config import Config, LoadedConfig
from rtctl.simulation.campaign_draws import log_uniform
from rtctl.simulation.family import FAMILY, shipped_rig, with_plant

PAIRS = 20
"""Hands in worlds, of each rig."""


_FIRST_HAND_STREAM = 1001
_SENSOR_STREAM = 31
"""Draws of the force sensor: the rigs are otherwise those of earlier campaigns."""

TRIES = 60
"""Rigs drawn until one is certified; then the index is left out."""
_WORLDS = (Environment.FREE, Environment.SPRING, Environment.WALL, Environment.DAMPER, Environment.DETENTS)


@dataclass(frozen=True)
class Rig:
    """A certified rig. Units as in a rig file."""

    index: int
    plant: str
    friction: float
    """Share of the plant's dry friction. All of it is helped with; less is what no model is told of."""
    loaded: LoadedConfig = field(repr=False)
    loop: AdmittanceLoop = field(repr=False)
    refused: int = 0
    """Rigs drawn before that the certificate refused or did not prove."""
    calmed: bool = False
    """Refused as drawn, since it rang where the joint sticks, and given the `rest_damping_nms_rad` that the
    refusal names."""

    @property
    def compensation(self) -> float:
        """Help with friction that the hand asks for, 0 or 1."""
        return float(self.friction == 1.0)


@dataclass(frozen=True)
class Pair:
    """One hand in one world."""

    stiffness_nm_rad: float
    damping_nms_rad: float
    inertia_kgm2: float
    world: Environment
    world_stiffness_nm_rad: float
    world_damping_nms_rad: float


@cache
def _with(plant: str) -> LoadedConfig:
    return with_plant(shipped_rig("mock.toml"), plant)


def _sensor(seed: int, index: int) -> dict[str, Any]:
    """The force sensor's own filter, of rig `index`: none of half of them."""
    draw = np.random.default_rng((seed, index, _SENSOR_STREAM))
    # drawn in any case: the stream stays in step
    lowpass_hz = float(draw.choice([0.0, log_uniform(draw, 30.0, 1000.0)]))
    return {"lowpass_hz": lowpass_hz, "delay_ticks": int(draw.choice([0, 0, 1, 2, 4]))}


def _loaded(plant: str, sensor: dict[str, Any], draw: np.random.Generator) -> LoadedConfig:
    """The shipped rig with this plant and force sensor, at random numbers."""
    base = _with(plant)
    table = base.config.model_dump(mode="json", by_alias=True)
    axis: dict[str, Any] = table["axis"][0]
    inertia = float(axis["inertia_kgm2"])
    # of a feedback the certificate knows nothing
    axis["display"], axis["force_feedback"]["gain"] = "admittance", 0.0
    axis["admittance"] |= {
        "mass_kgm2": inertia * log_uniform(draw, 0.4, 6.0),
        "mass_max_kgm2": 0.0,
        "damping_nms_rad": log_uniform(draw, 0.03, 1.5),
        "damping_max_nms_rad": 0.0,
        "velocity_gain_nms_rad": log_uniform(draw, 0.5, 6.0),
        "position_gain_nm_rad": float(draw.choice([0.0, log_uniform(draw, 1.0, 40.0)])),
        "force_lowpass_hz": log_uniform(draw, 60.0, 300.0),
        "velocity_lowpass_hz": log_uniform(draw, 60.0, 200.0),
        "force_deadband_nm": 0.0,  # which would only hide a small swing
        "feedforward": float(draw.choice([0.0, 1.0, draw.random()])),
        "feedforward_lowpass_hz": log_uniform(draw, 10.0, 60.0),
        "hand_stiffness_nm_rad": log_uniform(draw, 3.0, 1000.0),
        "hand_damping_nms_rad": log_uniform(draw, 0.05, 1.0),
        "hand_inertia_kgm2": log_uniform(draw, 0.001, 0.02),
    }
    options = {**base.options, "force": {**base.options["force"], **sensor}}
    return base.model_copy(update={"config": Config.model_validate(table), "options": options})


def drawn(seed: int, index: int) -> Rig | None:
    """Rig `index` of campaign `seed`; None if none of `TRIES` was certified."""
    draw = np.random.default_rng((seed, index))
    plant = str(draw.choice(list(FAMILY)))
    friction = float(draw.choice([1.0, log_uniform(draw, 0.01, 1.0)]))
    sensor = _sensor(seed, index)
    for tried in range(TRIES):
        loaded = _loaded(plant, sensor, draw)
        loop = stability_report.admittance_loop(loaded, 0)
        # the quick question first: most draws end there
        if not (admittance_margin.judge_stiffest(loop).ok and _certified(loop)):
            continue
        if loop.bristle_nm_rad == 0 or admittance_sticking.judge_stuck(loop).ok:
            return Rig(index, plant, friction, loaded, loop, tried)
        damping = admittance_sticking.calming_rest_damping(loop)
        if damping > 0:
            loaded = _calmed(loaded, damping)
            loop = stability_report.admittance_loop(loaded, 0)
            return Rig(index, plant, friction, loaded, loop, tried, calmed=True)
    return None


def _calmed(loaded: LoadedConfig, damping_nms_rad: float) -> LoadedConfig:
    """The rig with the damping that its refusal names."""
    table = loaded.config.model_dump(mode="json", by_alias=True)
    table["axis"][0]["admittance"]["rest_damping_nms_rad"] = damping_nms_rad
    return loaded.model_copy(update={"config": Config.model_validate(table)})


def _certified(loop: AdmittanceLoop) -> bool:
    """As `rtctl check` passes it: stable at the grid's points, also with dry friction; where samples come
    every tick, proved between them, too."""
    if not (admittance_margin.judge(loop).ok and admittance_margin.judge_rubbing(loop)[0].ok):
        return False
    if not admittance_help.judge_help(loop).ok:
        return False
    if not all(admittance_margin.judge_stiffest(one).ok for one in quicker_sensors(loop)):
        return False
    return loop.sample_ticks > 1 or admittance_margin.proof(loop).proved


def pair(rig: Rig, seed: int, number: int) -> Pair:
    """Hand and world `number` of a rig: the corners of its box first."""
    # NumPy fills seeds up with zeros: 0 would be the stream that the rig was drawn from
    draw = np.random.default_rng((seed, rig.index, number or _FIRST_HAND_STREAM))
    box = rig.loop.box
    corner = number < PAIRS // 2  # the stiffest hand decides most
    return Pair(
        stiffness_nm_rad=box.stiffness_nm_rad * (1.0 if corner else draw.random() ** 2),
        # hardly damped: a damped hand calms what the certificate let through
        damping_nms_rad=box.damping_nms_rad * (0.0 if draw.random() < 0.8 else draw.random() ** 3),
        inertia_kgm2=box.inertia_kgm2 * float(draw.choice([0.0, 1.0, draw.random()])),
        world=_WORLDS[int(draw.integers(len(_WORLDS)))],
        world_stiffness_nm_rad=log_uniform(draw, 1.0, 1e4),
        world_damping_nms_rad=float(draw.choice([0.0, log_uniform(draw, 0.01, 10.0)])),
    )
