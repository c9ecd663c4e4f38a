"""The cases of `rtctl campaign --still`, as they are drawn: a joint, a hand that holds still, a policy."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hw import registry
from rtctl.friction.policies import STANDINGS
from rtctl.rig_file.config import Config
from rtctl.simulation.campaign_draws import log_uniform
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.family import merged, shipped_rig

PERIOD_S = 2.0
PERIODS = 2
POLICIES = tuple(name for name, standing in STANDINGS.items() if standing.quiet and name != "off")
"""What is tried where no policy is named: those that help and that `rtctl check` lets a hand meet."""

SENSOR_LEAST_HZ, SENSOR_MOST_TICKS = 120.0, 4
_SENSOR_STREAM = 31
"""Draws of the force sensor: the cases are otherwise those of earlier campaigns."""

_KINDS = ("lugre", "elasto_plastic", "gms")


@dataclass(frozen=True)
class Case:
    """One joint, one hand, one policy, as it was drawn. Units as in a rig file."""

    index: int
    policy: str
    model: str
    bristle_stiffness_nm_rad: float
    bristle_damping_nms_rad: float
    joint_hz: float
    """Resonance of two equal masses; 0: one mass."""
    hand_stiffness_nm_rad: float
    hand_damping_nms_rad: float
    hand_inertia_kgm2: float
    amplitude_rad: float
    place_rad: float
    ends: str
    """"middle", "anywhere" (the wish stops where it is), or "off" (the hand lets go)."""
    stop_s: float
    """When, after the two periods."""
    sensor_hz: float = 0.0
    """Own low-pass of the force sensor; 0: none."""
    sensor_ticks: int = 0
    """How late it is besides."""


def drawn(seed: int, index: int, policies: tuple[str, ...] = POLICIES, hands: int = 1) -> Case:
    """Case `index` of campaign `seed`.

    `hands` cases after each other have the gear and the force sensor of the first: what an observer is tuned
    for, which takes twice as long as to simulate a hand. Bristles, place and hand are each case's own."""
    # each draws all it has, needed or not: streams stay as they are
    own, first = _drawn(seed, index, policies), index - index % hands
    if first == index:
        return own
    as_there = {"joint_hz": _drawn(seed, first, policies).joint_hz, **_sensor(seed, first)}
    return replace(own, **as_there)


def _drawn(seed: int, index: int, policies: tuple[str, ...]) -> Case:
    # by the number alone: a case does not depend on how many are run
    draw = np.random.default_rng((seed, index))
    ends = str(draw.choice(["middle", "middle", "anywhere", "off"]))
    # a wish that stops in the middle of its motion stops where it passes there: a hand does not jump
    stop_s = float(draw.choice([0.0, PERIOD_S / 2]) if ends == "middle" else draw.uniform(0.0, PERIOD_S))
    return Case(
        index=index,
        policy=policies[index % len(policies)],  # in turn, not drawn: each has as many cases
        model=str(draw.choice(_KINDS)),
        # by ratio, and a factor of forty: from soft cables to bearings
        bristle_stiffness_nm_rad=log_uniform(draw, 50.0, 2000.0),
        bristle_damping_nms_rad=log_uniform(draw, 0.1, 3.0),
        joint_hz=float(draw.choice([0.0, 0.0, log_uniform(draw, 30.0, 120.0)])),
        hand_stiffness_nm_rad=float(
            draw.choice([0.0, log_uniform(draw, 0.5, 500.0), log_uniform(draw, 0.5, 500.0), 500.0])
        ),
        hand_damping_nms_rad=float(
            draw.choice([0.0, log_uniform(draw, 0.01, 1.0), log_uniform(draw, 0.01, 1.0), 1.0])
        ),
        hand_inertia_kgm2=float(draw.choice([0.0, draw.uniform(0.0, 0.02), 0.02])),
        amplitude_rad=log_uniform(draw, 0.03, 0.4),
        place_rad=draw.uniform(-math.pi, math.pi),
        ends=ends,
        stop_s=stop_s,
        **_sensor(seed, index),
    )


def _sensor(seed: int, index: int) -> dict[str, Any]:
    """Seven in ten have no low-pass, seven in ten no delay."""
    draw = np.random.default_rng((seed, index, _SENSOR_STREAM))
    # both are drawn by themselves: a slow sensor need not be late, nor a late one slow
    hz = log_uniform(draw, SENSOR_LEAST_HZ, 1000.0) if draw.random() < 0.3 else 0.0
    late = int(draw.integers(1, SENSOR_MOST_TICKS + 1)) if draw.random() < 0.3 else 0
    return {"sensor_hz": hz, "sensor_ticks": late}


def _joint(case: Case, inertia_kgm2: float) -> dict[str, Any]:
    """The case's changes of [[device.options.axis]]."""
    friction = {
        "model": case.model,
        "bristle_stiffness_nm_rad": case.bristle_stiffness_nm_rad,
        "bristle_damping_nms_rad": case.bristle_damping_nms_rad,
    }
    axis: dict[str, Any] = {"friction": friction, "start_position_rad": case.place_rad}
    if case.joint_hz > 0:
        # two halves of the inertia swing against each other: J/4 is their reduced mass
        stiffness = inertia_kgm2 / 4 * (2 * math.pi * case.joint_hz) ** 2
        damping = 0.02 * 2 * math.sqrt(stiffness * inertia_kgm2 / 4)
        axis["elastic"] = {
            "stiffness_nm_rad": stiffness,
            "damping_nms_rad": damping,
            "link_viscous_share": 0.2,
        }
    return axis


def _hand(case: Case) -> dict[str, Any]:
    """The case's changes of [[device.options.hand]]."""
    return {
        "kind": "sine",
        "stiffness_nm_rad": case.hand_stiffness_nm_rad,
        "damping_nms_rad": case.hand_damping_nms_rad,
        "inertia_kgm2": case.hand_inertia_kgm2,
        "amplitude_rad": case.amplitude_rad,
        "frequency_hz": 1 / PERIOD_S,
        "center_rad": case.place_rad,
    }


def rig(case: Case) -> Simulation:
    """The simulated rig of a case, nothing run yet. The presliding length is told as break-away over
    sigma0."""
    shipped = shipped_rig("mock.toml")
    # through the tables of a rig file: a case that none could hold is refused
    table = shipped.config.model_dump(mode="json", by_alias=True)
    axis = table["axis"][0]
    options = dict(shipped.options)
    own = options["axis"][0]
    # of the plant, which the law is told truly
    breakaway_nm = own["friction"]["breakaway_nm"]
    told: dict[str, Any] = {
        "friction": {"policy": case.policy, "presliding_rad": breakaway_nm / case.bristle_stiffness_nm_rad}
    }
    if case.joint_hz > 0:
        # only the motor's damping counts on an elastic joint, .04: a coupling inside what that leaves
        told |= {"coupling": {"stiffness_nm_rad": 45.0}}
    # one axis: a hand holds one joint
    table["axis"] = [merged(axis, told)]
    options["axis"] = [merged(own, _joint(case, axis["inertia_kgm2"]))]
    options["hand"] = [merged(options["hand"][0], _hand(case))]
    options["force"] = {**options["force"], "lowpass_hz": case.sensor_hz, "delay_ticks": case.sensor_ticks}
    # noise of its own for each case
    options["seed"] = case.index + 1
    valid = registry.options_model("mock").model_validate(options, context={"n_axes": 1})
    update = {"config": Config.model_validate(table), "options": valid.model_dump(mode="json")}
    return Simulation(shipped.model_copy(update=update))
