"""The joints that `rtctl bench drift` watches: each of the mock's family with a model of its own, learned as
a lab does, and the hands that move them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hw import registry
from rtctl.control.vocabulary import Environment
from rtctl.friction import artefact
from rtctl.friction.drift_watch import RigWatch
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.learn.point_evidence import with_evidence
from rtctl.friction.point_reader import read_points
from rtctl.rig_file.config import LoadedConfig
from rtctl.simulation import mock_points
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.family import FAMILY, with_plant
from tests.bench.learned_by_place import learned_by_place, replace_axis

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
"""Its friction grows with the hand's own torque: what is told of it is no false alarm, and is counted by
itself."""

LOCAL = "harmonic-drive"
"""Its friction differs by 18 % over the turn, and a hand works at one place: watched by speed alone the
factor is that of the place."""

BY_PLACE = f"{LOCAL}, by place"
"""The same with a model by place, and an encoder that knows it."""

SEEN = f"{LOCAL}, by a place that is seen"
"""The same with an encoder that does not, and a joint that was turned once to and fro since the power
came."""

TURNED: Hand = {"kind": "triangle", "amplitude_rad": 3.3, "speed_rad_s": 0.25}
TURNED_S = 100.0

KNOWN_OF_PLACE = ("place_evidence", "place_way", "place_mean_nm", "place_square_nm2")
"""Fields of the law's state that say what it has seen of places."""

WORLDS: Mapping[str, Mapping[str, float]] = {
    "free": {"environment_kind": Environment.FREE},
    "spring": {
        "environment_kind": Environment.SPRING,
        "environment_stiffness_nm_rad": 3.0,
        "environment_center_rad": 0.0,
    },
    "wall": {
        "environment_kind": Environment.WALL,
        "environment_stiffness_nm_rad": 500.0,
        "environment_damping_nms_rad": 0.02,
        "environment_center_rad": 0.02,
        "environment_side": 1,
    },
}
"""Virtual worlds, as commands; every motion reaches behind the wall."""


@dataclass(frozen=True)
class Plant:
    """A rig, and what its law had seen of places before it is watched: fields of its state."""

    loaded: LoadedConfig
    places: Mapping[str, np.ndarray]


def plant(loaded: LoadedConfig, name: str, folder: Path) -> Plant:
    """The plant with a model of its own; a servo at a slow device rings, and the shipped model is of this
    very friction.
    """
    if name in (BY_PLACE, SEEN):
        made = with_plant(loaded, LOCAL)
        made = learned_by_place(moved(made, {"kind": "none"}), made, folder)
        if name == BY_PLACE:
            return Plant(made, {})
        seen = _with_friction(made, place="seen")
        return Plant(seen, _turned(seen))
    made = with_plant(loaded, name)
    return Plant(made if FAMILY[name].device else _learned(made, folder), {})


def _turned(loaded: LoadedConfig) -> dict[str, np.ndarray]:
    """What the law knows of its places after the joint was turned over all of them."""
    simulation = Simulation(moved(loaded, TURNED))
    simulation.arm(compensation=1.0)
    simulation.run(TURNED_S, every=1000)
    return {name: simulation.state[name].copy() for name in KNOWN_OF_PLACE}


def _learned(loaded: LoadedConfig, folder: Path) -> LoadedConfig:
    """The plant with a model that was measured on it."""
    points = folder / "points.csv"
    mock_points.write_csv(mock_points.measure(loaded, levels=24, measurements=16), points)
    measured = read_points(points)
    model = with_evidence(fit_points(measured, rig=loaded.config.rig.name, epsilon_nm=0.002), measured)
    path = folder / "model.json"
    artefact.save(model, path)
    return _with_friction(loaded, model=str(path))


def _with_friction(loaded: LoadedConfig, **keys: str) -> LoadedConfig:
    axis = loaded.config.axis[0]
    return replace_axis(loaded, axis.model_copy(update={"friction": axis.friction.model_copy(update=keys)}))


def moved(
    loaded: LoadedConfig, hand: Hand, drift: list[list[float]] | None = None, seed: int | None = None
) -> LoadedConfig:
    """The rig in another hand; `drift`: time (s), factors of dry and viscous friction; `seed` of its
    noise.
    """
    options = {**loaded.options, "hand": [{**one, **hand} for one in loaded.options["hand"]]}
    options["seed"] = options["seed"] if seed is None else seed
    if drift is not None:
        options["axis"] = [{**one, "drift": {"points": drift}} for one in options["axis"]]
    checked = registry.options_model("mock").model_validate(options, context={"n_axes": 1})
    return loaded.model_copy(update={"options": checked.model_dump(mode="json")})


def watched(
    loaded: LoadedConfig, world: str = "free", places: Mapping[str, np.ndarray] | None = None
) -> tuple[Simulation, RigWatch]:
    """The rig armed in a world, with all of its compensation, and the host's watch over it."""
    simulation = Simulation(loaded)
    for name, value in (places or {}).items():
        simulation.state[name] = value
    watch = RigWatch(
        simulation.plan.params, simulation.plan.model, [axis.friction.drift for axis in loaded.config.axis]
    )
    watch.follow(simulation.arm(compensation=1.0, **WORLDS[world]))
    return simulation, watch


def continued(simulation: Simulation, loaded: LoadedConfig) -> Simulation:
    """The rig of `loaded` from where this simulation is; that one stays as it is."""
    other = Simulation(loaded)
    for name in ("state", "command", "tick", "plant_state"):
        getattr(other, name)[:] = getattr(simulation, name)
    return other
