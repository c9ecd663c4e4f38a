"""A joint of a fifth make for what the law does outside of display: by it `tests/foreign_brakes.py` judges.

No line is shared with the mock or another judge: the linear part (one mass or two, the motor's lag, a hand
that is a spring, a damper and a mass on the joint) goes by its matrix exponential, in fortieths of a period
at most; dry friction is what stops the motor in a step, or as much as it can. Its level follows Stribeck, and
grows with what the gear bears, ripples with the gear without play, or bends bristles first. Units: rad, N m,
s at the joint; a torque is positive when it accelerates it.
"""

import copy
import math

import numpy as np
from foreign_armed import Armed, law_of
from scipy.linalg import expm

from hw.entry_points import call, entry_point
from rtctl.check.law_plan import build
from rtctl.control import law
from rtctl.control.jit import compiled, records

FIELDS = (
    "motor", "link", "gear", "gear_damping", "viscous", "link_viscous", "dry", "peak", "stribeck", "bristle",
    "bristle_damping", "by_load", "wave", "waves", "cogging", "late_ticks", "lag_s", "count", "lever",
    "felt_as", "per_ampere", "sample_ticks", "lost",
)  # fmt: skip
"""`bristle` 0: none bends; `by_load`: share of the gear's torque; `wave`: share of the level, `waves` a
radian, `cogging` a torque with them; `lost`: share of the samples that never come, two in a row at most."""

AXIS = np.dtype([(name, "<f8") for name in FIELDS])
X, V, OUT_X, OUT_V, MOTOR, SIZE = range(6)
BENT, HELD, REST, DEAD, WORK, GIVEN, MISSED, KEPT = range(8)
"""What is kept beside: bristles, the hand's torque, the torque of its spring at 0, whether the motor is dead,
J that the motor gave and that the hand was given, and samples lost in a row."""
SPEED, HAND_SPEED, PLACE, SENT, STATE, KIND, FLAGS, GAVE, TOOK, COLUMNS = range(10)
"""Columns of a run: the last two are J in that tick."""
LINE = 32


def steps_of(a, spring, damper, mass, dt_s):
    """Exact step of the linear part: of the state, and of command, friction and the torque of REST."""
    one = {name: float(a[name][0]) for name in FIELDS}
    whole = np.zeros((SIZE + 3, SIZE + 3))
    command, friction, rest = SIZE, SIZE + 1, SIZE + 2
    whole[X, V] = whole[OUT_X, OUT_V] = 1.0
    if one["link"] > 0:
        motor, link = one["motor"], one["link"] + mass
        for row, inertia, side in ((V, motor, -1.0), (OUT_V, link, 1.0)):
            whole[row, [X, OUT_X]] = side * one["gear"] / inertia * np.array([1.0, -1.0])
            whole[row, [V, OUT_V]] = side * one["gear_damping"] / inertia * np.array([1.0, -1.0])
        whole[V, V] -= one["viscous"] / motor
        whole[V, MOTOR] = whole[V, friction] = 1.0 / motor
        whole[OUT_V, OUT_V] -= (one["link_viscous"] + damper) / link
        whole[OUT_V, OUT_X] -= spring / link
        whole[OUT_V, rest] = 1.0 / link
    else:
        inertia = one["motor"] + mass
        for row in (V, OUT_V):
            whole[row, X], whole[row, V] = -spring / inertia, -(one["viscous"] + damper) / inertia
            whole[row, [MOTOR, friction, rest]] = 1.0 / inertia
    if one["lag_s"] > 0:
        whole[MOTOR, MOTOR], whole[MOTOR, command] = -1.0 / one["lag_s"], 1.0 / one["lag_s"]
    made = expm(whole * dt_s)
    return made[:SIZE, :SIZE].copy(), made[:SIZE, SIZE:].copy()


@compiled
def _friction(q, kept, a, free_v, per_torque, dt):
    """Torque of friction over a step that would end at free_v without it, which `per_torque` changes."""
    load = a.gear * (q[X] - q[OUT_X]) if a.link > 0 else kept[HELD]
    level = a.dry + (a.peak - a.dry) * math.exp(-abs(q[V]) / a.stribeck)
    level = level * (1 + a.wave * math.sin(a.waves * q[X])) + a.by_load * abs(load)
    if a.bristle > 0:
        kept[BENT] = min(max(kept[BENT] + q[V] * dt, -level / a.bristle), level / a.bristle)
        return -a.bristle * kept[BENT] - a.bristle_damping * q[V]
    return min(max(-free_v / per_torque, -level), level)


@compiled
def _sense(t, q, kept, a, luck):
    if t.tick % int(a.sample_ticks) != 0:
        return
    if luck < a.lost and kept[MISSED] < 2:
        kept[MISSED] += 1
        return
    kept[MISSED] = 0
    t.sample_count += 1
    t.position_rad[0] = math.floor(q[X] / a.count) * a.count
    t.current_a[0] = q[MOTOR] / a.per_ampere
    t.temperature_c[0] = 25.0
    t.force_n[int(a.felt_as)] = kept[HELD] / a.lever + 1e-3 * luck


@compiled
def _loop(law_at, of_law, a, hand, matrices, q, kept, line, luck, steps, out):
    t, s, p = of_law[0][0], of_law[1][0], of_law[2][0]
    whole, given = matrices
    spring, damper, mass = hand
    dt, after = p.period_s / steps, np.zeros(SIZE)
    for k in range(len(out)):
        t.time_ns, t.link_faults, t.estop = int(1e9 * t.tick * p.period_s), 0, 0
        _sense(t, q, kept, a, luck[k])
        call(law_at, of_law)
        for j in range(LINE - 1, 0, -1):
            line[j] = line[j - 1]
        line[0] = t.current_command_a[0] * a.per_ampere if t.enabled != 0 else 0.0
        work, took = kept[WORK], kept[GIVEN]
        for i in range(steps):
            since = (i + 0.5) / steps - a.late_ticks
            command = line[0 if since >= 0 else math.ceil(-since)] if kept[DEAD] == 0 else 0.0
            if a.lag_s == 0 or kept[DEAD] > 0:
                q[MOTOR] = command
            push = -a.cogging * math.sin(a.waves * q[X])
            for row in range(SIZE):
                after[row] = given[row, 0] * command + given[row, 1] * push + given[row, 2] * kept[REST]
                for column in range(SIZE):
                    after[row] += whole[row, column] * q[column]
            rub = _friction(q, kept, a, after[V], given[V, 1], dt)
            for row in range(SIZE):
                after[row] += given[row, 1] * rub
            kept[HELD] = kept[REST] - mass * (after[OUT_V] - q[OUT_V]) / dt
            kept[HELD] -= spring * 0.5 * (q[OUT_X] + after[OUT_X]) + damper * 0.5 * (q[OUT_V] + after[OUT_V])
            kept[WORK] += 0.5 * (q[MOTOR] + after[MOTOR]) * (after[X] - q[X])
            kept[GIVEN] -= kept[HELD] * (after[OUT_X] - q[OUT_X])
            q[:] = after
        out[k, SPEED], out[k, HAND_SPEED], out[k, PLACE] = q[V], q[OUT_V], q[X]
        out[k, SENT], out[k, STATE] = t.torque_applied_nm[0], s.state
        out[k, KIND], out[k, FLAGS] = t.program_kind[0], t.program_flags[0]
        out[k, GAVE], out[k, TOOK] = kept[WORK] - work, kept[GIVEN] - took
        t.tick += 1


class Rig(Armed):
    """A rig file's law on this joint, in no hand to begin with."""

    def __init__(self, loaded, a, seed):
        plan = build(loaded)
        self.period_s = plan.period_s
        self.law = law_of(plan)
        p, self.a = plan.params[0], a.copy()
        levers = np.abs(p["lever_m"][0])
        self.a["felt_as"], self.a["lever"], self.a["count"] = (
            np.argmax(levers),
            levers.max(),
            p["count_rad"][0],
        )
        self.a["per_ampere"] = p["gear_ratio"][0] * p["gear_efficiency"][0] * p["torque_constant_nm_a"][0]
        self.q, self.kept, self.line = np.zeros(SIZE), np.zeros(KEPT), np.zeros(LINE)
        self.draw, self._at = np.random.default_rng(seed), entry_point(law.step, *self.law)
        self.steps = max(40, math.ceil(self.period_s / 2.5e-5))
        self.let_go()

    def let_go(self):
        """Nobody's hand."""
        self.grip(0.0, 0.0, 0.0)

    def grip(self, spring, damper, mass, off_rad=0.0):
        """A hand takes the joint where it is, and wishes it `off_rad` from there; its mass stood still."""
        outer = float(self.a["link"][0]) or float(self.a["motor"][0])
        self.q[OUT_V] *= outer / (outer + mass)
        if self.a["link"][0] == 0:
            self.q[V] = self.q[OUT_V]
        self.hand = (float(spring), float(damper), float(mass))
        self.kept[REST] = spring * (self.q[OUT_X] + off_rad)
        self.matrices = steps_of(self.a, spring, damper, mass, self.period_s / self.steps)

    def without_torque(self):
        """The same rig at this moment, its motor dead from here on."""
        other = copy.copy(self)
        other.law = tuple(part.copy() for part in self.law)
        other.q, other.kept, other.line = self.q.copy(), self.kept.copy(), self.line.copy()
        other.draw = copy.deepcopy(self.draw)
        other.kept[DEAD] = 1.0
        return other

    def run(self, seconds):
        """What happened, `COLUMNS` a tick."""
        out = np.zeros((max(round(seconds / self.period_s), 1), COLUMNS))
        _loop(
            self._at, self.law, records(self.a)[0], self.hand, self.matrices, self.q, self.kept, self.line,
            self.draw.random(len(out)), self.steps, out,
        )  # fmt: skip
        return out
