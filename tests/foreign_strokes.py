"""Random rigs, certified, with joints and hands for `tests/foreign_swings.py`."""

import math
from typing import NamedTuple

import foreign_luck
import numpy as np
from foreign_files import fitted, model
from foreign_swings import AXIS

SWINGS_HZ = {0.03: 0.1, 0.08: 0.1, 0.3: 0.25, 0.8: 0.5, 1.6: 0.8}
"""Swings a second of a hand whose largest speed is this, rad/s."""
_OF_LENGTH = {
    "motor": -2, "link": -2, "gear": -2, "gear_damping": -2, "viscous": -2, "link_viscous": -2, "coulomb": -1,
    "breakaway": -1, "stribeck": 1, "bristle": -2, "bristle_damping": -2, "link_dry": -1, "spring": -2,
    "damper": -2, "mass": -2, "grip": -2, "amplitude": 1,
}  # fmt: skip


class Luck(foreign_luck.Luck):
    """Numbers of one case of this judge."""

    FIRST = 777


def _joint(luck, size):
    """Of a rotary axis, by its torque limit."""
    dry = size * luck.spread(0.03, 0.15)
    inertia, peak = dry / luck.spread(8, 60), dry * luck.within(1.05, 1.6)
    made = {
        "stribeck": luck.spread(0.03, 0.3), "viscous": dry / luck.spread(2, 25),
        "kind": luck.one(0, 0, 1, 1, 2), "elements": int(luck.draw.integers(4, 12)),
        "exponent": luck.one(0.7, 1.0, 2.0, 3.0), "bristle": peak / luck.spread(3e-4, 8e-3),
        "link": 0.0, "gear": 0.0, "gear_damping": 0.0, "link_viscous": 0.0,
    }  # fmt: skip
    if made["kind"] == 2:
        made["bristle"] = peak / 3e-4
    made["bristle_damping"] = luck.one(0.0, luck.within(0.05, 0.4)) * math.sqrt(made["bristle"] * inertia)
    made |= {"motor": inertia, "link_dry": 0.0}
    if luck.draw.random() < 0.65:
        share, hz = luck.within(0.25, 0.75), luck.spread(20, 150)
        link, motor = share * inertia, (1 - share) * inertia
        gear = link * motor / inertia * (2 * math.pi * hz) ** 2
        made["link_dry"] = luck.one(0.0, 0.0, luck.within(0.05, 0.3)) * dry
        damping = 2 * luck.within(0.005, 0.04) * math.sqrt(gear * link * motor / inertia)
        made |= {"motor": motor, "link": link, "gear": gear, "gear_damping": damping}
        made["link_viscous"] = luck.one(0.0, 0.2) * made["viscous"]
    return made | {"coulomb": dry - made["link_dry"], "breakaway": peak - made["link_dry"]}


def hand(luck, dry, peak, inertia):
    """Who holds and moves it: its numbers, its kind, and its largest speed, rad/s."""
    size = luck.one(1.0, dry / 0.25) if dry < 0.25 else dry / 0.25 * luck.one(1.0, 0.3)
    size = min(size, 14 * inertia / 0.012) if size > dry / 0.25 else size
    kind = luck.one("held", "grip", "mass", "bare", "any")
    mass = {
        "held": luck.one(0.0, luck.within(0.5, 6) * inertia), "grip": luck.within(0.5, 6) * inertia,
        "mass": luck.within(0.5, 8) * inertia, "bare": luck.one(0.0, luck.within(0, 0.02) * size),
        "any": luck.within(0, 0.02) * size,
    }[kind]  # fmt: skip
    spring = {
        "held": luck.within(300, 500), "bare": luck.spread(80, 500), "grip": luck.spread(2, 100),
        "mass": luck.spread(1, 100), "any": luck.spread(1, 500),
    }[kind] * size  # fmt: skip
    damper = {
        "held": luck.spread(0.1, 1.0), "bare": 0.0, "grip": luck.spread(0.01, 0.5),
        "mass": luck.one(0.0, luck.spread(0.003, 0.3)), "any": luck.one(0.0, luck.spread(0.003, 1.0)),
    }[kind] * size  # fmt: skip
    grip = luck.within(80, 500) * size if kind == "grip" else 0.0
    fastest = luck.one(0.03, 0.08, 0.03, 0.08, 0.3, 0.8, 1.6)
    hz, triangle = SWINGS_HZ[fastest], luck.one(0, 0, 1)
    stretch = peak / spring * luck.one(0.0, 1.0)  # some hands pull through what friction holds
    amplitude = fastest / (2 * math.pi * hz) * (math.pi / 2 if triangle else 1) + stretch
    made = {
        "spring": spring, "damper": damper, "mass": mass, "grip": grip, "omega": 2 * math.pi * hz,
        "amplitude": amplitude, "triangle": triangle, "from_s": 3.0, "to_s": 3.0 + max(2, round(4 * hz)) / hz,
    }  # fmt: skip
    return made, kind, fastest


class Drawn(NamedTuple):
    """A certified rig in a hand."""

    loaded: object
    axis: np.ndarray
    kind: str
    fastest: float
    length_m: float
    """1, or of a carriage as far as its handle is from the joint it would be."""


def row(numbers, length_m):
    """One axis of `foreign_swings` at a handle so far away."""
    a = np.zeros(1, AXIS)
    for name, value in numbers.items():
        a[name] = value * length_m ** _OF_LENGTH.get(name, 0)
    return a


def drawn(seed, folder):
    """A random rig file with its joint and hand; `loaded` None where `rtctl check` refuses it."""
    luck = Luck(4242, seed)
    linear = luck.draw.random() < 0.25
    size = luck.spread(5e-3, 40.0)
    joint = _joint(luck, size)
    dry, peak = joint["coulomb"] + joint["link_dry"], joint["breakaway"] + joint["link_dry"]
    holder, kind, fastest = hand(luck, dry, peak, joint["motor"] + joint["link"])
    length_m = 0.1 if linear else 1.0
    rate_hz = luck.one(500.0, 1000.0, 1000.0, 2000.0, 4000.0)
    every = luck.one(1, 1, 1, 2, 3)
    late, lag_hz = luck.one(0.0, 0.0, 1.0, luck.within(0, 2.0)), luck.one(0.0, luck.spread(80, 3000))
    every = min(every, 2) if rate_hz == 500.0 else every
    own_every, own_late = luck.one(every, every, 1), late * luck.one(1.0, 1.0, luck.within(0, 1))
    lag_s = 1 / (2 * math.pi * lag_hz * luck.one(1.0, 1.0, luck.within(1, 3))) if lag_hz else 0.0
    most, lever_m = size / length_m, 1.0 if linear else 0.1
    device = {
        "late_ticks": own_late, "lag_s": lag_s, "sample_ticks": own_every, "current_noise": 0.002,
        "force_step": most / lever_m * 2e-5, "force_noise": most / lever_m * luck.one(0.0, 1e-5, 1e-4),
    }  # fmt: skip
    a = row(joint | holder | device, length_m)
    told = {name: float(a[name][0]) for name in AXIS.names} | {"dry": dry / length_m, "peak": peak / length_m}
    says, models = _file(luck, told, linear, most, lever_m, length_m, lag_hz)
    loaded = fitted(
        "mock-linear.toml" if linear else "mock.toml", [says], folder, luck.one(0.5, 0.9, 0.995),
        models=models,
        device={"timing": {"sample_every_ticks": every, "transport_delay_ticks": late}}, rate_hz=rate_hz,
    )  # fmt: skip
    return Drawn(loaded, a, kind, fastest, length_m)


def _file(luck, told, linear, most, lever_m, length_m, lag_hz):
    """What the rig file says of it, and its model of friction."""
    coupling = {"delay_ticks": 0.0, "damping_nms_rad": told["viscous"] * luck.within(0.0, 0.6)}
    says = {
        "inertia_kgm2": told["motor"] + told["link"], "viscous_nms_rad": told["viscous"],
        "torque_limit_nm": most, "torque_rate_nm_s": 100 * most,
        "torque_constant_nm_a": most / 5.0 / (2 * math.pi / 0.005 if linear else 1.0), "gear_ratio": 1.0,
        "gear_efficiency": 1.0, "velocity_limit_rad_s": 8.0 * length_m, "current_limit_a": 10.0,
        "drive": {"current_loop_hz": lag_hz}, "coupling": coupling | {"stiffness_nm_rad": 1e-3 * most},
        "force": {
            "limit_n": min(max(100 * most / lever_m, 1), 9e3), "resolution_n": max(told["force_step"], 1e-6)
        },
        "encoder_counts_per_rev": luck.one(2e4, 1e5) if linear else luck.one(1.6e5, 1e6),
        "friction": {
            "gain": luck.one(0.8, 0.9, 0.95), "intent_nm": 0.2 * told["dry"], "gate_nm": 0.1 * told["dry"],
            "presliding_rad": told["peak"] / told["bristle"], "blend_rad_s": 0.08 * length_m,
        },
        "environment": {"kind": "free", "stiffness_nm_rad": 1.0, "center_rad": 0.0},
    }  # fmt: skip
    says["friction"]["policy"] = luck.one("hybrid", "hybrid", "hybrid", "observer")
    if not linear:
        says["lever_m"] = [0.0, lever_m, 0.0]
    own = {name: told[name] for name in ("stribeck", "viscous", "bristle")}
    own |= {"coulomb": told["dry"], "breakaway": told["peak"], "backward": 1.0}
    rig, motion = ("slide", "linear") if linear else ("mock", "rotary")
    return says, [model(own, rig, motion, luck.one(1.0, 1.0, 0.9, 1.05))]


def in_box(case, a):
    """Whether the hand is one of those that `rtctl check` speaks of (decision 0087)."""
    table = case.loaded.config.axis[0]
    factor = ((1.0 if table.motion == "linear" else math.hypot(*table.lever_m)) / 0.1) ** 2
    most = {"spring": 600.0, "damper": 1.0, "mass": 0.02, "grip": 600.0}
    return all(float(a[name][0]) <= bound * factor for name, bound in most.items())


def hands_of(case, seed, count):
    """So many other hands of the box on the same rig, with their largest speeds."""
    numbers = {name: float(case.axis[name][0]) for name in AXIS.names}
    scale = case.length_m
    dry, peak = ((numbers[name] + numbers["link_dry"]) * scale for name in ("coulomb", "breakaway"))
    at, found = 0, []
    while len(found) < count and at < 8 * count:
        at += 1
        holder, kind, fastest = hand(
            Luck(31337, seed, at), dry, peak, (numbers["motor"] + numbers["link"]) * scale**2
        )
        a = case.axis.copy()
        for name in holder:
            a[name] = row(holder, scale)[name]
        if in_box(case, a):
            found.append(case._replace(axis=a, kind=kind, fastest=fastest))
    return found
