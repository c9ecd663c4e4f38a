"""The loop that an admittance display closes, as matrices over a box of hands, virtual worlds and joints.

Pure functions of numbers. One loop is

- joint, dry friction (sliding, or stuck on its bristles), current loop and hand of `drive_in_hand`;
- the force: the sensor's own low-pass and delay, then the axis's and the display's low-pass, both the law's;
- the virtual mass m, damped by b_v, with a linear world of stiffness k_e and damping b_e on it:
  v_r+ = (m v_r + T (tau_f - k_e x_r+ - b_e v_r+))/(m + b_v T), x_r+ = x_r + T v_r+, solved for v_r+;
- the torque K_v (v_r+ - v_hat) + K_p (x_r+ - x) + z <J (v_r+ - v_r)/T + b v_r+ - tau_f>, v_hat the low-passed
  difference of positions, <> a low-pass, held over a period, after any delay, whole or not;
- dry friction where it is taken for a damping, and the help with it, which turns as the mass does.

The disturbance observer sends nothing beside a virtual mass.

The plant between two samples is exact. With a fresh sample every n-th tick the law runs n times a sample:
force, position and v_hat are held, the virtual mass goes on. Left out: the dead band of the force, which is a
gain between 0 and 1 in front of the mass; worlds that are not linear."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from rtctl.control.proofs.drive_in_hand import (
    STATES,
    Drive,
    Hands,
    frequency_hz,
    held_steps,
    over,
    plant,
    position,
)
from rtctl.control.proofs.eigenvalues import eigenvalues_of_each
from rtctl.control.velocity import lowpass_alpha

WORLD_STIFFNESS_NM_RAD = 1e6
WORLD_DAMPING_NMS_RAD = 1e4
"""The virtual worlds: from nothing to these, the most that a program may ask for (`environments.kind`)."""

USUAL_INERTIA_KGM2 = 0.012
"""Joint of the size for which the springs and dampers that are tried are written; of any other they are in
proportion."""

_SPRINGS, _SOFTEST_SPRING = 12, 3.0
_DAMPERS = (0.3, 3.0, 30.0)
"""Worlds of the grid: how many springs, the softest N m/rad, and dampers N m s/rad."""

_STIFFNESSES = 9
_SOFTEST = 0.004
_INERTIAS = (0.0, 0.03, 0.12, 0.4, 1.0)
_DAMPINGS = (0.0, 0.05, 1.0)
"""Hands of the grid, as shares of the box: twice as stiff at each step, and up to four times as heavy.
Between them the proof looks, on a joint that slides (`admittance_proof`). Few dampings, as the worst hands
have none (`fine_worlds`)."""

_OWN_STATES = 8
"""States of the law, beside commands and forces that are under way."""


@dataclass(frozen=True)
class Box:
    """The hands that are promised: from nothing to stiffness N m/rad, damping N m s/rad and inertia kg
    m^2."""

    stiffness_nm_rad: float = 600.0
    damping_nms_rad: float = 1.0
    inertia_kgm2: float = 0.02


@dataclass(frozen=True)
class AdmittanceLoop(Drive):
    """What is fixed about one axis. Symbols as in the module's text."""

    mass_kgm2: float
    virtual_damping_nms_rad: float
    velocity_gain_nms_rad: float
    position_gain_nm_rad: float = 0.0
    mass_max_kgm2: float = 0.0
    """The proof covers every virtual mass from `mass_kgm2` to this one; 0: that one alone. More damping is
    covered anyway, as a damper of the world is."""
    intake_lowpass_hz: float = 0.0
    velocity_lowpass_hz: float = 0.0
    feedforward: float = 0.0
    """Share z of J a_r + b v_r - tau_f that is sent, behind a low-pass."""
    feedforward_lowpass_hz: float = 0.0
    help_share: float = 0.0
    """Share of the dry friction that is helped with at most, in the direction of the virtual mass; the next:
    the way of the mass over which that turns, rad (`admittance_help`)."""
    help_turns_rad: float = 0.0
    told_viscous_nms_rad: float = 0.0
    """b of the joint as it stands in there, with whatever is compensated of it."""
    presliding_rad: float = 0.0
    bristles_to: float = 4.0
    """How many times as stiff as told they may be: the presliding length is known as an upper bound."""
    rest_damping_nms_rad: float = 0.0
    """Damping of the mass on a joint that sticks, of its motion beyond a low-pass of the next field."""
    rest_hz: float = 0.0
    box: Box = Box()

    @property
    def size(self) -> float:
        """How many times the usual joint it is: a knob's springs are no joint's."""
        return self.inertia_kgm2 / USUAL_INERTIA_KGM2


@dataclass(frozen=True)
class Points(Hands):
    """Points of the grid: `Hands`, and the world."""

    k_e: np.ndarray
    b_e: np.ndarray

    def beside(self, others: Points) -> Points:
        """Both, one after the other."""
        return Points(*map(np.concatenate, zip(self.columns(), others.columns(), strict=True)))

    def words(self, loop: AdmittanceLoop, at: int) -> str:
        """The hand, joint and world of one point."""
        k_h, b_h, m_h, bristle, joint, k_e, b_e = (float(column[at]) for column in self.columns())
        hz = frequency_hz(loop.inertia_kgm2, loop.joints[int(joint)])
        return (
            f"hand of {k_h:.3g} N m/rad, {b_h:.3g} N m s/rad, {m_h:.3g} kg m^2, "
            f"{'stuck' if bristle else 'sliding'}, {f'joint of {hz:.3g} Hz' if hz else 'rigid joint'}, "
            f"{f'world of {k_e:.3g} N m/rad and {b_e:.3g} N m s/rad' if k_e + b_e else 'no world'}"
        )


def points(rows: Sequence[tuple[float, ...]]) -> Points:
    """Points from rows of (k_h, b_h, m_h, bristle, joint, k_e, b_e)."""
    return Points(*np.array(rows, dtype=float).reshape(-1, 7).T.copy())


def grid(loop: AdmittanceLoop) -> Points:
    """Hands of the box, on every joint, sliding and stuck, in some worlds."""
    box = loop.box
    k_h = (0.0, *(np.geomspace(_SOFTEST, 1.0, _STIFFNESSES) * box.stiffness_nm_rad).tolist())
    b_h = [share * box.damping_nms_rad for share in _DAMPINGS]
    m_h = [share * box.inertia_kgm2 for share in _INERTIAS]
    hands = product(sorted({*k_h}), sorted({*b_h}), sorted({*m_h}), loop.bristles, range(len(loop.joints)))
    worlds = [(spring, 0.0) for spring in springs(loop, _SOFTEST_SPRING, _SPRINGS)]
    worlds += [(0.0, min(loop.size, 1.0) * damper) for damper in _DAMPERS]
    return points([(*hand, *world) for hand, world in product(hands, worlds)])


def springs(loop: AdmittanceLoop, softest_nm_rad: float, count: int) -> list[float]:
    """None and `count` springs of worlds, N m/rad, from the softest of a usual joint to the stiffest; of a
    smaller joint softer ones, and that stiffest."""
    smaller = min(loop.size, 1.0)
    ends = smaller * softest_nm_rad, smaller * WORLD_STIFFNESS_NM_RAD
    stiffest = [WORLD_STIFFNESS_NM_RAD] if smaller < 1 else []
    return [0.0, *np.geomspace(*ends, count).tolist(), *stiffest]


def fine_worlds(loop: AdmittanceLoop, *, only_stiffest: bool, count: int = 40) -> Points:
    """Hands without damping in springs of all stiffnesses, as the worst are found among them: all the box's,
    or its stiffest."""
    box = loop.box
    k_h = np.geomspace(_SOFTEST, 1.0, _STIFFNESSES)[-1 if only_stiffest else 0 :] * box.stiffness_nm_rad
    m_h = [share * box.inertia_kgm2 for share in _INERTIAS]
    k_e = springs(loop, 1.0, count)
    softest = [] if only_stiffest else [0.0]
    hands = product(
        sorted({*softest, *k_h.tolist()}), (0.0,), sorted({*m_h}), (0.0,), range(len(loop.joints))
    )
    return points([(*hand, one, 0.0) for hand, one in product(hands, k_e)])


@dataclass(frozen=True)
class Swing:
    """What dry friction and the help with it are in a swing, of every point: damping of the joint, spring and
    damping along the motion of the mass."""

    rubs: np.ndarray
    helps_nm_rad: np.ndarray
    helps_nms_rad: np.ndarray
    seen: np.ndarray
    """What a swing of the encoder's readings is of that of the joint."""


def matrices(loop: AdmittanceLoop, at: Points, swing: Swing | None = None) -> np.ndarray:
    """The closed loop from one fresh sample to the next, a matrix for every point, shape (points, N, N).

    Notes
    -----
    States: p of `drive_in_hand.plant`, the commands of the last ticks (D), what the force sensor has not
    shown yet (L), the last position, the force's two low-passes, v_hat, v_r, x_r, the low-passed v_r of a
    joint that sticks, and the torque sent ahead. Columns are built by running one frame from every unit
    state, all points at once."""
    T, n = loop.period_s, loop.sample_ticks
    A, hand, _ = plant(loop, at, 0.0 if swing is None else swing.rubs)
    whole = math.floor(loop.delay + 1e-9)
    D, L = whole + 2, math.ceil(loop.sensor_ticks / n)
    size = STATES + D + L + _OWN_STATES
    steps = held_steps(A, T, loop.delay)  # of a tick, not of a frame: the mass goes on between samples
    s = np.broadcast_to(np.eye(size), (at.size, size, size)).copy()  # a state per column
    p, u, late_force, ends = np.split(s, np.cumsum((STATES, D, L)), axis=1)
    before, sensed, felt, v_hat, v_r, x_r, calm, ahead = ends.swapaxes(0, 1)
    x = position(loop, at, p) if swing is None else swing.seen[:, None] * position(loop, at, p)
    shown = np.einsum("ki,kij->kj", hand[:, :STATES], p) + hand[:, STATES:] * u[:, whole]
    forces = np.concatenate([shown[:, None], late_force], axis=1)  # newest first
    # forces[L]: L samples old
    sensed = sensed + lowpass_alpha(loop.intake_lowpass_hz, T) * (forces[:, L] - sensed)
    felt = felt + lowpass_alpha(loop.force_lowpass_hz, T) * (sensed - felt)  # both once a sample
    v_hat = v_hat + over(loop.velocity_lowpass_hz, loop) * ((x - before) / (n * T) - v_hat)
    k_e, b_e = at.k_e[:, None], at.b_e[:, None]
    calms = np.where(at.bristle > 0, loop.rest_damping_nms_rad, 0.0)[:, None]
    # the step is implicit: damping and spring of the world stand beside the mass
    weight = loop.mass_kgm2 + T * (loop.virtual_damping_nms_rad + calms + b_e) + T * T * k_e
    share, quick = loop.feedforward, lowpass_alpha(loop.feedforward_lowpass_hz, T)
    for _ in range(n):
        v_before = v_r
        v_r = (loop.mass_kgm2 * v_r + T * (felt - k_e * x_r + calms * calm)) / weight
        x_r, calm = x_r + T * v_r, calm + lowpass_alpha(loop.rest_hz, T) * (v_r - calm)
        asked = loop.inertia_kgm2 * (v_r - v_before) / T + loop.told_viscous_nms_rad * v_r - felt
        ahead = ahead + quick * (asked - ahead)
        sent = loop.velocity_gain_nms_rad * (v_r - v_hat) + loop.position_gain_nm_rad * (x_r - x)
        sent = sent + share * ahead
        if swing is not None:
            sent = sent + swing.helps_nms_rad[:, None] * v_r + swing.helps_nm_rad[:, None] * x_r
        commands = np.concatenate([sent[:, None], u], axis=1)  # newest first
        for step, older in steps:
            p = step[:, :STATES, :STATES] @ p + step[:, :STATES, STATES:] * commands[:, older][:, None]
        u = commands[:, :D]
    now = (x, sensed, felt, v_hat, v_r, x_r, calm, ahead)
    return np.concatenate((p, u, forces[:, :L], *(one[:, None] for one in now)), axis=1)


def spectral_radii(loop: AdmittanceLoop, at: Points) -> np.ndarray:
    """Largest |eigenvalue| of one period at every point; infinite where a matrix is no number."""
    return np.asarray(np.abs(eigenvalues(loop, at)).max(axis=1))


def eigenvalues(loop: AdmittanceLoop, at: Points, swing: Swing | None = None) -> np.ndarray:
    """All eigenvalues of one period at every point, as complex numbers; infinite where a matrix is no
    number."""
    return eigenvalues_of(loop, matrices(loop, at, swing))


def eigenvalues_of(loop: AdmittanceLoop, M: np.ndarray) -> np.ndarray:
    """Eigenvalues of one period, of closed loops that are there already as `matrices` gives them; infinite
    where one is no number."""
    good = np.isfinite(M).all(axis=(1, 2))
    z = np.full(M.shape[:2], np.inf, dtype=complex)
    if good.any():
        z[good] = eigenvalues_of_each(M[good])
    return z if loop.sample_ticks == 1 else z ** (1 / loop.sample_ticks)  # of a frame of n ticks
