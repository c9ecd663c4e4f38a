"""A plant of the mock's family for a random rig, in the rig's own size, and so that the law is told no
untruth.

The plant keeps its shape (resonance, presliding length, shares, waves, load) and takes its size from the rig
drawn: inertia, friction, damping. Dry friction is raised until the model, which is never too high, is a lower
bound of what acts on the motor's side at every place; viscous friction until what the law is told is the
motor's share. What thins out of it goes with the dry friction, whose model contains it."""

from __future__ import annotations

import math

import numpy as np

from hw.simulators.mock_effects import effect_fields
from hw.simulators.mock_records import plant_records
from rtctl.check import lateness
from rtctl.control.proofs.stability import late_ticks
from rtctl.rig_file.config import LoadedConfig
from rtctl.simulation.family import FAMILY, with_plant

LEFT_OUT: tuple[str, ...] = ()
"""Plants on which an invariant does not hold: known, named here with their reason, and not drawn."""

NAMES = tuple(name for name in FAMILY if name not in LEFT_OUT)

SHARE = 0.5
"""Share of the rigs that have a plant of the family; the others are those of earlier campaigns."""

AS_DRAWN = "as drawn"

_TIMING = ("sample_every_ticks", "transport_delay_ticks")
_SHAPE = tuple(name for name, *_ in effect_fields(1) if name not in _TIMING)
_CURVE = (
    "stribeck_rad_s",
    "stribeck_exponent",
    "second_share",
    "second_rad_s",
    "thinning_rad_s",
    "elastic_share",
)
_made: dict[tuple[str, str], tuple[np.void, int]] = {}


def drawn(draw: np.random.Generator) -> str:
    """Name of the plant of a rig, or `AS_DRAWN`."""
    return str(draw.choice(NAMES)) if draw.random() < SHARE else AS_DRAWN


def reference(loaded: LoadedConfig, name: str) -> tuple[np.void, int]:
    """Parameters of the plant in the size of the rig file, and all that is late in it, in whole ticks."""
    # kept: a campaign makes thousands of rigs of the same two files
    key = (loaded.sha256, name)
    if key not in _made:
        changed = with_plant(loaded, name)
        params, _ = plant_records(changed.options, changed.config.hardware())
        late = late_ticks(lateness.of_axis(changed, 0).between, changed.config.period_s)
        _made[key] = params[0], math.ceil(late)
    return _made[key]


def put_timing(p: np.void, plant: np.void, like: np.void, delay_ticks: int) -> None:
    """Give the rig the plant's slow device; the law is told of all that is late in it."""
    if like["sample_every_ticks"] <= 1 and like["transport_delay_ticks"] == 0:
        return
    for name in _TIMING:
        plant[name] = like[name]
    # the delay that was drawn gives way: of both together the law would be told too little
    plant["torque_delay_ticks"], p["follow_delay_ticks"] = 0, delay_ticks
    # the age of the sample, a tick of every second, is no delay of the torque
    p["actuator_delay_ticks"] = delay_ticks - 1


def put_plant(plant: np.void, like: np.void, usual: np.void, axis: int) -> None:
    """Give one axis the shape of plant `like`, whose rig file has otherwise the plant `usual`.

    Notes
    -----
    Dry friction (1 - link's share) (1 - waves) up = as drawn, so that the model stays a lower bound on the
    motor's side; viscous friction (1 - link's share) = as drawn. Drift and load only add to it in the family.
    """
    friction = float(plant["coulomb_nm"][axis] / usual["coulomb_nm"][axis])
    size = float(plant["inertia_kgm2"][axis] / usual["inertia_kgm2"][axis])
    for name in _SHAPE:
        plant[name][axis] = like[name][axis]
    plant["joint_stiffness_nm_rad"][axis] *= size  # by the inertia: the resonance stays
    plant["joint_damping_nms_rad"][axis] *= size
    plant["ripple_wave"][axis, :, 0] *= friction
    for name in ("load_outside_square_nm", "load_motor_square_nm"):
        plant[name][axis] /= friction  # a square term over a friction of another size
    elastic = bool(like["joint_stiffness_nm_rad"][axis] > 0)
    dry, viscous = (
        float(like[f"link_{kind}_share"][axis]) if elastic else 0.0 for kind in ("dry", "viscous")
    )
    waves = float(np.abs(like["friction_wave"][axis, :, 0]).sum())
    up = friction / ((1 - dry) * (1 - waves))  # what acts on the motor's side, at the weakest place
    for name in ("coulomb_nm", "breakaway_nm", "bristle_max_nm", "bristle_stiffness_nm_rad"):
        plant[name][axis] = up * like[name][axis]
    for name in _CURVE:
        plant[name][axis] = like[name][axis]
    plant["thinning_nms_rad"][axis] = friction * like["thinning_nms_rad"][axis] / (1 - viscous)
    # as stiff bristles of a small friction are damped: like the root, as in a joint that rings as this one
    # does
    plant["bristle_damping_nms_rad"][axis] = like["bristle_damping_nms_rad"][axis] * math.sqrt(up * size)
    plant["viscous_nms_rad"][axis] /= 1 - viscous
