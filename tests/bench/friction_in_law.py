"""Friction with all that it knows, as the law looks it up: curve, four waves of place, the conservative part
and the state of a reversal.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from rtctl.control.feedforward import advance_stop
from rtctl.control.friction_curve import branch_magnitude
from rtctl.control.jit import bound, compiled, records
from rtctl.control.place_friction import conservative_torque, curve_and_place
from rtctl.control.records import PLACE_ORDERS, params_dtype, state_dtype
from rtctl.control.vocabulary import Policy
from rtctl.friction import artefact
from tests.bench.row import Row

TICKS = 4_000
ROUNDS = 101
STEP_RAD = 1e-3


@compiled
def _curve(models: np.ndarray, velocity: np.ndarray) -> float:
    model, total = models[0], 0.0
    for v in velocity:
        total += branch_magnitude(model, 0 if v >= 0.0 else 1, abs(v))
    return total


@compiled
def _place(models: np.ndarray, velocity: np.ndarray) -> float:
    model, total = models[0], 0.0
    x = 0.0
    for v in velocity:
        x += STEP_RAD * v
        curve, place = curve_and_place(model, 0 if v >= 0.0 else 1, abs(v), x)
        total += curve + place
    return total


@compiled
def _all(models: np.ndarray, states: np.ndarray, params: np.ndarray, velocity: np.ndarray) -> float:
    model, s, p, total = models[0], states[0], params[0], 0.0
    conservative = p.conservative_gain[0] > 0.0
    x = 0.0
    for v in velocity:
        dx = STEP_RAD * v
        x += dx
        advance_stop(s, p, 0, dx)
        direction = s.friction_stop[0]
        curve, place = curve_and_place(model, 0 if direction >= 0.0 else 1, abs(v), x)
        total += direction * (curve + place)
        if conservative:
            total += conservative_torque(model, x)
    return total


def rows(model_path: Path) -> list[Row]:
    """Time of a look, ns, in turn: of the curve, with four waves of place, and with the state of a reversal,
    by the stop operator and by LuGre's bristle, without and with the conservative part.

    The waves that the model does not have are of its first one's size: what a look takes goes by their
    number alone. Velocities are those of a hand that turns the joint to and fro.
    """
    filled = artefact.load(model_path).record()
    filled["place_orders"] = PLACE_ORDERS
    filled["place_coefficient"][..., 2:, :] = np.tile(
        filled["place_coefficient"][..., :2, :], (PLACE_ORDERS - 1, 1)
    )
    model = records(filled)
    t = np.arange(TICKS) / TICKS
    velocity = 1.2 * np.sin(4.4 * t) + 0.7 * np.sin(19.5 * t)

    def remembering(policy: Policy, gain: float = 0.0) -> Callable[[], float]:
        states, params = np.zeros(1, state_dtype(1)), np.zeros(1, params_dtype(1))
        params["friction_stop_rad"] = 1.4e-3
        params["friction_policy"], params["conservative_gain"] = int(policy), gain
        return bound(_all, model, records(states), records(params), velocity)

    # bound: to find out the types of these records at each call takes 20 ns of each look
    looks: dict[str, Callable[[], float]] = {
        "curve": bound(_curve, model, velocity),
        "curve and 4 orders of place": bound(_place, model, velocity),
        "curve, 4 orders, stop operator": remembering(Policy.STOP),
        "curve, 4 orders, LuGre bristle": remembering(Policy.LUGRE),
        "curve, 4 orders, LuGre bristle, conservative part": remembering(Policy.LUGRE, 1.0),
    }
    took: dict[str, list[float]] = {name: [] for name in looks}
    for _ in range(ROUNDS):
        for name, look in looks.items():
            began = time.thread_time_ns()  # without what others take of the core
            look()
            took[name].append((time.thread_time_ns() - began) / TICKS)
    beside = f"median of {ROUNDS} rounds in turn; a motion to and fro"
    return [
        Row(f"friction in the law: {name}", float(np.median(each)), "ns", beside,
            40.0 if "orders" in name else None)
        for name, each in took.items()
    ]  # fmt: skip
