"""Hands that wish the same motion, and then to hold still: does the compensation let the joint rest in them?

The hand swings the joint by two periods of the fast sine; from then on its wish stands still. What moves two
seconds later is moved by the compensation: in presliding friction is a spring, and torque that follows the
sign of the motion, or of the hand's torque, is negative damping there (docs/theory.md 5.4)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hw.motion import own_size
from hw.simulators.mock_records import Hand
from rtctl.control.vocabulary import State
from rtctl.experiments import virtual
from rtctl.experiments.order import Order
from rtctl.experiments.seeds import over_seeds
from rtctl.experiments.statistics import rms
from rtctl.experiments.virtual import FAST_SINE, Variant
from rtctl.rig_file.config import LoadedConfig
from rtctl.simulation.campaign_still import FED_J, JUDGED_S, QUIET_RAD_S, SETTLE_S

# the stiffer and the less damped, the more like a spring that rings with the joint's mass
HANDS = tuple((k, b) for k in (5.0, 20.0, 100.0, 500.0) for b in (0.1, 0.3))
"""Stiffness, N m/rad, and damping, N m s/rad: from a loose grip to a clamp, all passive and hardly damped."""


@dataclass(frozen=True)
class Still:
    """The worst of `HANDS`: RMS speed, rad/s; energy the hand was given, J; whether the rig stopped for a
    fault."""

    speed_rad_s: float
    fed_j: float
    stopped: bool

    def faults(self, motion: str = "rotary") -> list[str]:
        """What is wrong on an axis of this motion, in words. NaN is wrong."""
        most_rad_s = own_size("speed_rad_s", QUIET_RAD_S, motion)
        found = {
            "shakes a hand that holds still": not self.speed_rad_s <= most_rad_s,
            "feeds a hand that holds still": not self.fed_j <= FED_J,
            "stopped by a fault in a hand that holds still": self.stopped,
        }
        return [text for text, true in found.items() if true]


def worst(order: Order, variant: Variant) -> Still:
    """The worst of every hand, each at a place and with a noise of its own."""

    def once(order: Order, number: int) -> Still:
        return held(order.loaded, number, variant, *HANDS[number])

    # the number of the hand is its seed: places and noise differ, too
    found = over_seeds(replace(order, seeds=len(HANDS)), once)
    return Still(
        float(np.max([one.speed_rad_s for one in found])),
        float(np.max([one.fed_j for one in found])),
        any(one.stopped for one in found),
    )


def held(loaded: LoadedConfig, seed: int, variant: Variant, stiffness: float, damping: float) -> Still:
    """One hand: the fast sine, then still; figures of the time from `SETTLE_S` on, true."""
    simulation = virtual.make(loaded, seed)
    # moved first: bristles, mass and observer are then as motion leaves them, and not as they were made
    FAST_SINE.on(loaded).apply(simulation)
    p = simulation.plant_params
    p["hand_stiffness_nm_rad"] = own_size("stiffness_nm_rad", stiffness, simulation.motion)
    p["hand_damping_nms_rad"] = own_size("damping_nms_rad", damping, simulation.motion)
    variant.change(simulation)
    simulation.arm(compensation=variant.compensation)
    simulation.run(virtual.stroke_ends_s(simulation, FAST_SINE) - simulation.time_s)
    p["hand_kind"] = int(Hand.REST)
    simulation.run(SETTLE_S)
    start_rad = float(simulation.plant_state["position_rad"][0, 0])
    trace = simulation.run(JUDGED_S - SETTLE_S)
    truth = simulation.truth
    # the first step, too: else its work is missing
    steps_rad = np.diff(truth["position_rad"][:, 0], prepend=start_rad)
    # the largest of the running sum: what the hand got in between and gave back moved it all the same
    given_j = -np.cumsum(truth["hand_torque_nm"][:, 0] * steps_rad)
    # told apart: a rig that stopped is quiet, and helps nobody
    stopped = bool(np.any(trace["state"] != State.ACTIVE))
    return Still(rms(truth["velocity_rad_s"][:, 0]), float(given_j.max()), stopped)
