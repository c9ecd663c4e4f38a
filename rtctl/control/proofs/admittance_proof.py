"""Proof that an admittance loop is stable between the points of a grid, too: no root on the edge of stability
anywhere.

Roots move continuously with hand and world. If none lies on a closed curve around the stable ones for any
hand of the box and any world, there are as many outside everywhere as at one point of the grid: none. The
curve: |z| = 1, but around z = 1, where a joint that nothing holds has its root, with a detour that lets
through what grows by less than `SLOWEST_RAD_S`.

One cell is a piece of the curve from s0 to s1 times intervals of k_h, b_h, m_h, k_e, b_e and of the virtual
mass m, where that may change. In it F of `admittance_spectrum` lies, at either end, in the convex hull of its
values at the corners, 32 or 64, as F is affine in each of them (Zadeh and
Desoer's mapping theorem), widened by the disc of the aliases; between the ends it leaves the chord by no more
than h^2 |F''|/2, h half of the piece, and |F''| <= 2 max|F|/(rho - h)^2, the maximum over a disc of radius
rho (Cauchy). If all these discs lie in one open half-plane, F is not 0 in the cell. A cell that fails is cut
in two where it is the widest."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from rtctl.control.proofs.admittance_loop import (
    WORLD_DAMPING_NMS_RAD,
    WORLD_STIFFNESS_NM_RAD,
    AdmittanceLoop,
    Points,
    points,
    spectral_radii,
)
from rtctl.control.proofs.admittance_spectrum import Coefficients, HandCell, Joint, coefficients
from rtctl.control.proofs.discs import Disc, point

SLOWEST_RAD_S = 0.01
"""What grows more slowly than by e in 100 s is not looked for."""

BUDGET = 60_000
"""Cells looked at before a proof is given up, of an axis."""

_BATCH = 2048
"""Cells looked at at once: 64 corners at both ends are 4 MB of complex numbers."""
_RATIO = 1.06
"""First cells: a piece of the curve is so much longer at its end than at its begin. Finer ones are cells that
need not be, coarser ones are cut anyway: 2159 cells in place of 1641 with 1.02, 2011 with 1.12."""
_LONGEST = 0.06
"""And no longer than this share of 1/T."""
_AROUND = 0.25
"""Radius of the discs in which |F| is bounded, as a share of |s| and of 1/T. In a small one the
bound of the bend is large, in a large one that of |F|: the shipped display takes 3505 cells with .1, 1641
with this, 1479 with .4 and 2089 with .6."""
_INWARD = 1e-9
_TRIED = 48  # depth first: those that are left first are the smallest, and nearest to what fails
"""Cells left over whose corners are asked for eigenvalues."""
_GROWS = 1e-6

_FREQUENCY, _K, _B, _M, _KE, _BE, _MASS = range(7)
_SOFTEST = (0.0, 0.5, 0.01, 1e-3, 0.5, 0.05, 1e-3)
"""Where an interval that begins at 0 is cut: in the middle between this and its end, on a scale of ratios."""


@dataclass(frozen=True)
class Proof:
    """Whether every cell is proved, how many were looked at, one that is not, and whether the loop is
    unstable there."""

    proved: bool
    cells: int
    at: str = ""
    unstable: bool = False


def prove(loop: AdmittanceLoop, budget: int = BUDGET) -> Proof:
    """Prove that the loop is stable with every hand of the box and every linear world.

    A fresh sample every tick only. A proof that fails says nothing but that: the loop may be unstable, too
    near to it, or the cells too many."""
    if loop.sample_ticks != 1:
        return Proof(False, 0, "a fresh sample only every some ticks")
    looked = 0
    for joint in range(len(loop.joints)):
        for bristle in loop.bristles:
            # no crossing proves no more than "as stable as here"
            if not _stable_somewhere(loop, joint, bristle):
                return Proof(False, looked, "unstable at the point that the proof begins with")
            drive = Joint(loop, loop.joints[joint], bristle)
            cells, left = _cells(drive, budget - looked)
            looked += cells
            if left is not None:
                return _counter_example(drive, joint, *left, looked)
    return Proof(True, looked)


def _stable_somewhere(loop: AdmittanceLoop, joint: int, bristle: float) -> bool:
    box = loop.box
    hand = (0.3 * box.stiffness_nm_rad, 0.3 * box.damping_nms_rad, 0.3 * box.inertia_kgm2)
    return bool(spectral_radii(loop, points([(*hand, bristle, joint, 0.0, 0.0)]))[0] <= 1 + _INWARD)


def _cells(drive: Joint, budget: int) -> tuple[int, tuple[np.ndarray, np.ndarray] | None]:
    """Number of cells looked at, and the smallest that were not proved; None if all are."""
    loop = drive.loop
    left, looked = _first(loop), 0
    while left[0].size:
        ends, box = left[0][:_BATCH], left[1][:_BATCH]
        rest = left[0][_BATCH:], left[1][_BATCH:]
        if looked + len(ends) > budget:
            return looked, (ends[:_TRIED], box[:_TRIED])
        looked += len(ends)
        proved, cut = examine(drive, ends, box)
        bad = ~proved
        halves = _halves(ends[bad], box[bad], cut[bad])
        # depth first: memory stays small
        left = np.concatenate([halves[0], rest[0]]), np.concatenate([halves[1], rest[1]])
    return looked, None


def _counter_example(drive: Joint, joint: int, ends: np.ndarray, box: np.ndarray, looked: int) -> Proof:
    """A hand and a world of the cells that are left which are unstable, or that none was found."""
    corners = np.array(list(product((0, 1), repeat=5)))
    unstable, near = False, ""
    for mass in sorted({*box[:, _MASS - 1].ravel().tolist()}):
        rows = box[(box[:, _MASS - 1] == mass).any(axis=1)][:, np.arange(5), corners].reshape(-1, 5)
        k, b, m, k_e, b_e = rows.T
        at = Points(k, b, m, np.full(k.size, drive.bristle_nm_rad), np.full(k.size, float(joint)), k_e, b_e)
        radii = spectral_radii(replace(drive.loop, mass_kgm2=mass), at)
        worst = int(np.argmax(radii))
        unstable = bool(radii[worst] > 1 + _GROWS)
        near = f"near {np.abs(ends).mean() / (2 * math.pi):.3g} Hz, {at.words(drive.loop, worst)}"
        near += f", a virtual mass of {mass:.3g} kg m^2" if drive.loop.mass_max_kgm2 > 0 else ""
        if unstable:
            break
    return Proof(False, looked, near, unstable)


def _first(loop: AdmittanceLoop) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the pieces, shape (cells, 2), and the intervals, shape (cells, 6, 2)."""
    w, top = [SLOWEST_RAD_S], math.pi / loop.period_s
    while w[-1] < top:
        w.append(min(w[-1] * _RATIO, w[-1] + _LONGEST / loop.period_s, top))
    # around the root of a joint that nothing holds, by a chord: at .007/s from s = 0, where the hand's spring
    # has its pole, it keeps the discs clear of that
    detour = [SLOWEST_RAD_S * complex(1 - t, t) for t in np.linspace(0, 1, 40)]
    curve = np.array([*detour, *(1j * one for one in w[1:])])
    pieces = np.stack([curve[:-1], curve[1:]], axis=1)
    hand = loop.box
    hands = [(0, hand.stiffness_nm_rad), (0, hand.damping_nms_rad), (0, hand.inertia_kgm2)]
    worlds = [(0, WORLD_STIFFNESS_NM_RAD), (0, WORLD_DAMPING_NMS_RAD)]
    shown = (loop.mass_kgm2, max(loop.mass_kgm2, loop.mass_max_kgm2))
    # none cut beforehand: hands in four parts by their mass took twice as many cells, as most need no cut
    return pieces, np.tile(np.array([*hands, *worlds, shown], dtype=float), (len(pieces), 1, 1))


def examine(drive: Joint, ends: np.ndarray, box: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which cells are proved, and along what the others are best cut: 0 frequency, 1 to 6 an interval.

    Parameters
    ----------
    ends : array, shape (cells, 2)
        s0 and s1, rad/s.
    box : array, shape (cells, 6, 2)
        Intervals of k_h, b_h, m_h, k_e, b_e, m."""
    hands = HandCell(box[:, 0], box[:, 1], box[:, 2])
    middle, half = 0.5 * (ends[:, 0] + ends[:, 1]), 0.5 * np.abs(ends[:, 1] - ends[:, 0])
    # clear of s = 0, where the hand's 1/s has its pole
    around = np.minimum(_AROUND * np.abs(middle), _AROUND / drive.loop.period_s)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        most = _corners(coefficients(drive, Disc(middle, around), hands), Disc(middle, around), drive, box)
        both = [_corners(coefficients(drive, point(s), hands), point(s), drive, box) for s in ends.T]
        bend = _most(most) * _across((half / (around - half)) ** 2)  # h^2/2 of |F''| <= 2 max|F|/(rho - h)^2
        bend = np.where(_across(half < around), bend, np.inf)[:, None]
        F = np.stack([_value(one) for one in both], axis=1)
        wide = np.stack([_radius(one) for one in both], axis=1)
        return _judge(F, wide, bend)


@dataclass(frozen=True)
class _Corners:
    """Z_v, Z_h (shape cells x six axes of 2, the last of 1 where the mass is one) and the coefficients beside
    them."""

    hand: Disc
    world: Disc
    c: Coefficients


def _across(column: np.ndarray) -> np.ndarray:
    return column.reshape(-1, 1, 1, 1, 1, 1, 1)


def _corners(c: Coefficients, s: Disc, drive: Joint, box: np.ndarray) -> _Corners:
    def along(values: np.ndarray, axis: int) -> np.ndarray:
        return values.reshape(len(box), *(values.shape[1] if axis == j else 1 for j in range(6)))

    k, b, m, k_e, b_e = (along(box[:, i], i) for i in range(5))
    one_mass = drive.loop.mass_max_kgm2 <= drive.loop.mass_kgm2
    shown = along(box[:, 5, :1] if one_mass else box[:, 5], 5)
    wide, inverse, spring = _spread(s), _spread(s.inverse()), _spread(c.back.inverse())
    hand = Disc(b + m * wide.center + k * inverse.center, m * wide.radius + k * inverse.radius)
    back, T = _spread(c.back), drive.loop.period_s
    damping = drive.loop.virtual_damping_nms_rad + b_e
    world = Disc(
        shown / T * back.center + damping + k_e * T * spring.center,
        shown / T * back.radius + k_e * T * spring.radius,
    )
    return _Corners(hand, world, c)


def _spread(disc: Disc) -> Disc:
    return Disc(_across(disc.center), _across(disc.radius))


def _value(at: _Corners) -> np.ndarray:
    p0, p1, q0, q1 = (_across(one.center) for one in (at.c.p0, at.c.p1, at.c.q0, at.c.q1))
    return np.asarray(at.world.center * (p0 + p1 * at.hand.center) - (q0 + q1 * at.hand.center))


def _radius(at: _Corners) -> np.ndarray:
    """Radius of F where Z_v and Z_h are points."""
    p0, p1, q0, q1 = (_across(one.radius) for one in (at.c.p0, at.c.p1, at.c.q0, at.c.q1))
    hand = np.abs(at.hand.center)
    return np.asarray(np.abs(at.world.center) * (p0 + p1 * hand) + q0 + q1 * hand)


def _most(at: _Corners) -> np.ndarray:
    """Bound of |F|."""
    p0, p1, q0, q1 = (_across(one.most) for one in (at.c.p0, at.c.p1, at.c.q0, at.c.q1))
    hand = at.hand.most
    return np.asarray(at.world.most * (p0 + p1 * hand) + q0 + q1 * hand)


def _judge(F: np.ndarray, wide: np.ndarray, bend: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Do all discs lie in an open half-plane? And what makes their directions differ the most."""
    axes = tuple(range(1, 8))
    size = np.abs(F)
    unit = F / size
    off = np.angle(unit * np.conj(unit.sum(axis=axes, keepdims=True)))  # against their mean: no jump at pi
    angle = np.arcsin(np.minimum((wide + bend) / size, 1.0))
    proved = (off + angle).max(axis=axes) - (off - angle).min(axis=axes) < math.pi - _INWARD
    proved &= (wide + bend < size).all(axis=axes)  # a disc that holds 0 has no direction
    spreads = []
    for axis in range(1, 8):
        one, other = np.take(unit, [0], axis=axis), np.take(unit, [-1], axis=axis)
        spreads.append(np.abs(np.angle(one * np.conj(other))).max(axis=axes))
    spreads[_FREQUENCY] += 2 * np.arcsin(np.minimum(bend / size, 1.0)).max(axis=axes)
    spreads[_M] += 2 * np.arcsin(np.minimum(wide / size, 1.0)).max(axis=axes)
    score = np.nan_to_num(np.array(spreads), nan=math.pi)  # where F is no number, cut
    return proved, np.argmax(score, axis=0)


def _halves(ends: np.ndarray, box: np.ndarray, cut: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both parts of every cell."""
    low_ends, high_ends, low, high = ends.copy(), ends.copy(), box.copy(), box.copy()
    along = cut == _FREQUENCY
    middle = 0.5 * (ends[along, 0] + ends[along, 1])
    low_ends[along, 1] = high_ends[along, 0] = middle
    for axis in range(1, 7):
        rows = cut == axis
        least, most = box[rows, axis - 1].T
        soft = np.minimum(_SOFTEST[axis] ** 2 / np.maximum(most, 1e-300), most / 4)
        at = np.where(most > 4 * least, np.sqrt(np.maximum(least, soft) * most), 0.5 * (least + most))
        low[rows, axis - 1, 1] = high[rows, axis - 1, 0] = at
    return np.concatenate([low_ends, high_ends]), np.concatenate([low, high])
