"""What policies leave of the hand's torque on every plant of the mock's family, with the model learned on one
of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from rtctl.control.vocabulary import Policy
from rtctl.errors import DataError
from rtctl.experiments import virtual
from rtctl.experiments.order import Order, Progress
from rtctl.experiments.report import Part
from rtctl.experiments.seeds import over_seeds
from rtctl.experiments.statistics import rms
from rtctl.experiments.virtual import FAST_SINE, SLOW_TRIANGLE, Change, Variant
from rtctl.friction.learn.report_tables import Table
from rtctl.simulation.family import FAMILY, with_plant

MOTIONS = (FAST_SINE, SLOW_TRIANGLE)
OBSERVER_ALONE_GAIN = 0.95
SEEDS = 2
"""Runs of everything at most: plants differ by far more than seeds."""

HYBRID, BOTH, ALONE, LUGRE = "hybrid alone", "hybrid + observer", "observer alone", "LuGre observer"
WITHOUT = "off"

observer_alone = virtual.both(
    virtual.with_policy(Policy.OBSERVER), virtual.with_observer(OBSERVER_ALONE_GAIN)
)
lugre_observer = virtual.both(virtual.with_policy(Policy.LUGRE), virtual.with_observer(0.0))
hybrid_alone = virtual.both(virtual.with_policy(Policy.HYBRID), virtual.with_observer(0.0))

COMPARED: Mapping[str, Change] = {
    HYBRID: hybrid_alone,
    BOTH: virtual.with_policy(Policy.HYBRID),
    ALONE: observer_alone,
    LUGRE: lugre_observer,
}

Left = dict[str, dict[str, float]]
"""Controller -> motion -> share of the hand's RMS torque left, 0 to 1; NaN: the rig stopped for a fault."""


def part(order: Order, progress: Progress) -> tuple[Part, dict[str, Left]]:
    """Section of the page, and its numbers by plant."""
    found = {}
    for at, name in enumerate(FAMILY):
        progress(at / len(FAMILY), f"plant {name}")
        found[name] = _left(order, name)
    return Part("The family of plants", (_explanation(), *said(found)), (table(found),)), found


def _left(order: Order, plant: str) -> Left:
    here = replace(order, loaded=with_plant(order.loaded, plant), seeds=min(order.seeds, SEEDS))
    variants = (Variant(WITHOUT, 0.0), *(Variant(name, 1.0, change) for name, change in COMPARED.items()))
    rms_nm = {one.name: {motion.name: _hand_nm(here, motion, one) for motion in MOTIONS} for one in variants}
    # of the same plant: one that rubs more would else make every controller look worse
    without = rms_nm.pop(WITHOUT)
    return {
        # seed by seed: each is another place of the joint, with other friction
        name: {motion: float(np.mean(one[motion] / without[motion])) for motion in without}
        for name, one in rms_nm.items()
    }


def _hand_nm(order: Order, motion: virtual.Motion, variant: Variant) -> np.ndarray:
    def once(order: Order, seed: int) -> float:
        try:
            run = virtual.measure(order.loaded, seed, motion, variant)
            return rms(run.truth["hand_torque_nm"][:, 0])
        except DataError:
            return float("nan")

    return np.array(over_seeds(order, once))


def table(found: Mapping[str, Left]) -> Table:
    """One row per plant, one column per controller and motion."""
    header = ("plant", *(f"{name}: {motion.name}" for name in COMPARED for motion in MOTIONS))
    rows = tuple(
        (plant, *(_share(left[name][motion.name]) for name in COMPARED for motion in MOTIONS))
        for plant, left in found.items()
    )
    caption = (
        "Share of the hand's RMS torque that is left, in % of the torque without compensation, mean over "
        f"up to {SEEDS} seeds. The model is the rig file's, on every plant."
    )
    return Table(caption, header, rows)


def _share(left: float) -> str:
    return f"{100 * left:.1f}" if np.isfinite(left) else "stopped by a fault"


def said(found: Mapping[str, Left]) -> tuple[str, ...]:
    """Where the learned model alone loses, and how good the two together are at worst: sentences made of the
    figures."""
    lost = [plant for plant, left in found.items() if _loses(left)]
    sentences = [
        "The learned model alone leaves the hand more, in one motion or both, than the observer alone, "
        f"which needs no model, on {len(lost)} of {len(found)} "
        f"plants{': ' if lost else ''}{', '.join(lost)}."
    ]
    for name in (BOTH, HYBRID, ALONE, LUGRE):
        most = ", ".join(_most(found, name, motion.name) for motion in MOTIONS)
        sentences.append(f"{name}: at most {most}.")
    return (" ".join(sentences),)


def _loses(left: Left) -> bool:
    # so written that a rig which stopped loses
    return any(not left[HYBRID][motion.name] <= left[ALONE][motion.name] for motion in MOTIONS)


def _most(found: Mapping[str, Left], name: str, motion: str) -> str:
    of = {plant: left[name][motion] for plant, left in found.items()}
    stopped = [plant for plant, left in of.items() if not np.isfinite(left)]
    moving = {plant: left for plant, left in of.items() if plant not in stopped}
    worst = max(moving, key=lambda plant: moving[plant], default=None)
    text = f"{motion} {100 * moving[worst]:.1f} % ({worst})" if worst else f"{motion} none"
    return text + (f", stopped by a fault on {', '.join(stopped)}" if stopped else "")


def _explanation() -> str:
    return (
        "Each plant of the mock's family in the place of the rig file's, with what its controller must be "
        f"told (docs/plants.md), moved by the same hand. '{BOTH}' is the rig file's observer on top of the "
        f"learned feed-forward, '{ALONE}' has gain {OBSERVER_ALONE_GAIN:g} and no feed-forward, '{LUGRE}' "
        "is the learned curve over bristles driven by the measured motion, without a force sensor. All "
        "share the energy account."
    )
