"""A joint of a third make in a hand that moves it: by it `tests/foreign_shaken.py` judges the help.

No line is shared with the mock, `foreign_joint` or `foreign_rig`: steps of Verlet, dry friction by Moreau's
impulse, by Bouc and Wen or by stops in parallel, under a Lorentzian Stribeck curve; a link with dry friction
of its own; a hand that strokes to and fro by a sine or a triangle, then holds. Units: rad, N m, s of a rotary
axis, m, N, s of a linear one.
"""

import math

import numpy as np
from foreign_armed import Armed, law_of

from hw.entry_points import call, entry_point
from rtctl.check.law_plan import build
from rtctl.control import law
from rtctl.control.jit import compiled, records

FIELDS = (
    "motor", "link", "gear", "gear_damping", "viscous", "link_viscous", "coulomb", "breakaway", "stribeck",
    "bristle", "kind", "elements", "exponent", "bristle_damping", "link_dry", "late_ticks", "lag_s", "spring",
    "damper", "mass", "grip", "amplitude", "omega", "triangle", "from_s", "to_s", "count", "lever",
    "force_step", "force_noise", "current_noise", "per_ampere", "felt_as", "sample_ticks",
)  # fmt: skip
"""`kind` of friction: 0 Bouc and Wen, 1 stops, 2 dry; a hand's `mass` hangs on its `grip`, or is one with
the link."""

AXIS = np.dtype([(name, "<f8") for name in FIELDS])
ELEMENTS_MOST = 16
X, V, LINK_X, LINK_V, HAND_X, HAND_V, HELD, MOTOR = range(8)


@compiled
def _level(v, a):
    return a.coulomb + (a.breakaway - a.coulomb) / (1 + (v / a.stribeck) ** 2)


@compiled
def _bent(v, z, a, dt):
    """Friction of bristles, N m, after a way v dt."""
    level = _level(v, a)
    damped = a.bristle_damping * v / (1 + (v / a.stribeck) ** 2)
    if a.kind == 0:
        way, held = v * dt, min(abs(z[0]) / level, 1.5) ** a.exponent
        z[0] += a.bristle * way * (1 - (held if z[0] * way > 0 else 0.0))
        return z[0] + damped
    n, torque = int(a.elements), 0.0
    for i in range(n):
        most = level * 2 * (i + 1) / (n * (n + 1))
        z[i] = min(max(z[i] + a.bristle * 2 * (n - i) / (n * (n + 1)) * v * dt, -most), most)
        torque += z[i]
    return torque + damped


@compiled
def _slowed(v, impulse):
    """A speed that dry friction takes at most so much of."""
    return v - impulse if v > impulse else v + impulse if v < -impulse else 0.0


@compiled
def _wish(a, time_s):
    """What the hand wishes, and how fast."""
    at = a.omega * min(max(time_s - a.from_s, 0.0), a.to_s - a.from_s)
    if a.triangle > 0:
        s = 0.995 * math.sin(at)
        x = a.amplitude * 2 / math.pi * math.asin(s)
        v = a.amplitude * 2 / math.pi * 0.995 * math.cos(at) * a.omega / math.sqrt(1 - s * s)
    else:
        x, v = a.amplitude * math.sin(at), a.amplitude * a.omega * math.cos(at)
    return x, v if a.from_s <= time_s < a.to_s else 0.0


@compiled
def _drift(y, dt):
    for x in (X, LINK_X, HAND_X):
        y[x] += dt * y[x + 1]


@compiled
def _step(y, z, a, time_s, dt):
    """Advance by dt; returns what a sensor between hand and joint shows."""
    elastic, on_grip = a.link > 0, a.grip > 0 and a.mass > 0
    wish, wish_v = _wish(a, time_s)
    _drift(y, 0.5 * dt)
    outer, outer_v = (y[LINK_X], y[LINK_V]) if elastic else (y[X], y[V])
    borne = 0.0 if on_grip else a.mass
    if on_grip:
        held = a.grip * (y[HAND_X] - outer)
        pull = a.spring * (wish - y[HAND_X]) + a.damper * (wish_v - y[HAND_V])
        y[HAND_V] += dt * (pull - held) / a.mass
    else:
        held = a.spring * (wish - outer) + a.damper * (wish_v - outer_v)
    inertia, push, v0 = a.motor, y[MOTOR] - a.viscous * y[V], outer_v
    if elastic:
        gear = a.gear * (y[X] - y[LINK_X]) + a.gear_damping * (y[V] - y[LINK_V])
        loaded = a.link + borne
        v = y[LINK_V] + dt * (held + gear - a.link_viscous * y[LINK_V]) / loaded
        y[LINK_V] = _slowed(v, a.link_dry * dt / loaded)
        push -= gear
    else:
        inertia, push = a.motor + borne, push + held
    if a.kind == 2:
        y[V] = _slowed(y[V] + dt * push / inertia, _level(y[V], a) * dt / inertia)
    else:
        y[V] += dt * (push - _bent(y[V], z, a, dt)) / inertia
    rate = ((y[LINK_V] if elastic else y[V]) - v0) / dt
    _drift(y, 0.5 * dt)
    return held - borne * rate


@compiled
def _loop(law_at, of_law, a, y, z, line, noise, steps, out):
    t, p = of_law[0][0], of_law[2][0]
    dt = p.period_s / steps
    keep = math.exp(-dt / a.lag_s) if a.lag_s > 0 else 0.0
    for k in range(len(out)):
        now_s = t.tick * p.period_s
        t.time_ns, t.link_faults, t.estop = int(1e9 * now_s), 0, 0
        if t.tick % int(a.sample_ticks) == 0:
            t.sample_count += 1
            t.position_rad[0] = math.floor(y[X] / a.count) * a.count
            t.current_a[0] = y[MOTOR] / a.per_ampere + a.current_noise * noise[k, 0]
            for i in range(3):
                t.force_n[i] = a.force_noise * noise[k, 1 + i]
            force = y[HELD] / a.lever + a.force_noise * noise[k, 1]
            t.force_n[int(a.felt_as)] = math.floor(force / a.force_step + 0.5) * a.force_step
            t.temperature_c[0] = 25.0
        call(law_at, of_law)
        for j in range(len(line) - 1, 0, -1):
            line[j] = line[j - 1]
        line[0] = t.current_command_a[0] * a.per_ampere if t.enabled != 0 else 0.0
        for q in range(steps):
            since = (q + 0.5) / steps - a.late_ticks
            wanted = line[0 if since >= 0 else math.ceil(-since)]
            y[MOTOR] = wanted + keep * (y[MOTOR] - wanted)
            y[HELD] = _step(y, z, a, now_s + q * dt, dt)
        out[k, 0], out[k, 1], out[k, 2] = y[V], y[LINK_V] if a.link > 0 else y[V], y[HELD]
        out[k, 3], out[k, 4] = t.feedforward_torque_nm[0], t.observer_torque_nm[0]
        t.tick += 1


class Rig(Armed):
    """A rig file's law on this joint; `share` of its help is left, and `policy`, if it is given, is not the
    file's.
    """

    def __init__(self, loaded, a, seed, policy=None, share=1.0):
        plan = build(loaded)
        self.period_s = plan.period_s
        self.law = law_of(plan)
        p = plan.params[0]
        if policy is not None:
            p["friction_policy"][0] = int(policy)
        p["friction_gain"][0] *= share
        p["observer_gain"][0] *= share
        self.a, levers = a.copy(), np.abs(p["lever_m"][0])
        self.a["per_ampere"] = p["gear_ratio"][0] * p["gear_efficiency"][0] * p["torque_constant_nm_a"][0]
        self.a["felt_as"], self.a["lever"], self.a["count"] = (
            np.argmax(levers),
            levers.max(),
            p["count_rad"][0],
        )
        self.y, self.z, self.line = np.zeros(8), np.zeros(ELEMENTS_MOST), np.zeros(32)
        self.draw = np.random.default_rng(seed)
        self._at, self.steps = (
            entry_point(law.step, *self.law),
            max(8, math.ceil(self.period_s / self._step_s())),
        )

    def _step_s(self):
        """A tenth of the shortest swing's radian, a fifth of the shortest time constant, 25 us at most."""
        a = self.a[0]
        outer = a["link"] if a["link"] > 0 else a["motor"]
        on_grip = a["grip"] > 0 and a["mass"] > 0
        swings = [
            (4 * a["bristle"] + a["gear"]) / a["motor"],
            (a["spring"] + a["grip"] + a["gear"]) / outer,
            (a["spring"] + a["grip"]) / a["mass"] if on_grip else 0.0,
        ]
        fades = [
            (a["bristle_damping"] + a["viscous"] + a["gear_damping"]) / a["motor"],
            (a["damper"] + a["gear_damping"]) / outer,
        ]
        return min(2.5e-5, 0.1 / math.sqrt(max(swings)), 0.2 / max(*fades, 1e-9))

    def run(self, seconds):
        """Speeds of motor and link, the hand's torque, and both parts of the help; shape (ticks, 5)."""
        out = np.zeros((round(seconds / self.period_s), 5))
        noise = self.draw.standard_normal((len(out), 4))
        _loop(self._at, self.law, records(self.a)[0], self.y, self.z, self.line, noise, self.steps, out)
        return out

    def arm(self):
        """True once it is ACTIVE, before the hand moves."""
        return self.arm_until(self.a["from_s"][0] - 0.2)
