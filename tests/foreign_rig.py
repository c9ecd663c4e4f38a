"""Whole rigs of another make than the mock: several axes, rotary or linear, their sensors, hands and
renderers, by first principles.

Complements `tests/foreign_joint.py`, which has one rotary axis. Nothing here is shared with the mock: joints
with Dahl's friction under a Stribeck curve that may grow with load, differ from place to place or warm up;
elastic gears; devices that sample seldom and act late; force sensors with a low-pass, a delay, noise and
drift of their own; hands that stiffen, grip, tap or hardly damp; renderers that want the hand's energy
(`tests/foreign_foes.py`). Units: rad, N m, kg m^2 of a rotary axis, m, N, kg of a linear one. A torque is
positive when it accelerates the joint.
"""

import math

import numpy as np
from foreign_armed import law_of
from foreign_foes import FOE, scheme

from hw.entry_points import call, entry_point
from rtctl.check.law_plan import build
from rtctl.control import law
from rtctl.control.jit import compiled, records
from rtctl.control.vocabulary import State

JOINT = {
    "motor": 0.012, "viscous": 0.05, "coulomb": 0.25, "breakaway": 0.35, "stribeck": 0.1, "bristle": 300.0,
    "exponent": 1.0, "backward": 1.0,
    "wave_share": 0.0, "waves": 1.0, "wave_at": 0.0, "cogging": 0.0, "cogs": 20.0, "load_motor": 0.0,
    "load_hand": 0.0, "warming_per_s": 0.0,
    "link": 0.0, "gear": 0.0, "gear_damping": 0.0, "play": 0.0,
}  # fmt: skip
"""Mass at the motor, viscous and dry friction, bristles, friction over place, cogging, friction by load, and
what an elastic gear has behind it."""

DEVICE = {
    "per_ampere": 1.0, "count": 1e-5, "delay_ticks": 0.0, "lag_s": 0.0, "current_noise": 0.0,
    "felt_as": 1.0, "lever": 0.1, "force_lag_s": 0.0, "force_delay_s": 0.0, "force_noise": 0.0,
    "force_step": 0.0, "force_bias": 0.0, "force_drift_per_s": 0.0,
}  # fmt: skip
"""Motor, encoder and force sensor: forces in N at the lever."""

HAND = {
    "spring": 5.0, "damper": 0.1, "mass": 0.0, "grip": 0.0, "grip_damping": 0.0, "stiffening": 0.0,
    "amplitude": 0.3, "hz": 0.5,
    "from_s": 1.5, "to_s": 5.5, "relaxed": 1.0, "grips_s": 0.0, "taps": 0.0,
}  # fmt: skip
"""Spring and damper to what it wishes (a sine from `from_s` to `to_s`, then held), to a mass on a grip, to
one that is one with the joint (no grip), or straight to it; `relaxed` is the share of the spring until
`grips_s`, .1 s later it is all there; a hand that taps pushes one way only."""

AXIS = np.dtype(
    [(name, "<f8") for name in (*JOINT, *DEVICE, *HAND)] + [(name, kind) for name, kind, _ in FOE]
)
LINE = 64
"""Commands, and samples of force, that are remembered."""

X, V, LINK_X, LINK_V, BRISTLE, HAND_X, HAND_V, HELD, CURRENT, FELT, GIVEN, MOTOR, SIZE = range(13)


def axis(**changed):
    """One axis of the rig; what is not told is that of `JOINT`, `DEVICE` and `HAND`, and no foe."""
    row = np.zeros(1, AXIS)
    for name, value in {
        **JOINT,
        **DEVICE,
        **HAND,
        **{name: value for name, _, value in FOE},
        **changed,
    }.items():
        row[name] = value
    return row


@compiled
def _friction(y, a, through, time_s, dt):
    """Dry and viscous friction of the motor's side; `through` is what the link or the hand pushes it with."""
    v = y[V]
    level = a.coulomb + (a.breakaway - a.coulomb) * math.exp(-abs(v) / a.stribeck)
    level *= (1.0 + a.wave_share * math.sin(a.waves * (y[X] - a.wave_at))) * (1.0 + a.warming_per_s * time_s)
    level = level * (a.backward if v < 0.0 else 1.0) + abs(a.load_hand * through - a.load_motor * y[MOTOR])
    end, z = level / a.bristle, y[BRISTLE]
    left = 1.0 - (z / end if v > 0.0 else -z / end)
    y[BRISTLE] = min(max(z + dt * v * max(left, 0.0) ** a.exponent, -end), end)
    return a.bristle * y[BRISTLE] + a.viscous * v - a.cogging * math.sin(a.cogs * y[X])


@compiled
def _gear(y, a):
    twist, rate = y[X] - y[LINK_X], y[V] - y[LINK_V]
    beyond = twist - min(max(twist, -a.play), a.play)
    if a.play > 0.0 and beyond == 0.0:
        return 0.0
    torque = a.gear * beyond + a.gear_damping * rate
    return torque if a.play == 0.0 or torque * beyond > 0.0 else 0.0


@compiled
def _pull(y, a, x, v, time_s, dt):
    """Torque of the hand on what it holds at x, v."""
    moved_s = min(max(time_s - a.from_s, 0.0), a.to_s - a.from_s)
    wish = a.amplitude * math.sin(2.0 * math.pi * a.hz * moved_s)
    spring = a.spring * (a.relaxed + (1.0 - a.relaxed) * min(max((time_s - a.grips_s) / 0.1, 0.0), 1.0))
    on_grip = a.mass > 0.0 and a.grip > 0.0
    own, own_v = (y[HAND_X], y[HAND_V]) if on_grip else (x, v)
    stretch = wish - own
    pull = spring * stretch * (1.0 + a.stiffening * stretch * stretch) - a.damper * own_v
    if not on_grip:
        return pull
    held = a.grip * (y[HAND_X] - x) + a.grip_damping * (y[HAND_V] - v)
    if a.taps > 0.0:
        held = max(held, 0.0) if y[HAND_X] > x else 0.0
    y[HAND_V] += dt * (pull - held) / a.mass
    y[HAND_X] += dt * y[HAND_V]
    return held


@compiled
def _step(y, a, time_s, dt):
    """Advance one axis by dt, and the energy that its hand was given."""
    elastic = a.link > 0.0
    gear = _gear(y, a) if elastic else 0.0
    friction = _friction(y, a, -gear if elastic else y[HELD], time_s, dt)
    outer_x, outer_v = (y[LINK_X], y[LINK_V]) if elastic else (y[X], y[V])
    held = _pull(y, a, outer_x, outer_v, time_s, dt)
    borne = a.mass if a.grip == 0.0 else 0.0
    if elastic:
        y[V] += dt * (y[MOTOR] - friction - gear) / a.motor
        rate = (held + gear) / (a.link + borne)
        y[LINK_V] += dt * rate
        y[LINK_X] += dt * y[LINK_V]
    else:
        rate = (y[MOTOR] + held - friction) / (a.motor + borne)
        y[V] += dt * rate
    held -= borne * rate
    y[X] += dt * y[V]
    y[GIVEN] -= held * ((y[LINK_X] if elastic else y[X]) - outer_x)
    y[HELD] = held


@compiled
def _sense(t, axes, ys, felt, noise, time_s):
    """A fresh sample of everything: the force as its sensor shows it, late, low-passed, noisy, and
    drifting.
    """
    for k in range(3):
        t.force_n[k] = axes[0].force_noise * noise[0, 2 + k]
    for i in range(len(axes)):
        a, y = axes[i], ys[i]
        t.position_rad[i] = math.floor(y[X] / a.count) * a.count
        t.current_a[i] = y[CURRENT] + a.current_noise * noise[i, 0]
        force = (
            felt[i, 0] / a.lever + a.force_bias + a.force_drift_per_s * time_s + a.force_noise * noise[i, 1]
        )
        t.force_n[int(a.felt_as)] = (
            round(force / a.force_step) * a.force_step if a.force_step > 0.0 else force
        )
        t.temperature_c[i] = 25.0


@compiled
def loop(law_at, law_arguments, axes, ys, lines, felt, noise, luck, sample_ticks, steps, out):
    """Run len(out) ticks in place. `out`: for each axis speed and energy given, then the state."""
    t, s, p, c = law_arguments[0][0], law_arguments[1][0], law_arguments[2][0], law_arguments[3][0]
    dt, n = p.period_s / steps, len(axes)
    for k in range(len(out)):
        now_s = t.tick * p.period_s
        t.time_ns, t.link_faults, t.estop = int(1e9 * now_s), 0, 0
        if t.tick % sample_ticks == 0:
            t.sample_count += 1
            _sense(t, axes, ys, felt, noise[k], now_s)
        scheme(t, s, p, c, axes, ys, luck[k])
        call(law_at, law_arguments)
        for i in range(n):
            a, y = axes[i], ys[i]
            for j in range(LINE - 1, 0, -1):
                lines[i, j] = lines[i, j - 1]
            lines[i, 0] = t.current_command_a[i] if t.enabled != 0 else 0.0
            keep = math.exp(-dt / a.lag_s) if a.lag_s > 0.0 else 0.0
            take = 1.0 - math.exp(-dt / a.force_lag_s) if a.force_lag_s > 0.0 else 1.0
            late = min(int(a.force_delay_s / p.period_s + 0.5), LINE - 1)
            for q in range(steps):
                since = (q + 0.5) / steps - a.delay_ticks
                wanted = lines[i, 0 if since >= 0.0 else math.ceil(-since)]
                y[CURRENT] = wanted + keep * (y[CURRENT] - wanted)
                y[MOTOR] = y[CURRENT] * a.per_ampere
                _step(y, a, now_s + q * dt, dt)
                y[FELT] += take * (y[HELD] - y[FELT])
            for j in range(late):
                felt[i, j] = felt[i, j + 1]
            felt[i, late] = y[FELT]
            out[k, 2 * i], out[k, 2 * i + 1] = y[V], y[GIVEN]
        out[k, 2 * n] = t.state
        t.tick += 1


class Rig:
    """A rig file's law on these axes; armed as an operator would, whenever it may be."""

    def __init__(self, loaded, axes, sample_ticks=1, seed=1, step_s=2e-5):
        self.plan = build(loaded)
        n = self.plan.n_axes
        self.law = law_of(self.plan)
        self.axes = np.concatenate(axes)
        self.axes["count"] = self.plan.params["count_rad"][0]
        per_ampere = [
            self.plan.params[name][0] for name in ("gear_ratio", "gear_efficiency", "torque_constant_nm_a")
        ]
        self.axes["per_ampere"] = np.prod(per_ampere, axis=0)
        levers = self.plan.params["lever_m"][0]
        self.axes["felt_as"], self.axes["lever"] = (
            np.argmax(np.abs(levers), axis=1),
            np.max(np.abs(levers), axis=1),
        )
        self.ys, self.lines, self.felt = np.zeros((n, SIZE)), np.zeros((n, LINE)), np.zeros((n, LINE))
        self.draw = np.random.default_rng(seed)
        self.sample_ticks, self.steps = sample_ticks, max(10, round(self.plan.period_s / step_s))
        self.rearms, self.armed = False, 0
        self._at = entry_point(law.step, *self.law)

    @property
    def period_s(self):
        return self.plan.period_s

    def run(self, seconds):
        """Ticks of so long: speeds and energies given, shape (ticks, axes), and states."""
        tick, state, _, command, _ = self.law
        parts, piece, n = [], round(0.05 / self.period_s), len(self.axes)
        while sum(map(len, parts)) < seconds / self.period_s:
            resting = state["state"][0] in (State.INIT, State.IDLE)
            if resting and (self.rearms or tick["tick"][0] * self.period_s < self.axes["from_s"].min() - 0.1):
                command["arm_count"] += 1
                command["epoch"], command["seq"] = state["epoch"], command["seq"] + 1
            parts.append(np.zeros((piece, 2 * n + 1)))
            noise, luck = self.draw.standard_normal((piece, n, 5)), self.draw.random((piece, n, 6))
            loop(
                self._at, self.law, records(self.axes), self.ys, self.lines, self.felt, noise, luck,
                self.sample_ticks, self.steps, parts[-1],
            )  # fmt: skip
        out = np.concatenate(parts)
        return out[:, 0:-1:2], out[:, 1:-1:2], out[:, -1].astype(int)
