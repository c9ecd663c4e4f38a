"""An arm with nerves on a joint of a fourth make: `tests/foreign_rests.py` asks whether it rests,
`tests/foreign_moved.py` whether it is shaken while it moves.

The law is driven as in `foreign_swings`; no line of what moves is shared with it, the mock, `foreign_joint`
or `foreign_rig`: Runge and Kutta's steps,
between which friction is a function of the way since the last; Dahl's exponential, plasticity with a back
stress (Armstrong and Frederick), or a contact spring before Dieterich's rate and state, which ages at rest;
a gear with play; a handle on a wrist that gives, an arm whose muscle has a reflex some hundredths of a second
late, and a tremor. Units: rad, N m, s of a rotary axis, m, N, s of a linear one.
"""

import math

import foreign_swings
import numpy as np

from hw.entry_points import call
from rtctl.control.jit import compiled, records

FIELDS = (
    "motor", "link", "gear", "gear_damping", "play", "viscous", "link_viscous", "coulomb", "breakaway",
    "stribeck", "bristle", "bristle_damping", "kind", "memory_s", "handle", "wrist", "wrist_damping", "arm",
    "muscle", "muscle_damping", "reflex", "reflex_damping", "reflex_s", "twitch_s", "tremor", "tremor_omega",
    "amplitude", "omega", "manner", "tip", "pushes", "from_s", "to_s", "late_ticks", "lag_s", "sample_ticks",
    "count", "lever", "force_step", "force_noise", "current_noise", "per_ampere", "felt_as",
)  # fmt: skip
"""`kind` of friction: 0 Dahl, 1 back stress, 2 rate and state. `arm` 0: the wrist hangs on the wish.
`manner` of the wish: 0 sine, 1 even speed that turns at once, 2 steps of least jerk that stop. A wrist with a
`tip` stiffens as a fingertip does, by Hertz: it has its stiffness where it gives so much; one that `pushes`
never pulls."""

AXIS = np.dtype([(name, "<f8") for name in FIELDS])
X, V, LINK_X, LINK_V, ARM_X, ARM_V = range(6)
BENT, BACK, AGE, SLOW, PULL, MUSCLE = range(6)
"""Of what is remembered from step to step: friction's torque, back stress, age and low-passed speed; what
the reflex asks for, and what the muscle gives of it."""
NERVE = 512
"""Ticks that a nerve remembers."""
AGED_S = 0.01
"""Contacts are renewed on a way of the Stribeck speed times this."""


@compiled
def _curve(speed, a):
    return a.coulomb + (a.breakaway - a.coulomb) * math.exp(-speed / a.stribeck)


@compiled
def _slipped(bent, age, way, dt, a):
    """Torque of a contact spring before rate and state: its slip in `dt` is that of its own torque."""
    direct, aged = 0.02 * a.coulomb, (a.breakaway - a.coulomb) / 4.6
    level = a.coulomb + aged * math.log(1 + age)
    trial = bent + a.bristle * way
    e = 1.0 if trial >= 0 else -1.0
    torque = min(abs(trial), level + 12 * direct)
    for _ in range(30):
        slip = a.stribeck * math.exp((torque - level) / direct)
        beyond = torque + a.bristle * dt * slip - abs(trial)
        step = beyond / (1 + a.bristle * dt * slip / direct)
        torque = max(torque - step, 0.0)
        if abs(step) < 1e-7 * a.coulomb:
            break
    return e * torque


@compiled
def _yielded(bent, back, level, way, a):
    """(torque, back stress) of a spring that yields by .4 of the level about a back stress of .6."""
    trial, yields, most, hard = bent + a.bristle * way, 0.4 * level, 0.6 * level, 0.5 * a.bristle
    e = 1.0 if trial >= back else -1.0
    if abs(trial - back) <= yields:
        return trial, back
    f, b = e * trial - yields, e * back
    square, line = a.bristle * hard / most, a.bristle + hard - f * hard / most
    slip = (-line + math.sqrt(line * line + 4 * square * (f - b))) / (2 * square)
    return trial - e * a.bristle * slip, e * (b + hard * slip) / (1 + hard * slip / most)


@compiled
def _friction(kept, way, dt, a):
    """(torque, back stress) of the bristles after a way in `dt` since the last step."""
    if dt == 0.0:
        return kept[BENT], kept[BACK]
    level = _curve(kept[SLOW], a)
    if a.kind == 0:
        end, e = level, 1.0 if way >= 0 else -1.0
        return e * end + (kept[BENT] - e * end) * math.exp(-abs(way) * a.bristle / level), 0.0
    if a.kind == 1:
        return _yielded(kept[BENT], kept[BACK], level, way, a)
    return _slipped(kept[BENT], kept[AGE], way, dt, a), 0.0


@compiled
def bend(kept, way, dt, a):
    """Take a way in `dt` into the bristles."""
    bent, back = _friction(kept, way, dt, a)
    slid = abs(way) / dt
    if a.kind == 2:  # the age in units in which it is 1 at the Stribeck speed
        slid = abs(way - (bent - kept[BENT]) / a.bristle) / dt
        kept[AGE] = (kept[AGE] + dt / AGED_S) / (1 + dt * slid / (a.stribeck * AGED_S))
    kept[BENT], kept[BACK] = bent, back
    kept[SLOW] += (slid - kept[SLOW]) * (min(dt / a.memory_s, 1.0) if a.memory_s > 0 else 1.0)


@compiled
def wish(a, time_s):
    """What the arm wishes, and how fast."""
    at = a.omega * min(max(time_s - a.from_s, 0.0), a.to_s - a.from_s)
    if a.manner == 0:
        x, v = math.sin(at), math.cos(at)
    elif a.manner == 1:
        x, v = math.asin(math.sin(at)), 1.0 if math.cos(at) >= 0 else -1.0
    else:  # to 1, 2, 1, 0 and so on, in the first half of each half swing
        n = math.floor(at / math.pi)
        u = min(2 * (at / math.pi - n), 1.0)
        way = 1.0 if n % 4 < 2 else -1.0
        x = 2.0 - abs(n % 4 - 2.0) + way * u**3 * (10 - 15 * u + 6 * u * u)
        v = way * 60 / math.pi * (u * (1 - u)) ** 2
    return a.amplitude * x, a.amplitude * a.omega * v if a.from_s <= time_s < a.to_s else 0.0


@compiled
def tip(pressed, rate, a):
    """Torque of the wrist, or of the fingertip, on the handle."""
    held = a.wrist * pressed + a.wrist_damping * rate
    if a.tip > 0:
        held *= math.sqrt(abs(pressed) / a.tip)
    if a.pushes > 0:
        return max(held, 0.0) if pressed > 0 else 0.0
    return held


@compiled
def _rates(y, kept, x0, dt, motor, time_s, a, rate):
    """Write what each number of y changes by; return the torque that a sensor below the handle shows."""
    bent, _ = _friction(kept, y[X] - x0, dt, a)
    near = math.exp(-((y[V] / a.stribeck) ** 2))
    push = motor - bent - (a.viscous + a.bristle_damping * near) * y[V]
    outer, outer_v = (y[LINK_X], y[LINK_V]) if a.link > 0 else (y[X], y[V])
    place, wish_v = wish(a, time_s)
    shiver = a.tremor * math.sin(a.tremor_omega * time_s) + kept[MUSCLE]
    if a.arm > 0:
        held = tip(y[ARM_X] - outer, y[ARM_V] - outer_v, a)
        pull = a.muscle * (place - y[ARM_X]) + a.muscle_damping * (wish_v - y[ARM_V]) + shiver
        rate[ARM_X], rate[ARM_V] = y[ARM_V], (pull - held) / a.arm
    else:
        held = a.muscle * (place - outer) + a.muscle_damping * (wish_v - outer_v) + shiver
        rate[ARM_X], rate[ARM_V] = 0.0, 0.0
    rate[X] = y[V]
    if a.link > 0:
        twist = y[X] - y[LINK_X]
        beyond = twist - min(max(twist, -a.play), a.play)
        gear = a.gear * beyond + a.gear_damping * (y[V] - y[LINK_V])
        if a.play > 0 and gear * beyond <= 0:
            gear = 0.0
        rate[V] = (push - gear) / a.motor
        rate[LINK_X] = y[LINK_V]
        rate[LINK_V] = (gear + held - a.link_viscous * y[LINK_V]) / (a.link + a.handle)
        return held - a.handle * rate[LINK_V]
    rate[V] = (push + held) / (a.motor + a.handle)
    rate[LINK_X], rate[LINK_V] = 0.0, 0.0
    return held - a.handle * rate[V]


@compiled
def _step(y, kept, motor, time_s, dt, a, r, now):
    """Advance by `dt` (Runge and Kutta); returns the torque at the sensor."""
    x0 = y[X]
    felt = _rates(y, kept, x0, 0.0, motor, time_s, a, r[0])
    for stage in range(1, 4):
        part = dt if stage == 3 else 0.5 * dt
        for i in range(6):
            now[i] = y[i] + part * r[stage - 1, i]
        _rates(now, kept, x0, part, motor, time_s + part, a, r[stage])
    for i in range(6):
        y[i] += dt / 6 * (r[0, i] + 2 * r[1, i] + 2 * r[2, i] + r[3, i])
    bend(kept, y[X] - x0, dt, a)
    return felt


@compiled
def _nerve(y, kept, line, time_s, dt, a):
    """What the muscle gives of a reflex to the stretch that was `reflex_s` ago."""
    outer, outer_v = (y[ARM_X], y[ARM_V]) if a.arm > 0 else (y[X], y[V])
    place, wish_v = wish(a, time_s)
    for j in range(len(line) - 1, 0, -1):
        line[j, 0], line[j, 1] = line[j - 1, 0], line[j - 1, 1]
    line[0, 0], line[0, 1] = place - outer, wish_v - outer_v
    then = min(int(a.reflex_s / dt), len(line) - 1)
    wanted = a.reflex * line[then, 0] + a.reflex_damping * line[then, 1]
    keep = math.exp(-dt / a.twitch_s)
    kept[PULL] = wanted + keep * (kept[PULL] - wanted)
    kept[MUSCLE] = kept[PULL] + keep * (kept[MUSCLE] - kept[PULL])


@compiled
def _loop(law_at, of_law, a, y, kept, line, nerve, noise, steps, rates, now, out):
    t, p = of_law[0][0], of_law[2][0]
    dt = p.period_s / steps
    keep = math.exp(-dt / a.lag_s) if a.lag_s > 0 else 0.0
    current, felt = line[len(line) - 1], line[len(line) - 2]
    for k in range(len(out)):
        now_s = t.tick * p.period_s
        t.time_ns, t.link_faults, t.estop = int(1e9 * now_s), 0, 0
        if t.tick % int(a.sample_ticks) == 0:
            t.sample_count += 1
            t.position_rad[0] = math.floor(y[X] / a.count) * a.count
            t.current_a[0] = current / a.per_ampere + a.current_noise * noise[k, 0]
            for i in range(3):
                t.force_n[i] = a.force_noise * noise[k, 1 + i]
            force = felt / a.lever + a.force_noise * noise[k, 1]
            t.force_n[int(a.felt_as)] = math.floor(force / a.force_step + 0.5) * a.force_step
            t.temperature_c[0] = 25.0
        call(law_at, of_law)
        _nerve(y, kept, nerve, now_s, p.period_s, a)
        for j in range(len(line) - 3, 0, -1):
            line[j] = line[j - 1]
        line[0] = t.current_command_a[0] * a.per_ampere if t.enabled != 0 else 0.0
        before = y[LINK_X] if a.link > 0 else y[X]
        mean = 0.0
        for q in range(steps):
            since = (q + 0.5) / steps - a.late_ticks
            wanted = line[0 if since >= 0 else math.ceil(-since)]
            current = wanted + keep * (current - wanted)
            felt = _step(y, kept, current, now_s + q * dt, dt, a, rates, now)
            mean += felt / steps
        out[k, 0], out[k, 1], out[k, 2] = y[V], y[LINK_V] if a.link > 0 else y[V], mean
        out[k, 3] = -mean * ((y[LINK_X] if a.link > 0 else y[X]) - before)
        out[k, 4], out[k, 5] = t.feedforward_torque_nm[0], t.observer_torque_nm[0]
        t.tick += 1
    line[len(line) - 1], line[len(line) - 2] = current, felt


class Rig(foreign_swings.Rig):
    """A rig file's law on this joint in this arm; `policy`, if it is given, is not the file's."""

    def __init__(self, loaded, a, seed, policy=None, share=1.0):
        super().__init__(loaded, a, seed, policy, share)
        self.y, self.kept, self.line, self.nerve = (
            np.zeros(6), np.zeros(6), np.zeros(34), np.zeros((NERVE, 2)),
        )  # fmt: skip
        self.rates, self.now = np.zeros((4, 6)), np.zeros(6)
        self.steps = max(4, math.ceil(self.period_s / self._step_s()))

    def _step_s(self):
        """A fifth of the shortest swing's radian, 50 us at most."""
        a = self.a[0]
        outer = (a["link"] if a["link"] > 0 else a["motor"]) + a["handle"]
        swings = [
            (a["bristle"] + a["gear"]) / a["motor"],
            (a["wrist"] + a["muscle"] + a["gear"]) / outer,
            (a["wrist"] + a["muscle"]) / a["arm"] if a["arm"] > 0 else 0.0,
        ]
        fades = [
            (a["bristle_damping"] + a["viscous"] + a["gear_damping"]) / a["motor"],
            (a["wrist_damping"] + a["muscle_damping"] + a["gear_damping"]) / outer,
            (a["wrist_damping"] + a["muscle_damping"]) / a["arm"] if a["arm"] > 0 else 0.0,
        ]
        return min(5e-5, 0.2 / math.sqrt(max(swings)), 0.3 / max(*fades, 1e-9))

    def run(self, seconds):
        """Ticks of speeds of motor and link, torque at the sensor, energy given to the arm, and both parts
        of the help; shape (ticks, 6)."""
        out = np.zeros((round(seconds / self.period_s), 6))
        noise = self.draw.standard_normal((len(out), 4))
        _loop(
            self._at, self.law, records(self.a)[0], self.y, self.kept, self.line, self.nerve, noise,
            self.steps, self.rates, self.now, out,
        )  # fmt: skip
        return out
