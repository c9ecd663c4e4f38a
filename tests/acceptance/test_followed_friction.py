"""The joint's friction changes by a tenth while a hand moves it: the feed-forward follows, and takes the
share of it that it took before.
"""

import math

import numpy as np
import pytest

from rtctl.control.compensation_limit import FACTOR_MOST
from rtctl.friction.drift_watch import RigWatch
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation
from tests.bench.drift_plants import MOTIONS, moved

CHUNK_S, DRIFT_S = 1.0, 60.0
PER_MIN = 0.02


def rig(drift, motion="swing", gain=0.8, cap_share=0.105):
    """The mock with room below its two lines, its dry and viscous friction `drift` times as large from
    `DRIFT_S` on.
    """
    loaded = load("configs/mock.toml")
    axis = loaded.config.axis[0]
    table = axis.friction.drift.model_copy(update={"adapt_per_min": PER_MIN})
    friction = axis.friction.model_copy(update={"drift": table, "gain": gain, "cap_share": cap_share})
    axis = axis.model_copy(update={"friction": friction})
    loaded = loaded.model_copy(update={"config": loaded.config.model_copy(update={"axis": (axis,)})})
    return moved(loaded, MOTIONS[motion], [[0.0, 1.0, 1.0], [DRIFT_S, 1.0, 1.0], [DRIFT_S + 0.01, *drift]])


class Followed:
    """A simulated rig whose watch asks its law to follow, as the host does."""

    def __init__(self, loaded):
        self.sim = Simulation(loaded)
        self.watch = RigWatch(
            self.sim.plan.params, self.sim.plan.model, [axis.friction.drift for axis in loaded.config.axis]
        )
        self.axis = self.watch.axes[0]
        self.factors, self.shares, self.moved_s = [], [], 0.0
        self.follow(self.sim.arm(compensation=1.0))

    def follow(self, rows):
        self.watch.follow(rows)
        self.sim.change(friction_change=self.axis.factor - 1.0)
        self.factors.append(rows["friction_factor"][:, 0])
        velocity, torque = rows["velocity_rad_s"][:, 0], rows["feedforward_torque_nm"][:, 0]
        sliding = np.abs(velocity) > self.axis.by.speed_min_rad_s
        self.moved_s += float(sliding.mean()) * len(rows) * self.sim.plan.period_s
        gate = rows["friction_gate"][:, 0]
        open_ = sliding & (gate > 0.95) & (np.abs(rows["friction_sign"][:, 0]) > 0.999)
        open_ &= rows["assistance_share"][:, 0] == 1.0
        v = velocity[open_]
        if open_.any():
            whole = torque[open_] * np.sign(v) / gate[open_]
            self.shares.append(float(whole.sum() / self.axis.by.dry_nm(v).sum()))

    def run(self, seconds):
        """Share of the learned dry friction that is compensated with the gate open, over the last of these
        seconds.
        """
        for _ in range(math.ceil(seconds / CHUNK_S)):
            self.follow(self.sim.run(CHUNK_S))
        return float(np.mean(self.shares[-20:]))


@pytest.mark.parametrize(("dry", "viscous"), [(0.9, 0.9), (1.1, 1.0)])
def test_the_compensated_share_returns_no_faster_than_it_may_and_never_above_what_was_judged(dry, viscous):
    made = Followed(rig((dry, viscous)))
    assert made.watch.axes[0].bounds.most == FACTOR_MOST
    before = made.run(DRIFT_S - made.sim.time_s)
    moved_before = made.moved_s
    made.run(60.0)
    halfway = made.axis.factor
    after = made.run(420.0)
    factors = np.concatenate(made.factors)
    assert abs(halfway - 1.0) < 0.5 * abs(dry - 1.0), "a tenth takes five minutes"
    assert after / (dry * before) == pytest.approx(1.0, abs=0.02)
    per_tick = PER_MIN / 60.0 * made.sim.plan.period_s
    assert np.abs(np.diff(factors)).max() <= per_tick * (1 + 1e-9)
    assert abs(halfway - factors[0]) <= PER_MIN / 60.0 * made.moved_s
    assert moved_before > 10.0
    assert 0.7 <= factors.min() <= factors.max() <= FACTOR_MOST
    assert made.axis.stopped == ""


def test_a_hand_that_rests_moves_no_factor():
    made = Followed(rig((0.9, 1.0), motion="swing"))
    made.run(120.0)
    made.sim.plant_params["hand_kind"] = 0
    made.run(5.0)
    held = made.axis.factor
    made.run(60.0)
    assert made.axis.factor == held < 1.0
