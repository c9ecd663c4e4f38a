"""Impedance and admittance display on the same simulated joint: free motion, felt mass, contact, Z-width,
felt impedance."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from rtctl.control.vocabulary import Environment
from rtctl.errors import ConfigError
from rtctl.experiments import admittance_findings, admittance_runs, admittance_tables, sizes, virtual
from rtctl.experiments.admittance_findings import (
    CERTIFIED,
    DAMPING_SHARES,
    HZ,
    LIGHT_DAMPING,
    MASSES,
    SPRINGS_NM_RAD,
    WALL_NM_RAD,
    Felt,
)
from rtctl.experiments.admittance_runs import Contact, Rubbing, Shown
from rtctl.experiments.order import Order
from rtctl.experiments.report import Outcome, Part
from rtctl.experiments.seeds import over_seeds
from rtctl.experiments.statistics import Estimate, estimate, rms
from rtctl.experiments.virtual import FAST_SINE, SLOW_TRIANGLE, Motion, Variant
from rtctl.rig_file.config import LoadedConfig
from rtctl.simulation.certificate import is_rigid, stiffest_hand_nm_rad

TITLE = "Admittance display"
LARGEST_RAD = 0.3
"""Largest amplitude of a hand's wish: the fast sine's, and the slowest of `admittance_runs.FELT_HZ`."""


def _require_joint(order: Order) -> None:
    """Refuse an axis whose room its hands and worlds do not fit. Raises ConfigError."""
    axis, path = order.loaded.config.axis[0], order.loaded.path
    if axis.motion == "linear":
        raise ConfigError(
            f"{path}: axis[0].motion: the hands and worlds of this experiment are those of a joint; run "
            "free-motion, spring or policies on a carriage, and rtctl check for its admittance"
        )
    if sizes.scale(order.loaded, LARGEST_RAD) < 1.0:
        raise ConfigError(
            f"{path}: axis[0].position_min_rad to position_max_rad: the hands of this experiment move by up "
            f"to {LARGEST_RAD:g} rad to either side of the start; give it a rig with more travel"
        )


def run(order: Order) -> Outcome:
    """Run it on the first axis of the simulated rig. Raises ConfigError, DataError."""
    order.require_simulated("admittance")
    _require_joint(order)
    loaded, shown = order.loaded, admittance_runs.usual(order.loaded)
    # free motion is where the damping of the mass is all that is felt
    light = replace(shown, damping_nms_rad=LIGHT_DAMPING * loaded.config.axis[0].viscous_nms_rad)
    left = _left(order, light)
    order.progress(0.6, "felt mass")
    felt = _felt(loaded, shown)
    order.progress(0.7, "contacts")
    touched = _contacts(loaded, shown)
    order.progress(0.8, "Z-width")
    widths = _widths(loaded, shown)
    order.progress(0.9, "felt impedance")
    heard = _impedances(loaded, shown)
    hand = stiffest_hand_nm_rad(admittance_runs.displayed(loaded, light))
    order.progress(1.0, "admittance display")
    parts = (
        Part("Free motion", (admittance_findings.free_sentence(left, hand),),
            (admittance_tables.left_table(left, light, hand),)),
        Part("Mass and damping felt", (admittance_findings.felt_sentence(felt),),
            (admittance_tables.felt_table(felt), admittance_tables.impedance_picture(loaded, shown, heard))),
        Part("Contact", (admittance_findings.contact_sentence(touched),),
            (admittance_tables.contact_table(touched), admittance_tables.width_picture(loaded, widths))),
    )  # fmt: skip
    return Outcome(
        "admittance",
        TITLE,
        " ".join(
            (
                admittance_findings.free_sentence(left, hand),
                admittance_findings.felt_sentence(felt),
                admittance_findings.contact_sentence(touched),
            )
        ),
        parts,
        admittance_tables.targets(left, felt, rigid=is_rigid(admittance_runs.displayed(loaded, shown))),
        admittance_tables.numbers(left, felt, touched, widths, heard, hand),
    )


def _left(order: Order, light: Shown) -> dict[str, dict[str, Estimate]]:
    impedance = admittance_runs.displayed(order.loaded, None)
    admittance = admittance_runs.displayed(order.loaded, light)
    rows = {
        "impedance, compensated": (impedance, 1.0),
        "admittance": (admittance, 0.0),
        "admittance, compensated": (admittance, 1.0),
    }
    found: dict[str, dict[str, Estimate]] = {}
    for at, motion in enumerate((FAST_SINE, SLOW_TRIANGLE)):
        order.progress(0.3 * at, motion.name)
        bare = _hand_nm(order, motion, impedance, 0.0)  # both displays against the same joint without help
        found[motion.name] = {
            name: estimate(_hand_nm(order, motion, *one) / bare) for name, one in rows.items()
        }
    return found


def _hand_nm(order: Order, motion: Motion, loaded: LoadedConfig, share: float) -> np.ndarray:
    """RMS of the hand's torque, N m, of every seed."""
    one = partial(_one_hand_nm, motion=motion, share=share)
    return np.array(over_seeds(replace(order, loaded=loaded), one))


def _one_hand_nm(order: Order, seed: int, *, motion: Motion, share: float) -> float:
    run = virtual.measure(order.loaded, seed, motion, Variant("", share))
    return rms(run.trace["hand_torque_nm"][:, 0])


def _felt(loaded: LoadedConfig, shown: Shown) -> list[Felt]:
    inertia = loaded.config.axis[0].inertia_kgm2
    rows = []
    for share in MASSES:
        # without and with what is sent ahead: a servo alone lags by what its mass asks of the joint
        for ahead in (0.0, 1.0):
            asked = replace(shown, mass_kgm2=share * inertia, feedforward=ahead)
            one = admittance_runs.displayed(loaded, asked)
            hand = stiffest_hand_nm_rad(one)
            for joint in Rubbing:
                mass, damping = admittance_runs.felt(one, joint)
                rows.append(Felt(asked, mass, damping, joint, hand))
    return rows


def _contacts(loaded: LoadedConfig, shown: Shown) -> dict[str, dict[str, Contact]]:
    worlds = {f"spring of {k:g}": (Environment.SPRING, k) for k in SPRINGS_NM_RAD}
    worlds["wall"] = (Environment.WALL, WALL_NM_RAD)
    found = {}
    # the same joint and hand in both: a display is judged against the other, not against a wish
    for name, one in (("impedance", None), ("admittance", shown)):
        rig = admittance_runs.displayed(loaded, one)
        for joint in Rubbing:
            found[f"{name} where it {joint}"] = {
                world: admittance_runs.contact(rig, *what, joint) for world, what in worlds.items()
            }
    return found


def _widths(loaded: LoadedConfig, shown: Shown) -> dict[str, list[tuple[float, float]]]:
    """Damping and stiffest calm wall of both displays, and what the matrices of the admittance bear."""
    b = loaded.config.axis[0].viscous_nms_rad
    virtual_dampings = [(LIGHT_DAMPING + 5 * share) * b for share in DAMPING_SHARES]
    return {
        "impedance": [
            (share * b, admittance_runs.widest(loaded, None, share * b)) for share in DAMPING_SHARES
        ],
        "admittance": [(one, admittance_runs.widest(loaded, shown, one)) for one in virtual_dampings],
        CERTIFIED: [(one, admittance_runs.widest_certified(loaded, shown, one)) for one in virtual_dampings],
    }


def _impedances(loaded: LoadedConfig, shown: Shown) -> dict[str, list[complex]]:
    inertia = loaded.config.axis[0].inertia_kgm2
    made = {"impedance": admittance_runs.displayed(loaded, None)}
    for share in MASSES:
        asked = replace(shown, mass_kgm2=share * inertia)
        made[_mass_name(asked.mass_kgm2)] = admittance_runs.displayed(loaded, asked)
    return {name: [admittance_runs.impedance_felt(one, hz) for hz in HZ] for name, one in made.items()}


def _mass_name(mass_kgm2: float) -> str:
    return f"admittance, m = {mass_kgm2:.3g} kg m^2"
