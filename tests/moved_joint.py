"""A joint with friction, moved by a hand, a motor or both, and what a lab would record of it: clean logs with
a known truth.

Independent of the mock and of everything in `rtctl` but its compiler: a mass on elasto-plastic bristles,
integrated every quarter of a millisecond. Signs: a torque is positive when it accelerates the joint towards
positive position.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from rtctl.control.jit import compiled

STEP_S = 0.25e-3
SINES = ((0.4, 0.4), (0.15, 1.1), (0.06, 2.3))
"""Amplitude (rad) and frequency (Hz) of the motion that the hand or the motor wants."""


@dataclass
class Joint:
    inertia: float = 0.012
    viscous: float = 0.05
    coulomb: float = 0.25
    breakaway: float = 0.27
    stribeck: float = 0.02
    sigma0: float = 2000.0
    sines: tuple = SINES
    kind: str = "sines"
    hand: tuple = (20.0, 0.5)
    """Stiffness (N m/rad) and damping (N m s/rad) of who moves it; None: nobody."""
    motor: tuple | None = None
    """The same of a motor servo to the wanted motion."""
    share: float = 0.0
    """Share of the motor's torque by which friction is larger: a gear."""
    spring: float = 0.0
    """Stiffness that the motor renders, N m/rad."""
    rate_hz: float = 500.0
    seconds: float = 25.0
    counts: float = 40_000.0
    hand_noise: float = 0.01
    motor_noise: float = 0.003
    hand_quantum: float = 0.0
    motor_quantum: float = 0.0
    bias: float = 0.02
    drift: float = 0.0
    """Of the hand's sensor: random walk, N m after one second."""
    friction_over_time: float = 0.0
    """Share by which Coulomb friction grows from the first row to the last."""
    seed: int = 1


@dataclass
class Log:
    """Columns as recorded: s, rad, N m; `truth` is what identification should find."""

    time: np.ndarray
    position: np.ndarray
    motor: np.ndarray | None
    hand: np.ndarray | None
    truth: dict
    velocity: np.ndarray
    extra: dict = field(default_factory=dict)

    @property
    def step(self):
        return float(np.median(np.diff(self.time)))


def wanted(joint, t):
    """Position and velocity that hand or motor want at the times t."""
    if joint.kind == "strokes":  # to and fro at even speeds, quicker with every stroke
        speeds = np.geomspace(0.15, 3.0, 24)
        bounds = np.concatenate([[0.0], np.cumsum(0.6 / speeds)])
        k = np.clip(np.searchsorted(bounds, t % bounds[-1], side="right") - 1, 0, len(speeds) - 1)
        into = (t % bounds[-1] - bounds[k]) * speeds[k]
        sign = np.where(k % 2 == 0, 1.0, -1.0)
        return np.where(k % 2 == 0, into, 0.6 - into) - 0.3, sign * speeds[k]
    if joint.kind == "moves":  # there and back, each at one acceleration, one speed and one deceleration
        return _moves(t)
    grow = np.minimum(1.0, t)
    x = sum(a * np.sin(2 * np.pi * f * t) for a, f in joint.sines) * grow
    v = sum(a * 2 * np.pi * f * np.cos(2 * np.pi * f * t) for a, f in joint.sines) * grow
    return x, v


def _moves(t):
    """Moves of .9 rad with 20 rad/s^2, at 1, 2 and 3 rad/s in turn, .2 s of rest behind each."""
    x, v, at, begin = np.zeros(len(t)), np.zeros(len(t)), 0.0, 0.0
    for k in range(1000):
        speed, way = (1.0, 2.0, 3.0)[k // 2 % 3], (0.9, -0.9)[k % 2]
        ramp = speed / 20.0
        even = 0.9 / speed - ramp
        s = t - begin
        mine = s >= 0
        up, mid, down = np.clip(s, 0, ramp), np.clip(s - ramp, 0, even), np.clip(s - ramp - even, 0, ramp)
        far = 10.0 * up**2 + speed * mid + speed * down - 10.0 * down**2
        x[mine] = at + np.sign(way) * far[mine]
        v[mine] = np.sign(way) * 20.0 * (up - down)[mine]
        at, begin = at + way, begin + 2 * ramp + even + 0.2
        if begin > t[-1]:
            break
    return x, v


def simulate(joint):
    """Log of the joint."""
    n_row = round(1 / joint.rate_hz / STEP_S)
    rows = round(joint.seconds * joint.rate_hz)
    goal, goal_v = wanted(joint, np.arange(rows * n_row) * STEP_S)
    friction = (joint.coulomb, joint.breakaway, joint.stribeck, joint.share, joint.friction_over_time)
    mass = (joint.inertia, joint.viscous, joint.sigma0, joint.spring)
    hand, motor = joint.hand or (0.0, 0.0), joint.motor or (0.0, 0.0)
    return _recorded(joint, *_moved(n_row, goal, goal_v, hand, motor, bool(joint.motor), friction, mass))


@compiled
def _moved(n_row, goal, goal_v, hand, servo, served, friction, mass):
    """Position, velocity, torques of motor and hand, one row every `n_row` steps."""
    coulomb, breakaway, stribeck, share, over_time = friction
    inertia, viscous, sigma0, spring = mass
    xs, vs, motors, hands = np.zeros((4, len(goal) // n_row))
    x, v, z, motor, integral = float(goal[0]), 0.0, 0.0, 0.0, 0.0
    for k in range(len(goal)):
        to, to_v = float(goal[k]), float(goal_v[k])
        pull = hand[0] * (to - x) + hand[1] * (to_v - v)
        if k % n_row == 0:
            row = k // n_row
            xs[row], vs[row], hands[row] = x, v, pull
            motors[row] = motor  # what was held until now
            integral += (to - x) * n_row * STEP_S
            motor = -spring * x
            if served:
                motor += servo[0] * (to - x + 4 * integral) + servo[1] * (to_v - v)
        level = coulomb * (1 + over_time * (k / len(goal) - 0.5))
        level += (breakaway - coulomb) * math.exp(-((v / stribeck) ** 2))
        level += share * abs(motor)
        z = max(-level, min(level, z + sigma0 * v * STEP_S))
        rubs = z + viscous * v + (0.5 * v if abs(z) < level else 0.0 * v)
        v += STEP_S * (motor + pull - rubs) / inertia
        x += STEP_S * v
    return xs, vs, motors, hands


def _recorded(joint, x, v, motor, hand):
    rng = np.random.default_rng(joint.seed)
    n = len(x)
    quantum = 2 * np.pi / joint.counts
    hand = hand + joint.bias + rng.normal(0, joint.hand_noise, n)
    hand += np.cumsum(rng.normal(0, joint.drift / math.sqrt(joint.rate_hz), n))
    motor = motor + rng.normal(0, joint.motor_noise, n)
    hand, motor = (
        np.round(signal / q) * q if q else signal
        for signal, q in ((hand, joint.hand_quantum), (motor, joint.motor_quantum))
    )
    return Log(
        time=np.arange(n) / joint.rate_hz,
        position=np.round(x / quantum) * quantum,
        motor=motor if joint.motor or joint.spring else None,
        hand=hand if joint.hand else None,
        truth={
            "inertia_kgm2": joint.inertia,
            "viscous_nms_rad": joint.viscous,
            "coulomb_nm": joint.coulomb,
        },
        velocity=v,
    )


SMALL = {"inertia": 1.6e-3, "viscous": 6e-3, "coulomb": 0.03, "breakaway": 0.034, "sigma0": 300.0}
"""A lever of the size of a small haptic device."""

CLEAN = {
    "hand": Joint(),
    "hand, noisy": Joint(hand_noise=0.04, seed=2),
    "hand, coarse encoder": Joint(counts=8192, seed=3),
    "hand, 100 Hz": Joint(rate_hz=100.0, seed=4),
    "hand, drifting": Joint(drift=0.01, seconds=40.0, seed=5),
    "hand on a small lever": Joint(
        **SMALL,
        hand=(2.0, 0.05),
        hand_noise=1e-3,
        motor_noise=1e-3,
        bias=-0.03,
        counts=300_000,
        rate_hz=1000.0,
    ),
    "motor": Joint(hand=None, motor=(60.0, 1.5)),
    "motor, coarse current": Joint(
        hand=None, motor=(60.0, 1.5), motor_quantum=0.01, motor_noise=0.02, seed=6
    ),
    "motor, 1 kHz": Joint(hand=None, motor=(60.0, 1.5), rate_hz=1000.0, motor_noise=0.02, seed=7),
    "motor, even strokes": Joint(hand=None, motor=(60.0, 1.5), kind="strokes", seconds=40.0, seed=8),
    "hand against a spring of the motor": Joint(spring=1.0, seed=9),
    "hand against a spring, coarse": Joint(
        spring=1.0, counts=8192, hand_quantum=0.01, rate_hz=250.0, seed=10
    ),
}
