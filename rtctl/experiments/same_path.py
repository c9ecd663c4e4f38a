"""Same hand or same path: two ways to say how much torque the compensation takes off a hand, side by side.

A hand of 5 N m/rad wishes the same with and without compensation, but goes another path: it gets nearer to
its wish where less holds it back. What it saves then is what a person saves who wishes the same. A stiff hand
is led along the same path whatever the friction, and what it saves is what the motor takes over of the torque
of that very motion. Neither is the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hw.motion import own_size
from rtctl.experiments import virtual
from rtctl.experiments.order import Order
from rtctl.experiments.seeds import over_seeds
from rtctl.experiments.statistics import Estimate, estimate, rms
from rtctl.experiments.virtual import Change, Motion, Variant
from rtctl.friction.learn.report_tables import Table
from rtctl.simulation.closed_loop import Simulation

STIFF_NM_RAD = 1000.0
STIFF_NMS_RAD = 2.0
"""Hand that leads the joint: the paths without and with compensation differ by less than one per cent."""


def led(simulation: Simulation) -> None:
    """Let a stiff hand lead the joint along its wish."""
    simulation.plant_params["hand_stiffness_nm_rad"] = own_size(
        "stiffness_nm_rad", STIFF_NM_RAD, simulation.motion
    )
    simulation.plant_params["hand_damping_nms_rad"] = own_size(
        "damping_nms_rad", STIFF_NMS_RAD, simulation.motion
    )


WAYS: dict[str, Change] = {"same hand": virtual.unchanged, "same path": led}


@dataclass(frozen=True)
class Way:
    """What the compensation takes off the RMS torque, and how far the paths differ, both 0 to 1."""

    reduction: Estimate
    path: Estimate


def compare(order: Order, motion: Motion) -> dict[str, Way]:
    """Reduction by the rig file's compensation and difference of the paths, for each of `WAYS`."""
    found = {}
    for name, change in WAYS.items():
        # off and on of one seed side by side: the noise and the place are the same in both
        pair = tuple(Variant(name, compensation, change) for compensation in (0.0, 1.0))

        def once(order: Order, seed: int, pair: tuple[Variant, ...] = pair) -> tuple[float, float]:
            off, on = (virtual.measure(order.loaded, seed, motion, one).truth for one in pair)
            return figures(off, on)

        # both figures of a seed from the same two runs
        rows = np.array(over_seeds(order, once))
        found[name] = Way(estimate(rows[:, 0]), estimate(rows[:, 1]))
    return found


def figures(off: np.ndarray, on: np.ndarray) -> tuple[float, float]:
    """Share of the RMS hand torque saved, and RMS difference of the paths as a share of the path's own
    RMS."""
    left = rms(on["hand_torque_nm"][:, 0]) / rms(off["hand_torque_nm"][:, 0])  # true torques
    # about the mean: where it sticks is no path
    here, there = (x["position_rad"][:, 0] - x["position_rad"][:, 0].mean() for x in (off, on))
    # by the path without help: it is the one that both are to follow
    return 1.0 - left, rms(there - here) / rms(here)


def table(found: dict[str, dict[str, Way]], motion: str = "rotary") -> Table:
    """Motion of the hand -> way -> figures, as a table of the page."""
    stiffness = own_size("stiffness_nm_rad", STIFF_NM_RAD, motion)
    rows = tuple(
        (moved, name, way.reduction.text(100, ".1f"), way.path.text(100, ".2g"))
        for moved, ways in found.items()
        for name, way in ways.items()
    )
    caption = (
        "The rig file's compensation against none. 'Same hand': the experiment's own, whose wish is the "
        f"same and whose path is not. 'Same path': a hand of {stiffness:g} N m/rad leads the joint. Paths: "
        "RMS difference about the mean, in % of the path without compensation."
    )
    return Table(
        caption, ("motion", "what is the same", "reduction of the RMS torque, %", "paths differ by, %"), rows
    )
