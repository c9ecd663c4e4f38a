"""The zero-velocity policies side by side: good model, wrong model, coarse encoder (theory reference, section 6)."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np

from rtctl.control.vocabulary import Policy
from rtctl.experiments import figures, virtual
from rtctl.experiments.order import Order
from rtctl.experiments.report import Outcome, Part
from rtctl.experiments.seeds import over_seeds
from rtctl.experiments.statistics import Estimate, estimate, rms
from rtctl.experiments.virtual import FAST_SINE, SLOW_TRIANGLE, Change, Variant
from rtctl.friction.report_page import Picture
from rtctl.friction.report_tables import Table
from rtctl.simulation import Simulation

TITLE = "Zero-velocity policies"
COARSE_COUNTS = 2000
COARSE_WINDOW = 64
HUNTS_RAD_S = 1e-3
FED_J = -1e-6
MOTIONS = (FAST_SINE, SLOW_TRIANGLE)

Measured = dict[str, np.ndarray]


def tanh(speed_rad_s: float) -> Change:
    """Direction tanh(v / speed)."""

    def change(simulation: Simulation) -> None:
        simulation.params["friction_policy"] = int(Policy.TANH)
        simulation.params["friction_tanh_rad_s"] = speed_rad_s

    return change


POLICIES: dict[str, Change] = {
    "hybrid (default)": virtual.with_policy(Policy.HYBRID),
    "sign": virtual.with_policy(Policy.SIGN),
    "deadband": virtual.with_policy(Policy.DEADBAND),
    "tanh .02 rad/s": tanh(0.02),
    "tanh .25 rad/s": tanh(0.25),
    "dither": virtual.with_policy(Policy.DITHER),
    "intent": virtual.with_policy(Policy.INTENT),
    "stop": virtual.with_policy(Policy.STOP),
    "stop_gated": virtual.with_policy(Policy.STOP_GATED),
}


def uncapped(simulation: Simulation) -> None:
    """Take the cap off that the plan puts on policies without a force gate."""
    simulation.params["friction_ungated_cap_nm"] = simulation.params["friction_cap_nm"]


def coarse(simulation: Simulation) -> None:
    """Put an encoder of 2000 counts on the link, with the long window it needs."""
    count = 2 * math.pi / COARSE_COUNTS
    simulation.plant_params["count_rad"] = count
    for name in ("count_rad", "velocity_band_rad"):
        simulation.params[name] = count
    simulation.params["velocity_window_ticks"] = COARSE_WINDOW


RIGS: dict[str, Change] = {
    "as configured": virtual.unchanged,
    "model 25 % too high, ungated uncapped": virtual.both(virtual.with_model_scaled(1.25), uncapped),
    "model 25 % too low": virtual.with_model_scaled(0.75),
    f"encoder of {COARSE_COUNTS} counts": coarse,
}


def run(order: Order) -> Outcome:
    """Run the experiment on the simulated rig. Raises ConfigError, DataError."""
    order.require_simulated("policies")
    tables, pictures, numbers = [], [], {}
    quiet = set(POLICIES)
    for at, (rig, change) in enumerate(RIGS.items()):
        part = order.part(at / len(RIGS), (at + 1) / len(RIGS))
        off = {motion.name: _hand(order, motion, Variant("off", 0.0, change)) for motion in MOTIONS}
        found = {}
        for number, (name, policy) in enumerate(POLICIES.items()):
            part(number / len(POLICIES), f"{rig}: {name}")
            found[name] = _policy(order, off, Variant(name, 1.0, virtual.both(change, policy)))
        quiet -= {name for name, one in found.items() if _judged(one)}
        tables.append(_table(order, rig, found))
        pictures.append(_picture(at, rig, found))
        numbers[rig] = {
            name: {figure: estimate(values) for figure, values in one.items()} for name, one in found.items()
        }
    order.progress(1.0, "policies")
    shown = [part for pair in zip(pictures, tables, strict=True) for part in pair]
    text = (
        "Each policy gets the rig file's gain and model, and over each motion the reduction of the RMS torque of the hand "
        "against no compensation. Hands off: RMS speed 1 to 5 s after the hand let go at full speed; above "
        f"{1e3 * HUNTS_RAD_S:g} mrad/s the joint hunts or runs. Energy: the least the hand has put in, worst seed; below zero the "
        "hand was fed. Policies without a force gate are capped at gain times the least friction, as the daemon does, "
        "except where the table says uncapped."
    )
    parts = (Part("Side by side", (text,), tuple(shown)),)
    return Outcome("policies", TITLE, _key(quiet), parts, (), {"rigs": numbers})


def _hand(order: Order, motion: virtual.Motion, variant: Variant) -> Measured:
    def once(order: Order, seed: int) -> tuple[float, float]:
        run = virtual.measure(order.loaded, seed, motion, variant)
        return rms(run.truth["hand_torque_nm"]), virtual.hand_energy_min_j(run)

    found = np.array(over_seeds(order, once))
    return {"rms": found[:, 0], "energy": found[:, 1]}


def _policy(order: Order, off: dict[str, Measured], variant: Variant) -> Measured:
    found: Measured = {}
    energies = []
    for motion in MOTIONS:
        one = _hand(order, motion, variant)
        found[f"reduction, {motion.name}"] = 1 - one["rms"] / off[motion.name]["rms"]
        energies.append(one["energy"])
    found["hand_energy_min_j"] = np.min(energies, axis=0)
    found["speed_after_release_rad_s"] = np.array(virtual.speeds_after_release(order, variant))
    return found


def _judged(one: Measured) -> list[str]:
    """What is wrong with a policy on a rig: speed by the mean over the seeds, energy by the worst of them."""
    faults = {
        "hunts or runs": one["speed_after_release_rad_s"].mean() > HUNTS_RAD_S,
        "feeds the hand": one["hand_energy_min_j"].min() < FED_J,
    }
    return [text for text, true in faults.items() if true]


def _table(order: Order, rig: str, found: dict[str, Measured]) -> Table:
    rows = []
    for name, one in found.items():
        less = [estimate(one[f"reduction, {motion.name}"]).text(100, ".1f") for motion in MOTIONS]
        speed, energy_j = estimate(one["speed_after_release_rad_s"]), float(one["hand_energy_min_j"].min())
        judged = ", ".join(_judged(one)) or "quiet"
        rows.append((name, *less, speed.text(1e3, ".2g"), f"{1e3 * energy_j:.3f}", judged))
    caption = f"{rig}: mean over {order.seeds} seeds ± half of the 95 % confidence interval."
    header = ("policy", *(f"{motion.name}: reduction, %" for motion in MOTIONS))
    return Table(
        caption, (*header, "hands off, mrad/s", "least energy of the hand, worst seed, mJ", ""), tuple(rows)
    )


def _picture(at: int, rig: str, found: dict[str, Measured]) -> Picture:
    groups: dict[str, dict[str, Estimate]] = {
        motion.name: {name: estimate(one[f"reduction, {motion.name}"]) for name, one in found.items()}
        for motion in MOTIONS
    }
    caption = (
        f"{rig}: reduction of the RMS torque of the hand in %, by policy, with 95 % confidence intervals."
    )
    return Picture(f"policies_{at}", caption, figures.bars(groups, "reduction [%]", scale=100))


def _key(quiet: Collection[str]) -> str:
    named = ", ".join(name for name in POLICIES if name in quiet)
    return (
        "Quiet without a hand and never feeding it on all four rigs (right model, 25 % too high, 25 % too low, coarse "
        f"encoder): {named or 'none'}. Every other policy hunts, runs away or feeds the hand on at least one."
    )
