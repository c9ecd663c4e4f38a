"""The loop that the disturbance observer closes, as matrices over a box of hands and joints.

Pure functions of numbers. One loop is

- the joint, rigid or of two masses, its damping, and a hand (stiffness k_h to ground, damping b_h, mass m_h)
  behind the force sensor: tau_h = -(m_h dv/dt + b_h v + k_h x);
- its dry friction, absent (the joint slides) or a spring of break-away over presliding length (it sticks);
- the motor: torques held over a period, any delay, whole or not, a first-order current loop;
- the law: the observer of `disturbance_observer` with its two low-passes, plain difference velocity and the
  torque it believes to act, both as much later as it goes by, the force behind the sensor's own low-pass and
  delay and the law's low-pass, and the coupling to a proxy at rest, or none (free motion).

The plant between two samples is exact (matrix exponential). Fresh samples every n-th tick: the law's output
is held over n ticks, so the frame is n periods long and the delay 1/n of its ticks; the coupling's damping,
which then acts in one tick of n, is taken as spread over the frame. Feed-forward and energy account are left
out: the one only takes part of the observer's work, the other only scales both down."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np

from rtctl.control.disturbance_observer import SMOOTHING
from rtctl.control.proofs.drive_in_hand import STATES, Drive, Hands, held_steps, over, plant, position
from rtctl.control.velocity import lowpass_alpha

HAND_STIFFNESS_NM_RAD = (0.0, *np.geomspace(3.0, 600.0, 9).tolist())
HAND_DAMPING_NMS_RAD = (0.0, 0.03, 0.2, 1.0)
HAND_INERTIA_KGM2 = (0.0, 0.0005, 0.002, 0.006, 0.02)
"""The box of hands, at the link: those of a handle .1 m away, .3 to 60 kN/m, to 100 N s/m, .05 to 2 kg.

Steps of two in stiffness and of three to four in mass; what lies between them rests on the damping that
`observer_margin.KEPT_LEAST` keeps. A box that reaches down to light joints' own size found none more unstable
among 956 loops that passed (decision 0087)."""


@dataclass(frozen=True)
class Loop(Drive):
    """What is fixed about one axis. Symbols as in the module's text."""

    gain: float
    bandwidth_hz: float
    acting_ticks: int = 0
    """Delay by which the law goes when it asks which torque acted, ticks."""
    own_ticks: int = 0
    """By which the law delays torque and velocity, to belong to the force (`disturbance_observer`), ticks."""
    excess: float = 0.0
    """Share by which the law takes the inertia too high."""
    stiffness_nm_rad: float = 0.0
    """Stiffness of the coupling; the next field is its damping."""
    damping_nms_rad: float = 0.0
    hand: float = 1.0
    """Factor on stiffness, damping and inertia of the box of hands: of a linear axis those of the same hands
    in N/m, N s/m and kg."""


@dataclass(frozen=True)
class Points(Hands):
    """Points of the grid: `Hands`, and the coupling (0 or 1)."""

    coupled: np.ndarray


def grid(loop: Loop) -> Points:
    """Every hand of the box, on every joint, sliding and stuck, coupled and free."""
    return _grid(loop.hand, loop.bristles, len(loop.joints), 2 if loop.stiffness_nm_rad > 0 else 1)


@lru_cache(maxsize=8)
def _grid(hand: float, bristles: tuple[float, ...], joints: int, couplings: int) -> Points:
    box = (HAND_STIFFNESS_NM_RAD, HAND_DAMPING_NMS_RAD, HAND_INERTIA_KGM2)
    hands = tuple([hand * one for one in each] for each in box)
    rows = np.array(list(product(*hands, bristles, range(joints), range(couplings))), dtype=float)
    rows.flags.writeable = False  # many are given the same
    return Points(*rows.T)


def matrices(loop: Loop, points: Points) -> np.ndarray:
    """The closed loop from one fresh sample to the next, a matrix for every point of the grid.

    Notes
    -----
    States: p of `drive_in_hand.plant`, the commands of the last frames (D), what the force sensor has not
    shown yet (L), the velocities that the law has not gone by yet (V), the last position, the law's low-pass
    of the force, and the observer's q1, w1 (fast) and q2, w2 (slow) of torque and velocity.  Columns are
    built by running one frame from every unit state, all points at once."""
    n, frame = loop.sample_ticks, loop.sample_ticks * loop.period_s
    A, hand, _ = plant(loop, points)
    whole = math.floor(loop.delay / n + 1e-9)
    # frames back to the torque that it believes to act
    acting = math.ceil((1 + loop.acting_ticks + loop.own_ticks) / n)
    # `whole + 2`: a delay that is no whole number still holds the command before
    D, L, V = max(whole + 2, acting), math.ceil(loop.sensor_ticks / n), loop.own_ticks // n
    size = STATES + D + L + V + 6
    k, N = points.size, size
    s = np.broadcast_to(np.eye(N), (k, N, N)).copy()  # a state per column
    p, u, late_force, late_v = np.split(s[:, : size - 6], np.cumsum((STATES, D, L)), axis=1)
    before, force, q1, w1, q2, w2 = (s[:, size - 6 + i] for i in range(6))
    x = position(loop, points, p)
    shown = np.einsum("ki,kij->kj", hand[:, :STATES], p) + hand[:, STATES:] * u[:, whole]
    forces = np.concatenate([shown[:, None], late_force], axis=1)  # newest first
    felt = force + lowpass_alpha(loop.force_lowpass_hz, loop.period_s) * (forces[:, L] - force)
    v = (x - before) / frame
    moved = np.concatenate([v[:, None], late_v], axis=1)
    quick, slow = over(SMOOTHING * loop.bandwidth_hz, loop), over(loop.bandwidth_hz, loop)
    # `force`, not `felt`: the sample before, as the law's (6.1)
    q1 = q1 + quick * (u[:, acting - 1] + force - q1)
    w1 = w1 + quick * (moved[:, V] - w1)
    behind = w1 - w2
    q2, w2 = q2 + slow * (q1 - q2), w2 + slow * behind
    w_q = 2 * math.pi * loop.bandwidth_hz
    seen = q2 - (1 + loop.excess) * loop.inertia_kgm2 * w_q * behind - loop.viscous_nms_rad * w2
    coupled = points.coupled[:, None]
    sent = loop.gain * seen
    sent = sent - coupled * (loop.stiffness_nm_rad * x + loop.damping_nms_rad * v)
    commands = np.concatenate([sent[:, None], u], axis=1)  # newest first
    for step, older in held_steps(A, frame, loop.delay / n):
        p = step[:, :STATES, :STATES] @ p + step[:, :STATES, STATES:] * commands[:, older][:, None]
    rows = (
        p,
        commands[:, :D],
        forces[:, :L],
        moved[:, :V],
        *(one[:, None] for one in (x, felt, q1, w1, q2, w2)),
    )
    return np.concatenate(rows, axis=1)
