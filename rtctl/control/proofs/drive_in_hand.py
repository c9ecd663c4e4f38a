"""A drive in a hand between two samples: what the loops of disturbance observer and admittance display both
act on.

Pure functions of numbers: the joint, rigid or of two masses, its damping, the bristles of a joint that
sticks, a current loop, of first order unless it overshoots, and a hand (stiffness k_h to ground, damping b_h,
mass m_h) behind the force sensor, tau_h = -(m_h dv/dt + b_h v + k_h x), and the sensor's own low-pass,
through which the law sees tau_h (docs/theory.md 2.14)."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass, fields
from typing import Self

import numpy as np

from rtctl.control.velocity import lowpass_alpha

RESONANCES_HZ = (20.0, 30.0, 50.0, 70.0, 100.0)
"""Resonances tried for an elastic joint whose own is not declared: two equal masses that swing freely.

Other shares of the link are not tried: .8 of the inertia there asks for half of the bandwidth or less where
that is below 20 Hz (docs/theory.md 6.5), of every rig whose joint nobody declares."""

JOINT_DAMPING_RATIO = 0.01
"""Damping ratio of the spring of such a joint: little."""

BRISTLE_DAMPING_SHARE = 0.02
"""Damping of the spring of a joint that sticks, as a share of the critical one of joint and bristles:
little."""

_HALVINGS = 12
_TERMS = 8
"""Halvings and terms of `exponential`: within 1e-11 of SciPy's for loops of the shipped display (norm of A T
to 36), where the finest tolerance of a proof is 1e-9."""
_UNUSED_1_S = -1e3
"""States that a joint does not have die out. Any rate below 0 would do: an eigenvalue between 0 and 1 that
does not turn is neither unstable nor a vibration."""

STATES = 6
"""Number of states of `plant`."""


@dataclass(frozen=True)
class ElasticJoint:
    """Two masses: share of the inertia on the link's side, stiffness N m/rad, damping N m s/rad; 0 stiffness:
    rigid."""

    link_share: float = 0.5
    stiffness_nm_rad: float = 0.0
    damping_nms_rad: float = 0.0


RIGID = ElasticJoint()


def resonance(inertia_kgm2: float, hz: float) -> ElasticJoint:
    """Two equal masses that swing freely at `hz`."""
    # halves that swing against each other are to their spring one mass of J/4
    omega, reduced = 2 * math.pi * hz, inertia_kgm2 / 4
    return ElasticJoint(0.5, reduced * omega**2, 2 * JOINT_DAMPING_RATIO * reduced * omega)


def unknown_gears(inertia_kgm2: float, from_hz: float) -> tuple[ElasticJoint, ...]:
    """What a joint may be that nobody calls elastic, or of which only the lowest resonance is known, Hz:
    `RESONANCES_HZ` and that one; none where it is beyond them."""
    known = (from_hz,) if 0 < from_hz <= RESONANCES_HZ[-1] else ()
    return tuple(
        resonance(inertia_kgm2, hz) for hz in (*known, *(hz for hz in RESONANCES_HZ if hz > from_hz))
    )


def frequency_hz(inertia_kgm2: float, joint: ElasticJoint) -> float:
    """At which the two masses swing freely, Hz; 0 for a rigid joint."""
    reduced = joint.link_share * (1 - joint.link_share) * inertia_kgm2
    return math.sqrt(joint.stiffness_nm_rad / reduced) / (2 * math.pi)


@dataclass(frozen=True)
class Drive:
    """What is fixed about a drive with its force sensor; joints and bristles are what a grid goes over."""

    inertia_kgm2: float
    """Motor and link; the next: damping of both."""
    viscous_nms_rad: float
    period_s: float
    _: KW_ONLY
    delay: float = 0.0
    """Ticks from a fresh sample to its torque."""
    lag_hz: float = 0.0
    """Bandwidth of the current loop; 0: ideal."""
    overshoot: float = 0.0
    """How far its current exceeds a step, as in `stability.Between`; above 0 only without `sensor_hz`."""
    sample_ticks: int = 1
    sensor_hz: float = 0.0
    """The force sensor's own low-pass; 0: none. The next field is what it is late besides, ticks, whole
    ones."""
    sensor_ticks: int = 0
    force_lowpass_hz: float = 0.0
    bristle_nm_rad: float = 0.0
    """Break-away torque over presliding length."""
    link_viscous_nms_rad: float = 0.0
    """Damping behind the spring of an elastic joint, a part of `viscous_nms_rad`; help takes nothing of
    it."""
    encoder: str = "motor"
    """`motor` or `link`."""
    joints: tuple[ElasticJoint, ...] = (RIGID,)
    """Those that the column `joint` counts through."""

    @property
    def bristles(self) -> tuple[float, ...]:
        """Stiffness of the bristles of a joint that slides (0) and, if there is dry friction, of one that
        sticks, N m/rad."""
        return (0.0, self.bristle_nm_rad) if self.bristle_nm_rad > 0 else (0.0,)


@dataclass(frozen=True)
class Hands:
    """Points of a grid, a column for each thing that differs: hands (N m/rad, N m s/rad, kg m^2), bristles (N
    m/rad; 0: sliding) and joints (index of `Drive.joints`); more columns belong to who closes the loop."""

    k_h: np.ndarray
    b_h: np.ndarray
    m_h: np.ndarray
    bristle: np.ndarray
    joint: np.ndarray

    def __getitem__(self, index: np.ndarray | int) -> Self:
        return type(self)(*(np.atleast_1d(column[index]) for column in self.columns()))

    def columns(self) -> tuple[np.ndarray, ...]:
        """All columns, in order."""
        return tuple(getattr(self, field.name) for field in fields(self))

    @property
    def size(self) -> int:
        """Number of points."""
        return int(self.columns()[0].size)


def exponential(A: np.ndarray) -> np.ndarray:
    """Matrix exponential of a stack of small matrices: Taylor's series of a 4096th part, squared twelve
    times.

    Equal ones that follow each other, as those of one hand in all worlds do, are computed once."""
    differs = np.ones(len(A), dtype=bool)
    differs[1:] = (A[1:] != A[:-1]).any(axis=(1, 2))
    part = A[differs] / 2.0**_HALVINGS
    eye = np.broadcast_to(np.eye(A.shape[-1]), part.shape)
    out = eye.copy()
    for n in range(_TERMS, 0, -1):
        out = eye + part @ out / n
    for _ in range(_HALVINGS):
        out = out @ out
    return out[np.cumsum(differs) - 1]


def held_steps(A: np.ndarray, frame_s: float, late: float) -> list[tuple[np.ndarray, int]]:
    """Matrices over the parts of a frame in which one command each is held, in order, and how many frames old
    that command is.

    Parameters
    ----------
    A : ndarray
        Of `plant`, shape (points, STATES + 1, STATES + 1).
    late : float
        Delay from a sample to its torque, frames, whole or not; whole ones are held over all of a frame."""
    # seconds over a period are whole but for rounding; a part of 1e-16 would be one more exponential
    whole = math.floor(late + 1e-9)
    rest = max(late - whole, 0.0)
    parts = ((rest, whole + 1), (1 - rest, whole))
    return [(exponential(A * (part * frame_s)), older) for part, older in parts if part > 0]


def plant(
    loop: Drive, points: Hands, rubs: np.ndarray | float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """dp/dt = A p + B u of every point, u and p = (x_m, v_m, x_l, v_l, i, f) in one: (p, u), and what the
    sensor shows as (c, d) of it: f, its low-pass, or without one tau_h itself. `rubs`: damping besides of
    what the motor's friction is taken for, of each point, N m s/rad."""
    shares = np.array([(one.link_share, one.stiffness_nm_rad, one.damping_nms_rad) for one in loop.joints])
    share, k_j, b_j = shares[points.joint.astype(int)].T
    rigid = k_j == 0.0
    J, b, n = loop.inertia_kgm2, loop.viscous_nms_rad, points.k_h.size
    behind = np.where(rigid, 0.0, loop.link_viscous_nms_rad)  # one mass has all of it
    # without the hand's mass, which would count as more damping of the bristles
    critical = 2 * np.sqrt(points.bristle * J)
    b_m, b_l = b - behind + BRISTLE_DAMPING_SHARE * critical + rubs, behind + points.b_h
    J_m, J_l = np.where(rigid, J, (1 - share) * J), np.where(rigid, 0.0, share * J) + points.m_h
    A = np.zeros((n, STATES + 1, STATES + 1))
    A[:, 0, 1], A[:, 2, 3] = 1.0, 1.0
    motor, link = np.zeros((n, STATES + 1)), np.zeros((n, STATES + 1))
    motor[:, 0], motor[:, 1], motor[:, 4] = -(points.bristle + k_j), -(b_m + b_j), 1.0
    motor[:, 2], motor[:, 3] = k_j, b_j
    link[:, 2], link[:, 3], link[:, 0], link[:, 1] = -(k_j + points.k_h), -(b_j + b_l), k_j, b_j
    whole = motor.copy()
    whole[:, 0] -= points.k_h
    whole[:, 1] -= b_l
    A[:, 1] = np.where(rigid[:, None], whole / (J_m + J_l)[:, None], motor / J_m[:, None])
    A[:, 3] = np.where(rigid[:, None], A[:, 1], link / np.where(rigid, 1.0, J_l)[:, None])
    tau = 2 * math.pi * loop.lag_hz
    A[:, 4, 4], A[:, 4, STATES] = -tau, tau
    if tau == 0:  # the torque is the command itself
        A[:, :, STATES] += A[:, :, 4]
        A[:, :, 4] = 0.0
        A[:, 4, 4] = _UNUSED_1_S  # a row of zeros would be an eigenvalue of 1: a joint that drifts
    elif loop.overshoot > 0:
        _overshoots(loop, A)
    at, moving = np.where(rigid, 0, 2), np.where(rigid, 1, 3)
    # -m_h dv/dt: by the row of the acceleration
    hand = -points.m_h[:, None] * A[np.arange(n), moving]
    hand[np.arange(n), at] -= points.k_h
    hand[np.arange(n), moving] -= points.b_h
    # in a rigid joint the link's states are the motor's: they are left out
    A[rigid, 2:4] = 0.0
    A[rigid, 2, 2] = A[rigid, 3, 3] = _UNUSED_1_S
    hand[rigid, 2:4] = 0.0
    return A, _sensed(loop, A, hand), rigid


def _overshoots(loop: Drive, A: np.ndarray) -> None:
    """Make the current one of second order, with the same lag at low frequencies (docs/theory.md 2.4), by the
    state that a low-pass of the sensor would have."""
    decay, lag_1_s = -math.log(loop.overshoot), 2 * math.pi * loop.lag_hz
    zeta = decay / math.hypot(math.pi, decay)
    omega = 2 * zeta * lag_1_s
    A[:, 4, 4], A[:, 4, STATES], A[:, 4, 5] = 0.0, 0.0, 1.0
    A[:, 5, 4], A[:, 5, STATES], A[:, 5, 5] = -(omega**2), omega**2, -2 * zeta * omega


def _sensed(loop: Drive, A: np.ndarray, hand: np.ndarray) -> np.ndarray:
    """What the sensor shows, as (c, d) of (p, u); its low-pass is put into the last row of A."""
    cut = 2 * math.pi * loop.sensor_hz
    if cut == 0:
        if not loop.overshoot > 0 or loop.lag_hz == 0:  # else the current has it
            A[:, 5, 5] = _UNUSED_1_S
        return hand
    A[:, 5] = cut * hand
    A[:, 5, 5] -= cut
    shown = np.zeros_like(hand)
    shown[:, 5] = 1.0
    return shown


def position(loop: Drive, points: Hands, p: np.ndarray) -> np.ndarray:
    """What the encoder sees of plants' states p, one in a column."""
    if loop.encoder == "motor":
        return p[:, 0]
    rigid = np.array([one.stiffness_nm_rad == 0 for one in loop.joints])[points.joint.astype(int)]
    return np.where(rigid[:, None], p[:, 0], p[:, 2])


def over(hz: float, drive: Drive) -> float:
    """Coefficient of a low-pass over the ticks from one fresh sample to the next."""
    return 1.0 - (1.0 - lowpass_alpha(hz, drive.period_s)) ** drive.sample_ticks
