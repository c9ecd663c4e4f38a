"""A renderer that wants a passive hand's energy: remote targets with full knowledge of the joint, every
tick."""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np

from hw.generator import uniform
from rtctl.control.records import Record
from rtctl.control.vocabulary import Environment
from rtctl.simulation.jit import compiled

LEASE = 7
_REMOTE = int(Environment.REMOTE)


class Pursuit(IntEnum):
    """Where the target is: what a strategy takes `reach_rad`, `rate` and `pull` for stands beside it."""

    NONE = 0
    SWING = 1  # a sine of `reach` at `rate` rad/s, whatever the joint does; velocity `pull` times its own
    LEAD = 2  # ahead by `reach` for each v_max of the joint's speed; velocity `pull` times the joint's
    PUSH = 3  # `reach` ahead in the sense of motion; velocity `pull` v_max the same way
    PUMP = 4  # PUSH, and `reach` to and fro every other tick


@compiled
def _sense(speed: float) -> float:
    return 1.0 if speed >= 0.0 else -1.0


@compiled
def _aim(
    kind: int, time_s: float, x: float, v: float, v_max: float, reach: float, rate: float, pull: float
) -> tuple[float, float]:
    """Position and velocity of the target, rad and rad/s."""
    if kind == Pursuit.SWING:
        return reach * math.sin(rate * time_s), pull * reach * rate * math.cos(rate * time_s)
    if kind == Pursuit.LEAD:
        return x + reach * v / v_max, pull * v
    return x + reach * _sense(v), pull * v_max * _sense(v)


@compiled
def pursue(s: Record, p: Record, c: Record, plant: Record, foe: Record, k: int, rng: np.ndarray) -> None:
    """Send the targets of tick `k`, or be silent for a while, then come back.

    Parameters
    ----------
    plant : record
        The truth: what no renderer can know better.
    foe : record of `FOE`
        Its strategy."""
    if uniform(rng) * 3000.0 < 1.0:  # help on and off at will: nothing of it may be a source
        for axis in range(len(c.compensation)):
            c.compensation[axis] = 1.0 if c.compensation[axis] < 0.5 else 0.0
    # each return from HOLD raises the authority anew: a source without end if nobody paid for it
    if k % max(foe.between_ticks, 1) < foe.silent_ticks or k % max(foe.every_ticks, 1) != 0:
        return
    c.target_count += 1
    c.target_epoch, c.target_lease = s.epoch, LEASE
    for axis in range(len(c.target_position_rad)):
        c.environment_kind[axis] = _REMOTE
        x, v = plant.position_rad[axis], plant.velocity_rad_s[axis]
        aim, pull = _aim(
            foe.kind, k * p.period_s, x, v, p.velocity_limit_rad_s[axis], foe.reach_rad, foe.rate, foe.pull
        )
        if foe.kind == Pursuit.PUMP and k % 2 == 0:
            aim -= 2.0 * foe.reach_rad * _sense(v)
        c.target_position_rad[axis], c.target_velocity_rad_s[axis] = aim, pull


def foe_record(draw: np.random.Generator) -> np.ndarray:
    """Some strategy, resonant swings and silences among them."""
    foe = np.zeros(1, FOE)
    row = foe[0]
    row["kind"] = draw.integers(1, len(Pursuit))
    row["reach_rad"] = math.exp(draw.uniform(math.log(2e-3), math.log(1.0)))
    row["rate"] = math.exp(draw.uniform(math.log(2.0), math.log(60.0)))
    row["pull"] = draw.choice([0.0, 1.0, draw.uniform(-2.0, 2.0)])
    row["every_ticks"] = draw.choice([1, 1, 5, 17])
    row["silent_ticks"] = draw.choice([0, 22, 30, 60])  # 20 are HOLD, 100 STOP
    row["between_ticks"] = draw.integers(150, 1500)
    return foe


FOE = np.dtype(
    [
        ("kind", "<i8"),
        ("reach_rad", "<f8"),
        ("rate", "<f8"),
        ("pull", "<f8"),
        ("every_ticks", "<i8"),  # a target in every so many ticks
        ("silent_ticks", "<i8"),  # of every `between_ticks`: long enough for HOLD
        ("between_ticks", "<i8"),
    ]
)
