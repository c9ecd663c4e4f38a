"""Rigs of other makes, independent of the mock, of `moved_joint` and of everything in `rtctl`: friction laws
that are not shipped, a motor with a current loop.

Two masses on a shaft (stiff, elastic or with play), friction by the generalised Maxwell-slip law of Leuven,
by Bliman and Sorine's, or by Dahl's with a Stribeck peak that lags, a motor with inductance under a sampled
current loop, moved by a test program or by a hand. What is recorded passes a drive's filters and words.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from hw.jit import compiled

STEP_S = 5e-5
GMS, BLIMAN_SORINE, DAHL = 0, 1, 2
SLIDES_RAD_S = 0.03


@dataclass(frozen=True)
class Rig:
    """A joint, its motor and who moves it: SI, at the joint."""

    law: int = GMS
    inertia: float = 0.012
    link: float = 0.0
    """Inertia behind the shaft; 0: one mass."""
    shaft: float = 400.0
    play: float = 0.0
    coulomb: float = 0.25
    breakaway: float = 0.3
    stribeck: float = 0.05
    viscous: float = 0.05
    power: float = 1.0
    """Viscous torque grows with speed to this power, relative to 1 rad/s."""
    asymmetry: float = 0.0
    bend: float = 1e-3
    """Length over which bristles bend, rad."""
    lag: float = 0.01
    ripple: float = 0.0
    """Torque of cogging, six waves a turn."""
    gravity: float = 0.0
    program: str = "multisine"
    travel: float = 0.5
    servo: tuple[float, float] = (60.0, 1.5)
    hand: tuple[float, float] = (0.0, 0.0)
    """Stiffness and damping of a hand that follows the program too."""
    hand_shift: float = 0.0
    """By how many seconds the hand is ahead of the servo."""
    kt: float = 0.5
    seconds: float = 30.0


@dataclass(frozen=True)
class Recorded:
    """What a perfect observer would have written at `rate_hz`: time, position, velocity, current, hand's
    torque, true friction.
    """

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    current: np.ndarray
    hand: np.ndarray
    friction: np.ndarray
    link: np.ndarray
    truth: dict[str, float]


def wanted(program: str, travel: float, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity of the test program."""
    grow = np.minimum(1.0, t)
    if program == "multisine":
        waves = ((0.62, 0.31, 0.0), (0.25, 0.83, 1.0), (0.09, 1.9, 2.0), (0.04, 3.7, 0.5))
        x = sum(a * np.sin(2 * np.pi * f * t + p) - a * np.sin(p) for a, f, p in waves) * grow * travel
    elif program == "moves":
        x = _moves(t, travel)
    elif program == "steps":
        places = np.random.default_rng(3).uniform(-travel, travel, 4000)
        x = _low_passed(places[(t / 1.2).astype(int)], 3.0)
    elif program == "chirp":
        swept = 0.2 * t + 0.5 * (3.0 - 0.2) / t[-1] * t**2
        x = travel * grow * np.sin(2 * np.pi * swept) / (1 + 2 * t / t[-1])
    elif program == "ramps":
        x = _ramps(t, travel)
    else:
        raise ValueError(program)
    return x, np.gradient(x, t)


def _low_passed(x: np.ndarray, hertz: float) -> np.ndarray:
    for _ in range(2):
        x = first_order(x, 1 - math.exp(-2 * math.pi * hertz * STEP_S))
    return x


def _moves(t: np.ndarray, travel: float) -> np.ndarray:
    """There and back with trapezoidal speed, from slow to quick, with a pause after each, again and again."""
    x, at, start, side, k = np.empty_like(t), -travel, 0.0, 1.0, 0
    speeds = (0.15, 0.15, 0.4, 0.4, 0.9, 0.9, 2.0, 2.0, 4.0, 4.0)
    first = 0
    while first < len(t):
        speed, run = speeds[k % len(speeds)], 0.0
        blend = min(0.12, travel / speed)
        whole = 2 * travel / speed + blend
        last = np.searchsorted(t, start + whole + 0.25)
        s = np.clip(t[first:last] - start, 0, whole)
        up = np.minimum(s, blend)
        down = np.clip(s - (whole - blend), 0, blend)
        run = speed * (
            up**2 / (2 * blend) + np.clip(s - blend, 0, whole - 2 * blend) + down - down**2 / (2 * blend)
        )
        x[first:last] = at + side * run
        at, side, start, first, k = at + side * 2 * travel, -side, start + whole + 0.25, last, k + 1
    return x


def _ramps(t: np.ndarray, travel: float) -> np.ndarray:
    """To and fro at even speeds, each pair of strokes quicker."""
    speeds = np.repeat(np.geomspace(0.2, 3.0, 12), 2)
    ends = np.concatenate([[0.0], np.cumsum(2 * travel / speeds)])
    s = t % ends[-1]
    k = np.clip(np.searchsorted(ends, s, side="right") - 1, 0, len(speeds) - 1)
    into = (s - ends[k]) * speeds[k]
    return np.where(k % 2 == 0, into, 2 * travel - into) - travel


@compiled
def _level(v, coulomb, breakaway, stribeck):
    return coulomb + (breakaway - coulomb) * math.exp(-((v / stribeck) ** 2))


@compiled
def _run(  # longer than 50 lines: one loop over time, which keeps everything in registers
    goal, goal_v, ahead, ahead_v, p, out
):
    law, jm, jl, shaft, play, fc, fs, vs, b, power, asym, bend, lag, ripple, gravity, kp, kd, hk, hd, kt = p
    elements = np.array([0.4, 0.3, 0.2, 0.1])
    stiff = np.array([0.55, 0.25, 0.14, 0.06]) * fs / bend
    bent = np.zeros(4)
    stuck = np.ones(4)
    x, v, xl, vl, z, z2, slow, i, integral, demand, motor_v = (
        goal[0],
        0.0,
        goal[0],
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
    )
    resistance, inductance = 0.8, 1.2e-3
    before = 0.0
    dt = STEP_S
    for k in range(len(goal)):
        if k % 10 == 0:  # a servo of 2 kHz on the motor's encoder
            demand = (kp * (goal[k] - x) + kd * (goal_v[k] - v)) / kt
        if k % 2 == 0:  # a current loop of 10 kHz
            integral += 250.0 * (demand - i) * 2 * dt
            motor_v = min(48.0, max(-48.0, 2.0 * (demand - i) + integral))
        i += dt * (motor_v - resistance * i - kt * v) / inductance if kp > 0 else 0.0
        hand = hk * (ahead[k] - (xl if jl > 0 else x)) + hd * (ahead_v[k] - (vl if jl > 0 else v))
        if law == 0:
            friction, level, turned = 0.0, _level(v, fc, fs, vs), v * before < 0
            for e in range(4):
                if turned:
                    stuck[e] = 1.0
                if stuck[e] > 0:
                    bent[e] += dt * stiff[e] * v
                    if abs(bent[e]) > elements[e] * level:
                        stuck[e] = 0.0
                else:
                    bent[e] += dt * (fc / lag) * (math.copysign(elements[e], v) - bent[e] / level) * 1.0
                friction += bent[e]
            before = v
        elif law == 1:
            step = abs(v) * dt
            sign = math.copysign(1.0, v)
            z += (1 - math.exp(-3 * step / (0.4 * bend))) * (sign * (fs + 0.8 * (fs - fc)) - z)
            z2 += (1 - math.exp(-3 * step / bend)) * (sign * (fs - fc) * 1.8 - z2)
            friction = z - z2
        else:
            slow += dt * (abs(v) - slow) / lag
            z += dt * v * (fs / bend) * (1 - z * math.copysign(1.0, v) / _level(slow, fc, fs, vs))
            friction = z
        friction *= 1 + asym * (1.0 if v > 0 else -1.0)
        friction += math.copysign(b * abs(v) ** power, v)
        pull = ripple * math.sin(6 * x + 0.3)
        if jl > 0:
            twist = x - xl
            gap = math.copysign(max(abs(twist) - play, 0.0), twist)
            through = shaft * gap + (0.02 * math.sqrt(shaft * jl) * (v - vl) if gap != 0 else 0.0)
            vl += dt * (through + hand - gravity * math.sin(xl)) / jl
            xl += dt * vl
            v += dt * (kt * i - friction - through - pull) / jm
        else:
            v += dt * (kt * i + hand - friction - pull - gravity * math.sin(x)) / jm
        x += dt * v
        out[k, 0], out[k, 1], out[k, 2], out[k, 3], out[k, 4], out[k, 5] = x, v, i, hand, friction, xl


@cache
def run(rig: Rig) -> Recorded:
    """The rig in motion, at every step of the simulation."""
    t = np.arange(round(rig.seconds / STEP_S)) * STEP_S
    goal, goal_v = wanted(rig.program, rig.travel, t)
    ahead = round(rig.hand_shift / STEP_S)
    out = np.empty((len(t), 6))
    numbers = (
        rig.law, rig.inertia, rig.link, rig.shaft, rig.play, rig.coulomb, rig.breakaway, rig.stribeck,
        rig.viscous, rig.power, rig.asymmetry,
        rig.bend, rig.lag, rig.ripple, rig.gravity, *rig.servo, *rig.hand, rig.kt,
    )  # fmt: skip
    _run(goal, goal_v, np.roll(goal, -ahead), np.roll(goal_v, -ahead), tuple(float(n) for n in numbers), out)
    x, v, i, hand, friction, xl = out.T
    return Recorded(t, x, v, i, hand, friction, xl, _truth(rig, x, v, friction))


def _truth(rig: Rig, x: np.ndarray, v: np.ndarray, friction: np.ndarray) -> dict[str, float]:
    """Inertia, and the viscous and Coulomb friction nearest to the true friction where the joint slid and
    bristles were bent.
    """
    turns = np.flatnonzero(np.diff(np.sign(v), prepend=np.sign(v[0]) + 1))
    since = np.abs(x - x[turns[np.searchsorted(turns, np.arange(len(v)), side="right") - 1]])
    rows = np.flatnonzero((np.abs(v) > SLIDES_RAD_S) & (since > max(10 * rig.bend, 0.01)))[::50]
    fit = np.linalg.lstsq(np.column_stack([v[rows], np.sign(v[rows])]), friction[rows], rcond=None)[0]
    return {
        "inertia_kgm2": rig.inertia + rig.link,
        "viscous_nms_rad": float(fit[0]),
        "coulomb_nm": float(fit[1]),
    }


def first_order(signal: np.ndarray, share: float) -> np.ndarray:
    from scipy.signal import lfilter

    return np.asarray(lfilter([share], [1, share - 1], signal, zi=[(1 - share) * signal[0]])[0])
