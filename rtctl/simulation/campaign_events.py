"""What operators, renderers and a busy machine do in a campaign: random, but drawn from one generator."""

from __future__ import annotations

import math

import numpy as np

from hw.generator import uniform
from rtctl.control.environments.laws import PASSIVE, set_own
from rtctl.control.environments.table import OWN, Environment
from rtctl.control.records import Record
from rtctl.control.vocabulary import State
from rtctl.simulation.jit import compiled

_IDLE, _FAULT, _ESTOP = int(State.IDLE), int(State.FAULT), int(State.ESTOP)
_KINDS = len(Environment)
# plain numbers: compiled code cannot look into a table of classes
TRIED = tuple((float(own.tried[0]), float(own.tried[1])) for own in OWN)

RIGHT_LEASE = 7
WRONG_LEASE = 13

STREAM_TICKS = 3000
"""Length of the stretches of a passive rig with and without a stream of parameters."""


@compiled
def chance(rng: np.ndarray, one_in: float) -> bool:
    """True once in `one_in` calls on average."""
    return uniform(rng) * one_in < 1.0


@compiled
def between(rng: np.ndarray, low: float, high: float) -> float:
    """Uniform number in [low, high)."""
    return low + (high - low) * uniform(rng)


@compiled
def broken(rng: np.ndarray, value: float) -> float:
    """`value`, or once in a hundred something no caller should send."""
    if not chance(rng, 100.0):
        return value
    pick = int(4 * uniform(rng))
    if pick == 0:
        return math.nan
    if pick == 1:
        return math.inf
    return -1e9 if pick == 2 else 1e9


@compiled
def operate(s: Record, c: Record, rng: np.ndarray) -> None:
    """Requests of the operator, some of them in the wrong state or epoch."""
    # mostly where it can be granted, or nothing would ever run
    if chance(rng, 40.0) and (s.state == _IDLE or chance(rng, 50.0)):
        c.arm_count += 1
        c.epoch = s.epoch if not chance(rng, 10.0) else s.epoch - 1  # one in ten of before the last stop
    if chance(rng, 60.0) and (s.state in (_FAULT, _ESTOP) or chance(rng, 50.0)):
        c.reset_count += 1
    # rare: until it is armed again, 40 ticks later on average at best, nothing else is tried
    if chance(rng, 3000.0):
        c.stop_count += 1
    if chance(rng, 5000.0):
        c.tare_count += 1
    if chance(rng, 40000.0):
        c.shutdown_count += 1


@compiled
def set_world(c: Record, axis: int, kind: int, rng: np.ndarray, own: bool) -> None:
    """A random environment of this kind, of any stiffness the law may be given; with `own`, its own
    parameters too."""
    c.environment_kind[axis] = kind
    # by ratio: soft worlds and walls alike
    c.environment_stiffness_nm_rad[axis] = 10.0 ** between(rng, 0.0, 4.0)
    c.environment_damping_nms_rad[axis] = between(rng, 0.0, 0.2)
    c.environment_center_rad[axis] = between(rng, -0.3, 0.3)
    for which in range(len(TRIED)):
        # drawn, wanted or not: the stream stays in step
        value = between(rng, TRIED[which][0], TRIED[which][1])
        if own:
            set_own(c, axis, which, value)


@compiled
def change_world(c: Record, rng: np.ndarray) -> None:
    """Now and then another environment or another share of compensation and factor of the friction, broken
    numbers among them."""
    for axis in range(len(c.environment_kind)):
        if chance(rng, 4000.0):
            set_world(c, axis, int(_KINDS * uniform(rng)), rng, True)
            c.environment_stiffness_nm_rad[axis] = broken(rng, c.environment_stiffness_nm_rad[axis])
            c.environment_center_rad[axis] = broken(rng, c.environment_center_rad[axis])
        if chance(rng, 4000.0):
            c.compensation[axis] = broken(rng, uniform(rng))
            # without a draw of its own; where the share is broken, so is the factor
            c.friction_change[axis] = 0.5 * (c.compensation[axis] - 0.7)


@compiled
def change_display(p: Record, c: Record, rng: np.ndarray) -> None:
    """Now and then another mass, another damping, the other display, within what the rig allows or beyond, or
    broken."""
    for axis in range(len(c.display_kind)):
        # an impedance that stays one has neither mass nor the right to change: nothing would be asked of it
        if p.display_kind[axis] == 0 and p.display_change[axis] == 0:
            continue
        if chance(rng, 2000.0):
            # 12 % are below 0, 29 % beyond what the rig allows
            c.mass_kgm2[axis] = broken(rng, p.mass_max_kgm2[axis] * between(rng, -0.2, 1.5))
            c.mass_damping_nms_rad[axis] = broken(
                rng, p.mass_damping_max_nms_rad[axis] * between(rng, -0.2, 1.5)
            )
        if chance(rng, 2000.0):
            c.display_kind[axis] = int(2 * uniform(rng))


@compiled
def stream_world(c: Record, k: int, rng: np.ndarray) -> None:
    """What a graphics program at 60 Hz sets in tick `k`: every other stretch a stream of jumping numbers.

    Never a remote proxy: that one is an active hand, of which passivity is not claimed."""
    streaming = (k // STREAM_TICKS) % 2 == 1
    for axis in range(len(c.environment_kind)):
        if chance(rng, 2000.0):
            set_world(c, axis, PASSIVE[int(len(PASSIVE) * uniform(rng))], rng, True)
        if streaming and chance(rng, 17.0):
            set_world(c, axis, c.environment_kind[axis], rng, False)


@compiled
def render(s: Record, c: Record, rng: np.ndarray, silence: int) -> int:
    """Targets of renderers, right and wrong ones; returns how many ticks of silence are left."""
    if silence > 0:
        return silence - 1
    if chance(rng, 400.0):
        return int(between(rng, 1.0, 250.0))  # across HOLD (20) and STOP (100)
    c.target_count += 1
    c.target_epoch = s.epoch if not chance(rng, 50.0) else s.epoch - 1
    c.target_lease = RIGHT_LEASE if not chance(rng, 20.0) else WRONG_LEASE
    for axis in range(len(c.target_position_rad)):
        step = between(rng, -0.002, 0.002)
        if chance(rng, 500.0):
            step = between(rng, -1.0, 1.0)
        c.target_position_rad[axis] = broken(rng, s.position_rad[axis] + step)
        c.target_velocity_rad_s[axis] = broken(rng, between(rng, -5.0, 5.0) if chance(rng, 500.0) else 0.0)
    return 0


@compiled
def slots_missed(rng: np.ndarray) -> int:
    """Grid slots that pass before the next tick."""
    if chance(rng, 300.0):
        return int(between(rng, 1.0, 4.0))  # across OVERRUN, 3 in a row, and STALE
    return int(between(rng, 8.0, 40.0)) if chance(rng, 8000.0) else 0  # across STALLED, 10 periods
