"""The family of simulated joints by which everything is judged: one name each, one table.

A plant is told as a change of the mock's options, in the words of a rig file: what stands under `axis` goes
into every [[device.options.axis]], what stands under `device` into [device.options]. `told` is what the
controller's own [[axis]] must then say for it to be true of this plant: the delay, and a coupling inside what
that and the motor's side leave (docs/theory.md 2.4). Everything else stays the rig file's: viscous damping is
that of motor and link together, and the mock declares the motor's share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from pydantic import ValidationError

from hw import registry
from hw.plain_words import explain
from rtctl.errors import ConfigError
from rtctl.rig_file import config
from rtctl.rig_file.config import Config, LoadedConfig
from rtctl.simulation.shipped_files import shipped_config

Change = Mapping[str, Any]


@dataclass(frozen=True)
class Plant:
    """One joint of the family."""

    name: str
    text: str
    axis: Change = field(default_factory=dict)
    device: Change = field(default_factory=dict)
    told: Change = field(default_factory=dict)


def _friction(model: str, stiffness: float = 250.0, damping: float = 1.0, **more: float) -> Change:
    # sizes are those of the rig file: the family tells shapes
    bristles = {"bristle_stiffness_nm_rad": stiffness, "bristle_damping_nms_rad": damping}
    return {"friction": {"model": model, **bristles, **more}}


def _elastic(hz: float) -> Change:
    """A joint whose two equal masses swing freely at `hz`; .8 of the viscous damping is the motor's."""
    reduced, omega = 0.012 / 4, 2 * math.pi * hz  # two halves of the usual joint swing against each other
    # rounded: these numbers are shown in documents
    stiffness, damping = round(reduced * omega**2, 1), round(2 * 0.02 * reduced * omega, 5)
    return {"elastic": {"stiffness_nm_rad": stiffness, "damping_nms_rad": damping, "link_viscous_share": 0.2}}


_ELASTIC_TOLD: Change = {"coupling": {"stiffness_nm_rad": 45.0}}
"""The motor has .04 of the usual .05, as the device tells: k_c <= 2 (.04 - .01) / T = 60, in play, too."""

_SLOW_TOLD: Change = {
    "coupling": {"stiffness_nm_rad": 10.0},
    "friction": {"intent_lowpass_hz": 18.0},
    "drive": {"resonance_hz": 500.0},
}
"""The device declares 1.5 ticks of transport, a sample every second tick and a loop of 200 Hz: k_c <= 12.7,
and the intent is proved over the mass of a hand up to 18.6 Hz. Nothing yields in it: else so late an observer
is a slow one."""

_MX106_LOAD: Change = {
    "outside": 0.0222,
    "motor": 0.198,
    "outside_peak": 0.0871,
    "motor_peak": 0.1986,
    "outside_square_nm": 7.33e-5,
    "motor_square_nm": 0.01,
}
"""Load terms of m6 of a Dynamixel MX-106: Rhoban/bam, Apache-2.0, arXiv 2410.08650; on this joint's own
friction."""

# share of the friction, or N m; times a turn; phase
_WAVES = {"friction": [[0.18, 1.0, 0.4]], "ripple": [[0.010, 80.0, 0.0], [0.006, 160.0, 1.1]]}
"""Eccentric wave generator and gear mesh of an 80:1 gear, once and twice per motor turn."""

_PLANTS = (
    Plant("lugre", "LuGre, as the shipped rig", _friction("lugre")),
    Plant("lugre-soft", "LuGre, soft bristles", _friction("lugre", 50.0, 0.1)),
    Plant("lugre-stiff", "LuGre, stiff bristles", _friction("lugre", 2000.0, 3.0)),
    Plant("elasto-plastic", "elasto-plastic", _friction("elasto_plastic")),
    Plant("elasto-plastic-soft", "elasto-plastic, soft bristles", _friction("elasto_plastic", 100.0, 0.3)),
    Plant("maxwell-slip", "eight Maxwell-slip elements", _friction("gms")),
    Plant("maxwell-slip-stiff", "sixteen stiff elements", _friction("gms", 2000.0, 0.3, elements=16)),
    Plant(
        "maxwell-slip-elastic",
        "eight Maxwell-slip elements, elastic joint of 60 Hz",
        {**_friction("gms"), **_elastic(60.0)},
        told=_ELASTIC_TOLD,
    ),
    Plant(
        "elasto-plastic-30hz",
        "elasto-plastic, elastic joint of 30 Hz",
        {**_friction("elasto_plastic"), **_elastic(30.0)},
        told=_ELASTIC_TOLD,
    ),
    Plant(
        "slow-drive",
        "fresh samples every second tick, 1.5 ticks of transport, current loop of 200 Hz",
        {**_friction("lugre"), "current_loop": {"bandwidth_hz": 200.0}},
        device={"timing": {"sample_every_ticks": 2, "transport_delay_ticks": 1.5}},
        told=_SLOW_TOLD,
    ),
    Plant(
        "harmonic-drive",
        "18 % position modulation, ripple of two orders, elastic joint of 50 Hz",
        {**_friction("lugre"), **_elastic(50.0), "waves": _WAVES},
        told=_ELASTIC_TOLD,
    ),
    Plant(
        "strong-stiction",
        "break-away 1.7 times Coulomb friction, peak at slow speeds",
        # 1.7 times .25 N m; by the second speed of the shipped joint half of the peak would last to .5 rad/s
        _friction("lugre", breakaway_nm=0.425, stribeck_rad_s=0.03, second_share=0.0),
    ),
    Plant("load-dependent", "friction grows with the torque through the gear", {"load": _MX106_LOAD}),
    Plant(
        "drifted",
        "dry friction +30 %, viscous friction +60 % since it was learned",
        {"drift": {"points": [[0.0, 1.3, 1.6]]}},
    ),
)

FAMILY: Mapping[str, Plant] = {plant.name: plant for plant in _PLANTS}
"""Every plant by its name, in the order in which reports show them."""


def merged(table: Mapping[str, Any], change: Change) -> dict[str, Any]:
    """`table` with `change` laid over it, table by table."""
    # a copy: the shipped table is read by others
    out = dict(table)
    for name, value in change.items():
        # a table that is not there yet begins empty
        old = out.get(name)
        # a list takes the place of the other: waves of two joints are none of a third
        out[name] = merged(old or {}, value) if isinstance(value, Mapping) else value
    return out


def options_with(plant: Plant, options: Mapping[str, Any]) -> dict[str, Any]:
    """The mock's options (not yet validated) with this plant in place of theirs, on every axis."""
    out = merged(options, plant.device)  # of the device first: axes are its own table
    # one at least: a mock without the table has an axis of defaults
    out["axis"] = [merged(axis, plant.axis) for axis in options.get("axis", [{}])]
    return out


@cache
def shipped_rig(name: str) -> LoadedConfig:
    """A rig file that is shipped, by its name; read once."""
    return config.load(shipped_config(name))


def with_plant(loaded: LoadedConfig, name: str) -> LoadedConfig:
    """The simulated rig of `loaded` with plant `name`; its controller is told what must be true of that
    plant.

    Raises
    ------
    ConfigError
        There is no such plant, or the rig's device is not the mock, or the two do not go together."""
    if name not in FAMILY:
        raise ConfigError(f"no plant {name!r}; there are: {', '.join(FAMILY)}")
    if [device.kind for device in loaded.config.device] != ["mock"]:
        raise ConfigError(f"{loaded.path}: device[0].kind: only a mock alone can take plant {name!r}")
    plant, table = FAMILY[name], loaded.config.model_dump(mode="json", by_alias=True)
    # told in any case: a controller that believes in the usual joint would be judged for that, not for the
    # plant
    table["axis"] = [merged(axis, plant.told) for axis in table["axis"]]
    try:
        config = Config.model_validate(table)
        wanted = options_with(plant, loaded.options)
        options = registry.options_model("mock").model_validate(wanted, context={"n_axes": config.n_axes})
    except ValidationError as error:
        of_rig = error.title == Config.__name__  # two models may refuse: each explains its own keys
        told = (
            explain(error, Config, table)
            if of_rig
            else explain(error, registry.options_model("mock"), wanted)
        )
        faults = "; ".join(f"{one.where}: {one.text}" for one in told)
        raise ConfigError(f"{loaded.path}: plant {name!r} does not fit: {faults}") from error
    return loaded.model_copy(update={"config": config, "options": options.model_dump(mode="json")})
