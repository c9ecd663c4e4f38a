"""A joint of another make than the mock whose friction, loads and sensors change by a script: what the watch
over the friction is judged by.

By first principles, no line shared with the mock: Dahl's bristles of any exponent under a Stribeck curve with
a power of its own, an elastic gear with play, a hand on a spring, what hangs on its handle, what pulls at the
joint past the force sensor. Angles and torques as everywhere; the same numbers serve a carriage (m, N).
"""

import math
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
from foreign_armed import law_of

from hw.entry_points import call, entry_point
from rtctl.check.law_plan import build
from rtctl.control import law
from rtctl.control.jit import compiled, records
from rtctl.control.vocabulary import State
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.learn.point_evidence import with_evidence
from rtctl.friction.points import FrictionPoints
from rtctl.tick import new_ticks


class Joint(NamedTuple):
    """What turns, and who moves it. One mass where `link` is 0; friction, bristles and encoder are the
    motor's.
    """

    motor: float = 0.009
    link: float = 0.0
    gear: float = 0.0
    gear_damping: float = 0.0
    play: float = 0.0
    viscous: float = 0.06
    coulomb: float = 0.28
    breakaway: float = 0.37
    stribeck: float = 0.12
    power: float = 0.7
    bristle: float = 350.0
    exponent: float = 1.3
    backward: float = 1.04
    hand: float = 20.0
    hand_damping: float = 0.4
    worn_at: float = 0.0
    worn_width: float = 0.3
    size: float = 1.0
    """Of its motion: a carriage's handle lies so far, m, from the joint it would be."""


SIZES = {
    "motor": -2, "link": -2, "gear": -2, "gear_damping": -2, "viscous": -2, "bristle": -2, "hand": -2,
    "hand_damping": -2, "coulomb": -1, "breakaway": -1,
    "play": 1, "stribeck": 1, "worn_at": 1, "worn_width": 1, "size": 1,
}  # fmt: skip
"""Powers of a handle's distance by which a joint's numbers become those of a carriage."""


def on_rail(joint, metres):
    """The same at a handle so far from the joint."""
    return joint._replace(**{name: getattr(joint, name) * metres**power for name, power in SIZES.items()})


QUIET = {
    "forward": 1.0, "backward": 1.0, "viscous": 1.0, "torque": 0.0, "spring": 0.0, "weight": 0.0, "felt": 0.0,
    "current": 0.0, "payload": 0.0, "seen": 1.0,
    "past": 0.0, "worn": 1.0, "cable": 0.0, "most": 1e9, "wish": 0.0, "wish_v": 0.0,
}  # fmt: skip
"""Factors of the dry friction by direction and of the viscous one; torque, spring and weight (by the sine of
the place) on the joint past the sensor; biases of force sensor and motor torque; inertia on the handle, and
whether the sensor sees it; share of the hand that pulls past the sensor; factor at the worn place; torque of
a cable that is bent and creeps; torque near which the motor's iron saturates, which its current does not say;
what the hand wishes."""

(
    FORWARD, BACKWARD, VISCOUS, TORQUE, SPRING, WEIGHT, FELT, CURRENT, PAYLOAD, SEEN, PAST, WORN, CABLE, MOST,
    WISH, WISH_V,
) = range(len(QUIET))  # fmt: skip
X, V, LINK_X, LINK_V, BENT, HELD, MOTOR, ASKED, COIL, SIZE = range(10)

CABLE_RAD, CABLE_S = 0.15, 15.0
"""A cable has given way after such a bend, and creeps back within so long."""


@compiled
def _level(v, x, joint, now):
    """Dry friction, N m, at this speed, place and time."""
    speed = abs(v)
    level = joint.coulomb + (joint.breakaway - joint.coulomb) * math.exp(
        -((speed / joint.stribeck) ** joint.power)
    )
    level *= now[FORWARD] if v >= 0.0 else joint.backward * now[BACKWARD]
    if now[WORN] == 1.0:
        return level
    return level * (1.0 + (now[WORN] - 1.0) * math.exp(-0.5 * ((x - joint.worn_at) / joint.worn_width) ** 2))


@compiled
def _friction(y, joint, now, dt):
    v = y[V]
    end = _level(v, y[X], joint, now) / joint.bristle
    left = 1.0 - (y[BENT] / end if v > 0.0 else -y[BENT] / end)
    y[BENT] = min(max(y[BENT] + dt * v * max(left, 0.0) ** joint.exponent, -end), end)
    return joint.bristle * y[BENT] + joint.viscous * now[VISCOUS] * v


@compiled
def _gear(y, joint):
    twist, rate = y[X] - y[LINK_X], y[V] - y[LINK_V]
    beyond = twist - min(max(twist, -joint.play), joint.play)
    if joint.play > 0.0 and beyond == 0.0:
        return 0.0
    torque = joint.gear * beyond + joint.gear_damping * rate
    return torque if joint.play == 0.0 or torque * beyond > 0.0 else 0.0


@compiled
def _step(y, joint, now, since, dt):
    elastic = joint.link > 0.0
    x, v = (y[LINK_X], y[LINK_V]) if elastic else (y[X], y[V])
    pull = joint.hand * (now[WISH] + since * now[WISH_V] - x) + joint.hand_damping * (now[WISH_V] - v)
    past = now[TORQUE] - now[SPRING] * x + now[WEIGHT] * math.sin(x / joint.size + 0.6) + now[PAST] * pull
    pull *= 1.0 - now[PAST]
    y[COIL] += dt * ((v - abs(v) * y[COIL]) / (CABLE_RAD * joint.size) - y[COIL] / CABLE_S)
    past -= now[CABLE] * y[COIL]
    friction = _friction(y, joint, now, dt)
    if elastic:
        gear = _gear(y, joint)
        y[V] += dt * (y[MOTOR] - friction - gear) / joint.motor
        rate = (pull + past + gear) / (joint.link + now[PAYLOAD])
        y[LINK_V] += dt * rate
        y[LINK_X] += dt * y[LINK_V]
    else:
        rate = (y[MOTOR] + pull + past - friction) / (joint.motor + now[PAYLOAD])
        y[V] += dt * rate
    y[X] += dt * y[V]
    y[HELD] = pull - (now[PAYLOAD] * rate if now[SEEN] > 0.0 else 0.0)


@compiled
def _loop(law_at, of_law, joint, script, noise, y, per_ampere, lever, felt_as, count, out):
    t, p = of_law[0][0], of_law[2][0]
    steps = max(10, round(p.period_s / 4e-5))
    dt = p.period_s / steps
    for k in range(len(out)):
        now = script[k]
        t.time_ns, t.link_faults, t.estop = int(1e9 * t.tick * p.period_s), 0, 0
        t.sample_count += 1
        t.position_rad[0] = math.floor(y[X] / count) * count
        t.current_a[0] = (y[ASKED] + now[CURRENT]) / per_ampere + 0.004 * noise[k, 0]
        for i in range(3):
            t.force_n[i] = 0.006 * noise[k, 1 + i]
        t.force_n[felt_as] += (y[HELD] + now[FELT]) / lever
        t.temperature_c[0] = 25.0
        call(law_at, of_law)
        out[k] = t
        y[ASKED] = t.current_command_a[0] * per_ampere if t.enabled != 0 else 0.0
        y[MOTOR] = y[ASKED] / math.sqrt(1.0 + (y[ASKED] / now[MOST]) ** 2)
        for i in range(steps):
            _step(y, joint, now, (i + 1) * dt, dt)
        t.tick += 1


class Rig:
    """The law of a rig file on a joint; `script(t)` gives the channels of `QUIET` that are not quiet, over
    times (s).
    """

    def __init__(self, loaded, joint, seed=1):
        self.plan = build(loaded)
        self.law = law_of(self.plan)
        p = self.plan.params[0]
        self.per_ampere = float(p["gear_ratio"][0] * p["gear_efficiency"][0] * p["torque_constant_nm_a"][0])
        self.felt_as = int(np.argmax(np.abs(p["lever_m"][0])))
        self.lever, self.count = float(p["lever_m"][0][self.felt_as]), float(p["count_rad"][0])
        self.joint, self.y, self.draw = joint, np.zeros(SIZE), np.random.default_rng(seed)
        self._at = entry_point(law.step, *self.law)

    @property
    def time_s(self):
        return int(self.law[0]["tick"][0]) * self.plan.period_s

    def run(self, seconds, script):
        """Ticks of so long."""
        n = round(seconds / self.plan.period_s)
        t = self.time_s + np.arange(n) * self.plan.period_s
        now = {**QUIET, **script(t)}
        table = np.column_stack([np.broadcast_to(now[name], n) for name in QUIET]).astype(float)
        out = records(new_ticks(n, 1))
        noise = self.draw.standard_normal((n, 4))
        _loop(
            self._at,
            self.law,
            self.joint,
            table,
            noise,
            self.y,
            self.per_ampere,
            self.lever,
            self.felt_as,
            self.count,
            out,
        )
        return np.asarray(out)

    def arm(self, script):
        """Ticks until it is ACTIVE, asked as an operator would."""
        _, state, _, command, _ = self.law
        parts = []
        for _ in range(400):
            command["arm_count"] += 1
            command["epoch"], command["seq"], command["compensation"] = (
                state["epoch"],
                command["seq"] + 1,
                1.0,
            )
            parts.append(self.run(0.05, script))
            if parts[-1]["state"][-1] == State.ACTIVE:
                return np.concatenate(parts)
        msg = f"not armed: state {parts[-1]['state'][-1]}"
        raise AssertionError(msg)


@cache
def learned(joint, rig, motion="rotary", error=0.005, seed=1):
    """What `rtctl fit` makes of the joint's curve at 24 speeds, each measured to a share `error`."""
    draw = np.random.default_rng(seed)
    top, rows = 20.0 * joint.stribeck, []
    for way, scale in ((1, 1.0), (-1, joint.backward)):
        for v in np.geomspace(top / 300, top, 24):
            dry = joint.coulomb + (joint.breakaway - joint.coulomb) * math.exp(
                -((v / joint.stribeck) ** joint.power)
            )
            f = scale * dry * (1 + error * draw.standard_normal()) + joint.viscous * v
            rows.append((way * v, f, way, np.nan, np.nan))
    points = replace(FrictionPoints.from_rows(rows, "made", "0" * 64), motion=motion)
    made = with_evidence(fit_points(points, rig=rig, epsilon_nm=0.005 * joint.coulomb), points)
    length = joint.breakaway / joint.bristle
    return replace(made, presliding_rad=length, presliding_spread_rad=0.05 * length, presliding_ramps=10)
