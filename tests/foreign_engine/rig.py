"""The compiled law of a rig file on an engine's joint: the engine's step is called by its address."""

import math

import numpy as np
from foreign_armed import Armed, law_of

from foreign_engine.engines import made
from foreign_engine.plants import LEVER_M, _arm_angles
from hw.entry_points import call, entry_point
from rtctl.check.law_plan import build
from rtctl.control import law
from rtctl.control.jit import compiled
from rtctl.control.vocabulary import Environment, Policy

NERVE = 256
"""Ticks that a nerve remembers."""


@compiled
def _loop(
    law_at,
    of_law,
    step,
    pointers,
    at,
    ctrl,
    qpos,
    qvel,
    sensed,
    given,
    device,
    line,
    nerve,
    base,
    gains,
    noise,
    out,
    trace,
):
    """`at`: indices of link and arm, the hand's joints, reflex in ticks; `device`: counts and so on;
    `base`: ctrl of the hand and where its joints are wished, a row a tick."""
    t, p = of_law[0][0], of_law[2][0]
    link, arm, joints, late = at[0], at[1], at[2], at[3]
    count, per_ampere, late_ticks, sample_ticks, force_noise, current_noise, dt, lever = device
    steps = int(p.period_s / dt + 0.5)
    hands = gains.shape[1]
    for k in range(len(out)):
        t.time_ns, t.link_faults, t.estop = int(1e9 * t.tick * p.period_s), 0, 0
        if t.tick % int(sample_ticks) == 0:
            t.sample_count += 1
            t.position_rad[0] = math.floor(qpos[0] / count) * count
            t.current_a[0] = given[0] / per_ampere + current_noise * noise[k, 0]
            for i in range(3):
                t.force_n[i] = force_noise * noise[k, 1 + i]
            t.force_n[1] += sensed[1] * lever
            t.temperature_c[0] = 25.0
        call(law_at, of_law)
        for j in range(len(line) - 1, 0, -1):
            line[j] = line[j - 1]
        line[0] = t.current_command_a[0] * per_ampere if t.enabled != 0 else 0.0
        for j in range(len(nerve) - 1, 0, -1):
            nerve[j] = nerve[j - 1]
        for i in range(joints):
            nerve[0, i] = base[k, hands + i] - qpos[arm + i]
            nerve[0, 2 + i] = base[k, hands + joints + i] - qvel[arm + i]
        for a in range(hands):
            ctrl[1 + a] = base[k, a]
            for i in range(joints):
                ctrl[1 + a] += gains[0, a, i] * (nerve[0, i] + 0.05 * nerve[0, 2 + i])
                ctrl[1 + a] += gains[1, a, i] * (nerve[late, i] + 0.02 * nerve[late, 2 + i])
        work, mean, fed = 0.0, 0.0, 0.0
        for q in range(steps):
            since = (q + 0.5) / steps - late_ticks
            ctrl[0] = line[0 if since >= 0 else math.ceil(-since)]
            before, turned = qpos[link], qpos[0]
            step(pointers[0], pointers[1])
            felt = sensed[1] * lever * LEVER_M
            mean += felt / steps
            work -= felt * (qpos[link] - before)
            fed += given[0] * (qpos[0] - turned)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = qvel[0], qvel[link], mean, work
        out[k, 4], out[k, 5], out[k, 6], out[k, 7] = (
            fed,
            qpos[link],
            t.feedforward_torque_nm[0],
            t.observer_torque_nm[0],
        )
        if k < len(trace):
            trace[k] = t
        t.tick += 1


class Rig(Armed):
    """A rig file's law (`policy`, if it is given, is not the file's) on this engine's joint in this hand."""

    SEEN = ("motor", "link", "torque", "given", "fed", "at", "feedforward", "observer")
    """Columns of `run`: rad/s of both masses, the handle's torque, J to hand and world, J of the motor."""

    def __init__(self, loaded, j, h, w, device, seed=1, policy=None):
        self.plan, self.device, self.hand, self.joint = build(loaded), device, h, j
        steps = self.plan.period_s / device.step_s
        if abs(steps - round(steps)) > 1e-6:
            raise ValueError(f"{steps:g} steps of the engine in a period")
        self.moved = made(j, h, w, device)
        self.law = law_of(self.plan)
        p = self.law[2]
        if policy is not None:
            self.follow(policy)
        self.period_s = self.plan.period_s
        per_ampere = p["gear_ratio"][0, 0] * p["gear_efficiency"][0, 0] * p["torque_constant_nm_a"][0, 0]
        self.told = (
            p["count_rad"][0, 0], per_ampere, device.late_ticks, device.sample_ticks, device.force_noise,
            device.current_noise, device.step_s, self.moved.lever,
        )  # fmt: skip
        late = round(h.reflex_s / self.period_s) if h.reflex > 0 else 0
        self.at = np.array([*self.moved.at, late])
        self.line, self.nerve = np.zeros(34), np.zeros((NERVE, 4))
        self.draw = np.random.default_rng(seed)
        self._at = entry_point(law.step, *self.law)
        self.wish = np.zeros_like
        self.leans = 0.0

    def _base(self, n):
        """(ctrl of the hand and its wishes a tick, gains at once and of its reflex)."""
        time_s, h = self.time_s + self.period_s * np.arange(n), self.hand
        place = self.wish(time_s)
        rate = (self.wish(time_s + 1e-4) - self.wish(time_s - 1e-4)) / 2e-4
        if h.kind == "nobody":
            return np.zeros((n, 1)), np.zeros((2, 0, 1))
        if h.kind == "muscles":
            zero = _arm_angles(np.zeros(1))
            at = _arm_angles(place) - zero
            then = (_arm_angles(place + 1e-4 * rate) - zero - at) / 1e-4
            pull, gains = np.full((n, 4), 0.15), np.zeros((2, 4, 2))
            for a in range(4):
                gains[:, a, a // 2] = (2.0 if a < 2 else 3.0) * (1, -1)[a % 2], (1, -1)[a % 2] * h.reflex
            return np.concatenate([pull, at, then], 1), gains
        push = h.spring * place + h.damper * rate + self.leans
        grips = [np.full(n, 4.0 + self.moved.squeeze)] * 2 if h.kind == "fingers" else []
        gains = np.zeros((2, 1 + len(grips), 1))
        gains[1, 0, 0] = h.reflex * h.spring
        return np.stack([push, *grips, place, rate], 1), gains

    def run(self, seconds, trace=None):
        """Ticks of what `SEEN` names, shape (ticks, 8); `trace`: ticks of the law, written in place. Raises
        `sound.DivergedError`."""
        n = round(seconds / self.period_s)
        out, noise = np.zeros((n, 8)), self.draw.standard_normal((n, 4))
        base, gains = self._base(n)
        m = self.moved
        _loop(
            self._at, self.law, m.step, m.pointers, self.at, m.ctrl, m.qpos, m.qvel, m.sensed, m.given,
            self.told, self.line, self.nerve, base, gains, noise, out,
            self.law[0][:0] if trace is None else trace,
        )  # fmt: skip
        m.sound()
        return out

    def follow(self, policy):
        """Help by this policy from now on."""
        p = self.law[2]
        p["friction_policy"][0, 0] = int(policy)
        if policy == Policy.OFF:
            p["friction_gain"][0, 0] = p["observer_gain"][0, 0] = 0.0

    def hold(self, share):
        """How firmly the handle is held, 0 (let go) to 1."""
        self.moved.hold(share)

    def arm(self, most_s=3.0):
        """True once it is ACTIVE."""
        return self.arm_until(most_s)

    def world(self, kind, stiffness, place, damping=0.0):
        """A world that the law renders itself."""
        c = self.law[3]
        c["environment_kind"], c["environment_side"] = int(Environment[kind.upper()]), 1
        c["environment_stiffness_nm_rad"], c["environment_center_rad"] = stiffness, place
        c["environment_damping_nms_rad"], c["environment_pitch_rad"] = damping, max(0.3 * place, 2e-3)
