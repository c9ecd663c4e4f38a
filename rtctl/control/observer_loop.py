"""The loop that the disturbance observer closes, as matrices over a box of hands and joints.

Pure functions of numbers. One loop is

- the joint, rigid or of two masses, its damping, and a hand (stiffness k_h to ground, damping b_h, mass m_h) behind the
  force sensor: tau_h = -(m_h dv/dt + b_h v + k_h x);
- its dry friction, absent (the joint slides) or a spring of break-away over presliding length (it sticks);
- the motor: torques held over a period, any delay, whole or not, a first-order current loop;
- the law: the observer of `disturbance_observer` with its two low-passes, plain difference velocity and the torque it
  believes to act, the force sensor's low-pass, and the coupling to a proxy at rest, or none (free motion).

The plant between two samples is exact (matrix exponential). Fresh samples every n-th tick: the law's output is held
over n ticks, so the frame is n periods long and the delay 1/n of its ticks; the coupling's damping, which then acts in
one tick of n, is taken as spread over the frame. Feed-forward and energy account are left out: the one only takes part of the
observer's work, the other only scales both down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from rtctl.control.disturbance_observer import SMOOTHING, TARGET_SHARE
from rtctl.control.velocity import lowpass_alpha

HAND_STIFFNESS_NM_RAD = (0.0, *np.geomspace(3.0, 600.0, 9).tolist())
HAND_DAMPING_NMS_RAD = (0.0, 0.03, 0.2, 1.0)
HAND_INERTIA_KGM2 = (0.0, 0.0005, 0.002, 0.006, 0.02)
"""The box of hands, at the link."""

RESONANCES_HZ = (20.0, 30.0, 50.0, 70.0, 100.0)
"""Resonances tried for an elastic joint whose own is not declared: two equal masses that swing freely."""

JOINT_DAMPING_RATIO = 0.01
"""Damping ratio of the spring of such a joint: little."""

BRISTLE_DAMPING_SHARE = 0.02
"""Damping of the spring of a joint that sticks, as a share of the critical one of joint and bristles: little."""

_HALVINGS = 12
_TERMS = 8
_UNUSED_1_S = -1e3
"""States that a joint does not have die out."""


@dataclass(frozen=True)
class ElasticJoint:
    """Two masses: share of the inertia on the link's side, stiffness N m/rad, damping N m s/rad; 0 stiffness: rigid."""

    link_share: float = 0.5
    stiffness_nm_rad: float = 0.0
    damping_nms_rad: float = 0.0


RIGID = ElasticJoint()


def resonance(inertia_kgm2: float, hz: float) -> ElasticJoint:
    """Two equal masses that swing freely at `hz`."""
    omega, reduced = 2 * math.pi * hz, inertia_kgm2 / 4
    return ElasticJoint(0.5, reduced * omega**2, 2 * JOINT_DAMPING_RATIO * reduced * omega)


def frequency_hz(inertia_kgm2: float, joint: ElasticJoint) -> float:
    """At which the two masses swing freely, Hz; 0 for a rigid joint."""
    reduced = joint.link_share * (1 - joint.link_share) * inertia_kgm2
    return math.sqrt(joint.stiffness_nm_rad / reduced) / (2 * math.pi)


@dataclass(frozen=True)
class Loop:
    """What is fixed about one axis. Symbols as in the module's text; joints and bristles are what the grid goes over."""

    inertia_kgm2: float
    viscous_nms_rad: float
    period_s: float
    gain: float
    bandwidth_hz: float
    delay: float = 0.0
    """Ticks from a fresh sample to its torque."""
    lag_hz: float = 0.0
    sample_ticks: int = 1
    acting_ticks: int = 0
    """Delay by which the law goes when it asks which torque acted, ticks."""
    force_lowpass_hz: float = 0.0
    stiffness_nm_rad: float = 0.0
    """Stiffness of the coupling; the next field is its damping."""
    damping_nms_rad: float = 0.0
    bristle_nm_rad: float = 0.0
    """Break-away torque over presliding length."""
    motor_share: float = 1.0
    """Share of the viscous damping on the motor's side of an elastic joint."""
    encoder: str = "motor"
    joints: tuple[ElasticJoint, ...] = (RIGID,)


@dataclass(frozen=True)
class Points:
    """Points of the grid, as columns: hand, bristle stiffness, joint, coupling (0 or 1)."""

    k_h: np.ndarray
    b_h: np.ndarray
    m_h: np.ndarray
    bristle: np.ndarray
    joint: np.ndarray
    coupled: np.ndarray

    def __getitem__(self, index: np.ndarray | int) -> Points:
        return Points(*(np.atleast_1d(column[index]) for column in self.columns()))

    def columns(self) -> tuple[np.ndarray, ...]:
        """All columns, in order."""
        return self.k_h, self.b_h, self.m_h, self.bristle, self.joint, self.coupled

    @property
    def size(self) -> int:
        """Number of points."""
        return self.k_h.size


def grid(loop: Loop) -> Points:
    """Every hand of the box, on every joint, sliding and stuck, coupled and free."""
    bristles = (0.0, loop.bristle_nm_rad) if loop.bristle_nm_rad > 0 else (0.0,)
    coupled = (0, 1) if loop.stiffness_nm_rad > 0 else (0,)
    hands = (HAND_STIFFNESS_NM_RAD, HAND_DAMPING_NMS_RAD, HAND_INERTIA_KGM2)
    rows = np.array(list(product(*hands, bristles, range(len(loop.joints)), coupled)), dtype=float)
    return Points(*rows.T)


def _exponential(A: np.ndarray) -> np.ndarray:
    """Matrix exponential of a stack of small matrices: Taylor's series of a 4096th part, squared twelve times."""
    part = A / 2.0**_HALVINGS
    eye = np.broadcast_to(np.eye(A.shape[-1]), A.shape)
    out = eye.copy()
    for n in range(_TERMS, 0, -1):
        out = eye + part @ out / n
    for _ in range(_HALVINGS):
        out = out @ out
    return out


def _plant(loop: Loop, points: Points) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """dp/dt = A p + B u and tau_h = c p + d u of every point, u and p = (x_m, v_m, x_l, v_l, i) in one: (p, u)."""
    shares = np.array([(one.link_share, one.stiffness_nm_rad, one.damping_nms_rad) for one in loop.joints])
    share, k_j, b_j = shares[points.joint.astype(int)].T
    rigid = k_j == 0.0
    J, b, n = loop.inertia_kgm2, loop.viscous_nms_rad, points.size
    b_m = np.where(rigid, b, loop.motor_share * b)
    critical = 2 * np.sqrt(points.bristle * J)
    b_m = b_m + BRISTLE_DAMPING_SHARE * critical
    b_l = np.where(rigid, 0.0, (1 - loop.motor_share) * b) + points.b_h
    J_m, J_l = np.where(rigid, J, (1 - share) * J), np.where(rigid, 0.0, share * J) + points.m_h
    A = np.zeros((n, 6, 6))
    A[:, 0, 1], A[:, 2, 3] = 1.0, 1.0
    motor, link = np.zeros((n, 6)), np.zeros((n, 6))
    motor[:, 0], motor[:, 1], motor[:, 4] = -(points.bristle + k_j), -(b_m + b_j), 1.0
    motor[:, 2], motor[:, 3] = k_j, b_j
    link[:, 2], link[:, 3], link[:, 0], link[:, 1] = -(k_j + points.k_h), -(b_j + b_l), k_j, b_j
    whole = motor.copy()
    whole[:, 0] -= points.k_h
    whole[:, 1] -= b_l
    A[:, 1] = np.where(rigid[:, None], whole / (J_m + J_l)[:, None], motor / J_m[:, None])
    A[:, 3] = np.where(rigid[:, None], A[:, 1], link / np.where(rigid, 1.0, J_l)[:, None])
    tau = 2 * math.pi * loop.lag_hz
    A[:, 4, 4], A[:, 4, 5] = -tau, tau
    if tau == 0:  # the torque is the command itself
        A[:, :, 5] += A[:, :, 4]
        A[:, :, 4] = 0.0
        A[:, 4, 4] = _UNUSED_1_S
    at, moving = np.where(rigid, 0, 2), np.where(rigid, 1, 3)
    hand = -points.m_h[:, None] * A[np.arange(n), moving]
    hand[np.arange(n), at] -= points.k_h
    hand[np.arange(n), moving] -= points.b_h
    # in a rigid joint the link's states are the motor's: they are left out
    A[rigid, 2:4] = 0.0
    A[rigid, 2, 2] = A[rigid, 3, 3] = _UNUSED_1_S
    hand[rigid, 2:4] = 0.0
    return A, hand, rigid


def matrices(loop: Loop, points: Points) -> np.ndarray:
    """The closed loop from one fresh sample to the next, a matrix for every point of the grid.

    Notes
    -----
    States: p of `_plant` (5), the commands of the last frames (D), the last position, the force sensor's low-pass, and the
    observer's q1, w1 (fast) and q2, w2 (slow) of torque and velocity.  Columns are built by running one frame from every
    unit state, all points at once.
    """
    n, frame = loop.sample_ticks, loop.sample_ticks * loop.period_s
    A, hand, _ = _plant(loop, points)
    whole = math.floor(loop.delay / n + 1e-9)
    rest = max(loop.delay / n - whole, 0.0)
    acting = math.ceil((1 + loop.acting_ticks) / n)
    D = max(whole + 2, acting)
    size = 5 + D + 6
    early, late = _exponential(A * (rest * frame)), _exponential(A * ((1 - rest) * frame))
    k, N = points.size, size
    s = np.broadcast_to(np.eye(N), (k, N, N)).copy()  # a state per column
    p, u = s[:, :5], s[:, 5 : 5 + D]
    before, force, q1, w1, q2, w2 = (s[:, 5 + D + i] for i in range(6))
    x = p[:, 0] if loop.encoder == "motor" else _link_position(loop, points, p)
    tau_h = np.einsum("ki,kij->kj", hand[:, :5], p) + hand[:, 5:6] * u[:, whole]
    felt = force + lowpass_alpha(loop.force_lowpass_hz, loop.period_s) * (tau_h - force)  # once a sample
    v = (x - before) / frame
    quick, slow = _alpha(SMOOTHING * loop.bandwidth_hz, loop), _alpha(loop.bandwidth_hz, loop)
    q1 = q1 + quick * (u[:, acting - 1] + force - q1)
    w1 = w1 + quick * (v - w1)
    behind = w1 - w2
    q2, w2 = q2 + slow * (q1 - q2), w2 + slow * behind
    w_q = 2 * math.pi * loop.bandwidth_hz
    seen = q2 - loop.inertia_kgm2 * w_q * behind - loop.viscous_nms_rad * w2
    coupled = points.coupled[:, None]
    sent = loop.gain * TARGET_SHARE * seen
    sent = sent - coupled * (loop.stiffness_nm_rad * x + loop.damping_nms_rad * v)
    commands = np.concatenate([sent[:, None], u], axis=1)  # newest first
    for step, older in ((early, whole + 1), (late, whole)):
        p = step[:, :5, :5] @ p + step[:, :5, 5:6] * commands[:, older][:, None]
    rows = (p, commands[:, :D], *(one[:, None] for one in (x, felt, q1, w1, q2, w2)))
    return np.concatenate(rows, axis=1)


def _link_position(loop: Loop, points: Points, p: np.ndarray) -> np.ndarray:
    rigid = np.array([one.stiffness_nm_rad == 0 for one in loop.joints])[points.joint.astype(int)]
    return np.where(rigid[:, None], p[:, 0], p[:, 2])


def _alpha(hz: float, loop: Loop) -> float:
    """Coefficient of a low-pass over a whole frame."""
    return 1.0 - (1.0 - lowpass_alpha(hz, loop.period_s)) ** loop.sample_ticks
