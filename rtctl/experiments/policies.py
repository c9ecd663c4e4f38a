"""The policies of friction compensation side by side: good model, wrong model, coarse encoder, other plants.

What decides the direction near rest: docs/theory.md 5.6; the disturbance observer: docs/theory.md 6. A policy
has to be quiet first: without a hand, and in one that holds still (`still_hand`)."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from hw.motion import own_size, words
from rtctl.control.vocabulary import Policy
from rtctl.errors import DataError
from rtctl.experiments import figures, policies_on_family, report, still_hand, virtual
from rtctl.experiments.free_motion import HUNTS_RAD_S
from rtctl.experiments.order import Order
from rtctl.experiments.report import Outcome, Part
from rtctl.experiments.seeds import over_seeds
from rtctl.experiments.statistics import Estimate, estimate, rms
from rtctl.experiments.still_hand import Still
from rtctl.experiments.virtual import FAST_SINE, SLOW_TRIANGLE, Change, Variant
from rtctl.friction.learn.report_page import Picture
from rtctl.friction.learn.report_tables import Table
from rtctl.simulation import campaign_still
from rtctl.simulation.closed_loop import Simulation

TITLE = "Policies of friction compensation"
DEFAULT = "hybrid + observer (default)"
COARSE = {8000: 32, 2000: 64}
"""Counts per turn of coarse encoders, with the window that their velocity needs; of a carriage as at its
handle."""
TANH_RAD_S = (".02", ".25")
MOTIONS = (FAST_SINE, SLOW_TRIANGLE)

FAMILY_SHARE = 0.3
"""Share of the experiment's time that the plants of the family take."""

Measured = dict[str, np.ndarray]


@dataclass(frozen=True)
class Judged:
    """Figures of one policy on one rig, one value per seed, and the worst hand that holds still."""

    figures: Measured
    still: Still

    def faults(self, motion: str = "rotary") -> list[str]:
        """What is wrong on an axis of this motion: speed by the mean over the seeds, energy by the worst of
        them; NaN: the rig was stopped."""
        speed, energy = self.figures["speed_after_release_rad_s"], self.figures["hand_energy_min_j"]
        most_rad_s = own_size("speed_rad_s", HUNTS_RAD_S, motion)
        found = {
            "stopped by a fault": not np.isfinite(energy).all(),
            # `not <=`: a NaN of a rig that stopped counts as hunting
            "hunts or runs": not speed.mean() <= most_rad_s,
            "feeds the hand": energy.min() < -virtual.FED_J,
        }
        return [text for text, true in found.items() if true] + self.still.faults(motion)


def tanh(speed_rad_s: float) -> Change:
    """Direction tanh(v / speed)."""

    def change(simulation: Simulation) -> None:
        simulation.params["friction_policy"] = int(Policy.TANH)
        simulation.params["friction_tanh_rad_s"] = own_size("tanh_rad_s", speed_rad_s, simulation.motion)

    return change


def alone(policy: Policy) -> Change:
    """A feed-forward without the disturbance observer on top."""
    return virtual.both(virtual.with_policy(policy), virtual.with_observer(0.0))


POLICIES: dict[str, Change] = {
    DEFAULT: virtual.with_policy(Policy.HYBRID),
    "hybrid without observer": alone(Policy.HYBRID),
    "observer": policies_on_family.observer_alone,
    "lugre observer": policies_on_family.lugre_observer,
    "sign": alone(Policy.SIGN),
    "deadband": alone(Policy.DEADBAND),
    **{
        f"tanh {text} rad/s": virtual.both(tanh(float(text)), virtual.with_observer(0.0))
        for text in TANH_RAD_S
    },
    "dither": alone(Policy.DITHER),
    "intent": alone(Policy.INTENT),
    "stop": alone(Policy.STOP),
    "stop_gated": alone(Policy.STOP_GATED),
}


def uncapped(simulation: Simulation) -> None:
    """Take the cap off that the plan puts on policies without a force gate."""
    simulation.params["friction_ungated_cap_nm"] = simulation.params["friction_cap_nm"]


def coarse(counts: int) -> Change:
    """Put a coarse encoder on the link."""

    def change(simulation: Simulation) -> None:
        count_rad = own_size("count_rad", 2 * math.pi / counts, simulation.motion)
        simulation.plant_params["count_rad"] = count_rad
        for name in ("count_rad", "velocity_band_rad"):  # FOAW accepts what a count makes
            simulation.params[name] = count_rad
        # a longer window, as somebody with such an encoder would give it
        simulation.params["velocity_window_ticks"] = COARSE[counts]

    return change


RIGS: dict[str, Change] = {
    "as configured": virtual.unchanged,
    "model 25 % too high, ungated uncapped": virtual.both(virtual.with_model_scaled(1.25), uncapped),
    "model 25 % too low": virtual.with_model_scaled(0.75),
    **{f"encoder of {counts} counts": coarse(counts) for counts in COARSE},
}
BEYOND = tuple(RIGS)[-1]
"""A step of this encoder is longer than friction is a spring: no policy is asked to be quiet there."""


def run(order: Order) -> Outcome:
    """Run the experiment on the simulated rig. Raises ConfigError, DataError."""
    order.require_simulated("policies")
    tables, pictures = [], []
    numbers: dict[str, Any] = {}
    quiet = {rig: set(POLICIES) for rig in RIGS}
    # the family are joints, and stand in the rig's own place
    end = 1.0 if order.plant or order.motion == "linear" else 1 - FAMILY_SHARE  # where what follows begins
    for at, (rig, change) in enumerate(RIGS.items()):
        part = order.part(end * at / len(RIGS), end * (at + 1) / len(RIGS))
        # on each rig anew: a coarse encoder costs the coupling something, too
        off = {motion.name: _hand(order, motion, Variant("off", 0.0, change)) for motion in MOTIONS}
        found = {}
        for number, (name, policy) in enumerate(POLICIES.items()):
            # told before it runs: each takes a while
            part(number / len(POLICIES), f"{rig}: {name}")
            found[name] = _policy(order, off, Variant(name, 1.0, virtual.both(change, policy)))
        # one fault on one rig is enough: a policy has to be quiet first
        quiet[rig] -= {name for name, one in found.items() if one.faults(order.motion)}
        tables.append(_table(order, rig, found))
        pictures.append(_picture(order, at, rig, found))
        numbers[rig] = {name: _numbers(one, order.motion) for name, one in found.items()}
    parts = [Part("Side by side", (_explanation(order.motion),), _shown(pictures, tables))]
    body: dict[str, Any] = {"rigs": numbers}
    if not (order.plant or order.motion == "linear"):  # the plants are joints
        family, body["family"] = policies_on_family.part(order, order.part(end, 1.0))
        parts.append(family)
    order.progress(1.0, "policies")
    outcome = Outcome("policies", TITLE, _key(quiet, numbers), tuple(parts), (), body)
    return report.reworded(outcome, lambda text: own_names(text, order.motion))


def own_names(text: str, motion: str) -> str:
    """A text with the names of policies and encoders as they are on an axis of this motion."""
    if motion != "linear":
        return text
    # as written in the name, digit by digit: `.02` is not `0.02`
    for speed in TANH_RAD_S:
        own_m_s = own_size("tanh_rad_s", float(speed), motion)
        text = text.replace(f"tanh {speed} rad/s", words(f"tanh {own_m_s:g} m/s", motion))
    for counts in COARSE:
        step_m = own_size("count_rad", 2 * math.pi / counts, motion)
        text = text.replace(f"encoder of {counts} counts", f"encoder with steps of {1e6 * step_m:.0f} um")
    return text


def _shown(pictures: list[Picture], tables: list[Table]) -> tuple[Picture | Table, ...]:
    return tuple(part for pair in zip(pictures, tables, strict=True) for part in pair)  # by turns


def _explanation(motion: str) -> str:
    stiff = [own_size("stiffness_nm_rad", k, motion) for k, _ in still_hand.HANDS]
    damped = [own_size("damping_nms_rad", b, motion) for _, b in still_hand.HANDS]
    hunts, shakes = (
        1e3 * own_size("speed_rad_s", v, motion) for v in (HUNTS_RAD_S, campaign_still.QUIET_RAD_S)
    )
    most_mj = 1e3 * campaign_still.FED_J
    return (
        "Each policy gets the rig file's gain and model, and over each motion the reduction of the RMS "
        "torque of the hand against no compensation. Hands off: RMS speed 1 to 5 s after the hand let go "
        f"at full speed; above {hunts:g} mrad/s the joint hunts or runs. A hand that holds still: after two "
        f"periods of the fast sine its wish stands still; the worst of {len(still_hand.HANDS)} hands "
        f"({min(stiff):g} to {max(stiff):g} N m/rad, {min(damped):g} and {max(damped):g} N m s/rad): RMS "
        f"speed 2 to 5 s later, above {shakes:g} mrad/s it is shaken, and the energy it was given in that "
        f"time, at most {most_mj:g} mJ. Energy: the least the hand has put in over a motion, "
        "worst seed; below zero the hand was fed. Policies without a force gate are capped at gain times "
        "the least friction, as the daemon does, except where the table says uncapped; but for the default "
        "and 'observer' none has the disturbance observer. All have the energy account, which keeps any of "
        "them from feeding a hand for long. The coarse encoders are coarser than `rtctl check` accepts "
        "with the coupling of the shipped rig."
    )


def _hand(order: Order, motion: virtual.Motion, variant: Variant) -> Measured:
    def once(order: Order, seed: int) -> tuple[float, float]:
        try:
            run = virtual.measure(order.loaded, seed, motion, variant)
        except DataError:
            return math.nan, math.nan  # a rig that stopped is judged, not left out
        return rms(run.truth["hand_torque_nm"][:, 0]), virtual.hand_energy_min_j(run)

    # a row for each seed, in their order: rows of two policies are compared one by one
    found = np.array(over_seeds(order, once))
    return {"rms": found[:, 0], "energy": found[:, 1]}


def _policy(order: Order, off: dict[str, Measured], variant: Variant) -> Judged:
    found: Measured = {}
    # the worst of both motions: a hand that is fed in one of them is fed
    energies = []
    for motion in MOTIONS:
        one = _hand(order, motion, variant)
        found[f"reduction, {motion.name}"] = 1 - one["rms"] / off[motion.name]["rms"]
        energies.append(one["energy"])
    found["hand_energy_min_j"] = np.min(energies, axis=0)
    found["speed_after_release_rad_s"] = np.array(virtual.speeds_after_release(order, variant))
    # of the hands that hold still on the same rig, not on the shipped one
    return Judged(found, still_hand.worst(order, variant))


def _numbers(one: Judged, motion: str) -> dict[str, Any]:
    means = {figure: estimate(values) for figure, values in one.figures.items()}  # NaN: null in JSON
    return {**means, "still_hand": asdict(one.still), "faults": one.faults(motion)}


def _table(order: Order, rig: str, found: dict[str, Judged]) -> Table:
    rows = []
    for name, one in found.items():
        less = [estimate(one.figures[f"reduction, {motion.name}"]).text(100, ".1f") for motion in MOTIONS]
        speed = estimate(one.figures["speed_after_release_rad_s"]).text(1e3, ".2g")
        still = (f"{1e3 * one.still.speed_rad_s:.2g}", f"{1e3 * one.still.fed_j:.3f}")
        # a NaN stays one: that rig was stopped, and stands as such in the last column
        least = f"{1e3 * float(one.figures['hand_energy_min_j'].min()):.3f}"
        rows.append((name, *less, speed, *still, least, ", ".join(one.faults(order.motion)) or "quiet"))
    caption = f"{rig}: mean over {order.seeds} seeds ± half of the 95 % confidence interval."
    header = (
        "policy",
        *(f"{motion.name}: reduction, %" for motion in MOTIONS),
        "hands off, mrad/s",
        "hand that holds still, mrad/s",
        "and what it is given, mJ",
        "least energy of the hand, worst seed, mJ",
        "",
    )
    return Table(caption, header, tuple(rows))


def _picture(order: Order, at: int, rig: str, found: dict[str, Judged]) -> Picture:
    groups: dict[str, dict[str, Estimate]] = {
        motion.name: {
            own_names(name, order.motion): estimate(one.figures[f"reduction, {motion.name}"])
            for name, one in found.items()
        }
        for motion in MOTIONS
    }
    caption = (
        f"{rig}: reduction of the RMS torque of the hand in %, by policy, with 95 % confidence intervals."
    )
    return Picture(f"policies_{at}", caption, figures.bars(groups, "reduction [%]", order.motion, 100))


def _key(quiet: dict[str, set[str]], numbers: dict[str, Any]) -> str:
    # see `BEYOND`: no policy is asked to be quiet there
    judged = [rig for rig in RIGS if rig != BEYOND]
    named = [name for name in POLICIES if all(name in quiet[rig] for rig in judged)]
    text = (
        "Quiet without a hand and in one that holds still, and never feeding it, on "
        f"{len(judged)} rigs ({'; '.join(judged)}): {', '.join(named) or 'none'}."
    )
    if len(named) < len(POLICIES):  # else there are no others
        text += (
            " Every other policy hunts, runs away, shakes, feeds the hand or is stopped by a fault on at "
            "least one."
        )
    if named:
        # a coarse encoder takes help from all of them, and says nothing of which is stronger
        own = [rig for rig in RIGS if not rig.startswith("encoder")]
        least = {
            name: min(
                numbers[rig][name][f"reduction, {motion.name}"].mean for rig in own for motion in MOTIONS
            )
            for name in named
        }
        best = max(named, key=lambda name: least[name])
        text += (
            f" The strongest of the quiet, by the least it saves with the rig file's encoder: {best}, "
            f"{100 * least[best]:.0f} %."
        )
    # told apart, so that nobody takes the sentence above for that encoder, too
    beyond = [name for name in POLICIES if name in quiet[BEYOND]]
    return (
        f"{text} With an {BEYOND}, whose step is longer than friction is a spring: "
        f"{', '.join(beyond) or 'none'}."
    )
