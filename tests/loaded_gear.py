"""Points that a gear gives whose friction grows with load: steady speeds both ways under weights, by the
closed forms of the simulated joint.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from hw.simulators.mock_load import load_levels
from rtctl.friction.learn.load_terms import NAMES
from rtctl.friction.load import COEFFICIENTS
from rtctl.friction.points import FrictionPoints

MATTERS = 0.02
"""A coefficient matters that makes this share of the largest friction at the largest load."""

RUNG_OF = {"m3": "load", "m4": "load_stribeck", "m5": "load_by_flow", "m6": "load_squared"}

_OF_MOCK = {
    "load_outside": "outside",
    "load_motor": "motor",
    "load_outside_peak": "outside_peak",
    "load_motor_peak": "motor_peak",
    "load_outside_square_nm": "outside_square_per_nm",
    "load_motor_square_nm": "motor_square_per_nm",
}


def friction_nm(values: Mapping[str, float], speed: float, outside_nm: float, motor_nm: float) -> float:
    """Friction at a speed, with the load terms as the simulated joint computes them; `values` by the names of
    `load_terms.NAMES`.
    """
    p = SimpleNamespace(**{mock: [values[name]] for mock, name in _OF_MOCK.items()})
    levels: Any = getattr(load_levels, "py_func", load_levels)
    base, peak = levels(motor_nm, outside_nm, p, 0)
    fall = np.exp(-((speed / values["stribeck_rad_s"]) ** values["stribeck_power"]))
    dry = values["coulomb_nm"] + base + fall * (values["stribeck_nm"] + peak)
    return float(dry + values["viscous_nms_rad"] * speed)


def motor_for(values: Mapping[str, float], speed: float, outside_nm: float) -> float:
    """The motor's torque that keeps the speed: what it and the weight give together is the friction."""
    low, high = -1e3, 1e3
    for _ in range(60):
        middle = (low + high) / 2
        short = middle + outside_nm < friction_nm(values, speed, outside_nm, middle)
        low, high = (middle, high) if short else (low, middle)
    return (low + high) / 2


def points(
    values: Mapping[str, float], load_nm: float, fastest: float, noise_nm: float, seed: int, speeds: int = 14
) -> tuple[FrictionPoints, np.ndarray]:
    """Points at weights up to `load_nm` each way, with noise of the motor's torque, and their true
    friction.
    """
    noise = np.random.default_rng(seed)
    rows, loads, truth = [], [], []
    for sign in (1, -1):
        for speed in np.geomspace(0.02, 1.0, speeds) * fastest:
            for outside in np.linspace(-load_nm, load_nm, 13):
                true = motor_for(values, speed, outside) + outside
                seen = true + noise.normal(0, noise_nm)
                if min(true, seen) > 0:
                    rows.append((sign * speed, seen, sign, np.nan, np.nan))
                    loads.append(sign * outside)
                    truth.append(true)
    made = FrictionPoints.from_rows(rows, "made", "0" * 64, {"load_nm": np.array(loads)})
    return made, np.array(truth)


def that_matter(values: Mapping[str, float], load_nm: float, largest_nm: float) -> dict[str, float]:
    """The load coefficients that can be asked for."""
    part = {name: values[name] * load_nm ** (2 if name.endswith("per_nm") else 1) for name in COEFFICIENTS}
    return {name: values[name] for name in COEFFICIENTS if part[name] >= MATTERS * largest_nm}


def as_told(values: Mapping[str, float]) -> dict[str, float]:
    """All parameters, 0 where nothing is said; a peak that falls where nothing is said of it."""
    return {
        name: values.get(name, 1.0 if name.startswith("stribeck_") and name != "stribeck_nm" else 0.0)
        for name in NAMES
    }
