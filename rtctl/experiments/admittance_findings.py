"""What the experiment on admittance displays found, and the sentences that follow from it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.experiments.admittance_runs import Contact, Rubbing, Shown
from rtctl.experiments.statistics import Estimate

LIGHT_DAMPING = 0.4
"""Virtual damping of free motion, shares of the joint's own."""
MASSES = (0.5, 1.0, 2.5)
"""Virtual masses felt, shares of the joint's inertia."""
SPRINGS_NM_RAD = (10.0, 50.0, 200.0, 500.0, 1000.0, 2000.0)
# fifty times the stiffest spring: behind any coupling here it is felt as the coupling alone
WALL_NM_RAD = 1e5
DAMPING_SHARES = (0.0, 0.2, 0.4, 0.6, 0.8)
"""Shares of the joint's damping: b_c of a coupling; and b_v above `LIGHT_DAMPING` of it, five times as
much."""
# past 14 Hz the watch takes the motion for a contact that rings: the picture is to show that, too
HZ = tuple(float(one) for one in np.geomspace(1.0, 30.0, 9))
FELT_WITHIN = 0.05
"""On a rigid joint that hardly rubs; on any other twice that."""
CERTIFIED = "admittance, certified"
LEFT_MOST = 0.12


@dataclass(frozen=True)
class Felt:
    """Mass and damping asked for and felt."""

    asked: Shown
    mass_kgm2: float
    damping_nms_rad: float
    joint: Rubbing
    hand_nm_rad: float
    """The stiffest hand this display is certified for, in any linear world; 0: none."""

    @property
    def error(self) -> float:
        """The larger of both errors, as a share."""
        mass = abs(self.mass_kgm2 / self.asked.mass_kgm2 - 1)
        return max(mass, abs(self.damping_nms_rad / self.asked.damping_nms_rad - 1))


Left = Mapping[str, Mapping[str, Estimate]]
"""Motion -> display -> RMS of the hand's torque over that of the impedance without compensation."""


def free_sentence(left: Left, hand_nm_rad: float) -> str:
    """Which display leaves less of the hand's torque, by the table."""
    parts = []
    for motion, rows in left.items():
        means = {name: rows[name].mean for name in ("impedance, compensated", "admittance, compensated")}
        if any(math.isnan(one) for one in means.values()):
            parts.append(f"{motion}: not every display was measured")
            continue
        best = min(means, key=lambda name: means[name])
        # not by `max`: of two that leave the same it would be the best one again
        (other,) = means.keys() - {best}
        parts.append(
            f"{motion}: the {best.split(',')[0]} leaves {100 * means[best]:.0f} %, the "
            f"{other.split(',')[0]} {100 * means[other]:.0f} %"
        )
    bears = "no hand" if not hand_nm_rad > 0 else f"hands up to {hand_nm_rad:.0f} N m/rad"
    return (
        f"Of the hand's torque without help, with what the rig file compensates: {'; '.join(parts)}. This "
        f"admittance is certified for {bears}."
    )


def felt_sentence(felt: Sequence[Felt]) -> str:
    """How far what is felt is from what is asked for, with and without what is sent ahead, by the table."""
    worst = {
        ahead: max((one.error for one in felt if one.asked.feedforward == ahead), default=math.nan)
        for ahead in (0.0, 1.0)
    }
    # `max` passes a NaN over or not by its place: one rig that stopped must not be left out unseen
    if any(math.isnan(one) for one in (*worst.values(), *(one.error for one in felt))):
        return "Mass and damping felt: a rig stopped on the way."
    verb = "brings" if worst[1.0] < worst[0.0] else "does not help: it brings"
    return (
        f"Mass and damping felt between .5 and 5 Hz are off by up to {100 * worst[0.0]:.0f} % by the servo "
        f"alone; what is sent ahead {verb} that to {100 * worst[1.0]:.0f} %."
    )


def contact_sentence(touched: Mapping[str, Mapping[str, Contact]]) -> str:
    """The stiffest spring that each display renders within a tenth, and what rang, by the table."""
    parts = []
    for name, worlds in touched.items():
        # within a tenth and calm: a spring that rings is rendered by its mean alone
        right = [
            worlds[f"spring of {k:g}"].calm
            and abs(worlds[f"spring of {k:g}"].stiffness_nm_rad / k - 1) <= 0.1
            for k in SPRINGS_NM_RAD
        ]
        # up to the first that fails
        true = SPRINGS_NM_RAD[: right.index(False)] if False in right else SPRINGS_NM_RAD
        loud = [world for world, one in worlds.items() if not one.calm]
        rings = f", and rings or stops on: {', '.join(loud)}" if loud else ""
        told = f"springs from the softest tried up to {max(true):g} N m/rad" if true else "no spring tried"
        parts.append(f"the {name} renders {told} within a tenth{rings}")
    return f"In contact {'; '.join(parts)}."
