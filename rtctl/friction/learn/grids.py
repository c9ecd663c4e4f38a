"""Hyper-parameters tried: the grids of the papers in size (105 RBF, 40 spline), in the scale of the data.

What a kernel's own parameters and bounds C are tried at is said by its kind. The papers' own values are not
published. C is given as a multiple of the largest friction and epsilon as a multiple of the points' noise, so
that the same grids serve a rig of .03 N m and one of 30 N m."""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import lru_cache

import numpy as np

from rtctl.friction.kind_spline import UNIT
from rtctl.friction.kind_table import FAMILIES, FORMULAS, KERNELS
from rtctl.friction.learn.machines import Candidate

EPSILON = (1.0, 1.5, 2.0, 3.0, 4.0)
"""Half widths of the tube, multiples of the noise or of `RESOLUTION_SHARE`, whichever is larger."""

RESOLUTION_SHARE = 0.005
"""Share of the largest friction below which errors do not matter: the narrowest tube of an epsilon machine,
and the held-out error down to which candidates are equal (decision 0012). Points of 100 measurements are so
quiet that less would spend twice the support vectors on a curve that no hand, and no current sensor, could
tell apart."""

NU = (0.05, 0.1, 0.2, 0.3, 0.5)
"""Least shares of support vectors. Above one half the tube is narrower than the noise of the points."""


def families_of(kernel: str, motion: str) -> tuple[str, ...]:
    """Rungs to climb for an axis: of a linear one, whose speeds have no usual size in m/s, those that do not
    know it."""
    known = [f"-{name}" for name, kind in KERNELS.items() if motion == "linear" and not kind.any_unit]
    return tuple(one for one in families(kernel) if not one.endswith(tuple(known)))


def families(kernel: str) -> tuple[str, ...]:
    """Rungs of one kernel, of "formula", or "all" of them."""
    if kernel == "all":
        return FAMILIES
    if kernel == "formula":
        return tuple(FORMULAS)
    return tuple(family for family in FAMILIES if family.endswith(f"-{kernel}"))


def noise_nm(speed: np.ndarray, friction_nm: np.ndarray, session: np.ndarray | None = None) -> float:
    """Noise (standard deviation) of the points around a smooth curve, N m, > 0.

    Parameters
    ----------
    session : ndarray, shape (n,), optional
        Session of each point: the curve is one of each session. What sessions differ by is no noise, and two
        of them held together would have more of it than each alone (decision 0049).

    Notes
    -----
    Second differences of neighbours in speed, weighted so that any straight line cancels; their median size
    over .6745 and the root of their squared weights. Not below a thousandth of the largest friction. Every
    candidate asks for it on the same points, hence it is kept."""
    # bytes as the key: arrays have no hash, and hundreds of candidates ask for the same points
    columns = (speed, friction_nm) if session is None else (speed, friction_nm, session)
    return _noise_nm(*(np.asarray(column, dtype=float).tobytes() for column in columns))


@lru_cache(maxsize=64)
def _noise_nm(*columns: bytes) -> float:
    speed, friction_nm, *sessions = (np.frombuffer(column) for column in columns)
    session = sessions[0] if sessions else None
    names = () if session is None else tuple(np.unique(session))
    sizes = [_second_differences(speed[session == one], friction_nm[session == one]) for one in names]
    # sessions of one or two points each show none: then all points together do
    size = np.concatenate([*sizes, np.zeros(0)])
    if not len(size):
        size = _second_differences(speed, friction_nm)
    # two points show none
    # the median size of normal numbers is .6745 of their deviation; a median, since one bad point is in three
    # differences
    return max(float(np.median(size)) / 0.6745 if len(size) else 0.0, 1e-3 * float(friction_nm.max()))


def _second_differences(speed: np.ndarray, friction_nm: np.ndarray) -> np.ndarray:
    """Size of the weighted second differences, each as large as the noise on average, N m."""
    order = np.argsort(speed, kind="stable")
    v, f = speed[order], friction_nm[order]
    span = v[2:] - v[:-2]
    # three repeats of one speed: their mean is the line
    share = np.divide(v[2:] - v[1:-1], span, out=np.full(len(span), 0.5), where=span > 0)
    difference = f[1:-1] - share * f[:-2] - (1 - share) * f[2:]
    # noise of all three points is in it: over the root of their squared weights it is that of one
    return np.asarray(np.abs(difference) / np.sqrt(1 + share**2 + (1 - share) ** 2))


def unit_nm(speed: np.ndarray, friction_nm: np.ndarray, session: np.ndarray | None = None) -> float:
    """Unit of the tube of an epsilon machine, N m: noise of the points, or what no hand could tell apart."""
    return max(noise_nm(speed, friction_nm, session), RESOLUTION_SHARE * float(friction_nm.max()))


def in_scale_of(
    one: Candidate,
    speed: np.ndarray,
    friction_nm: np.ndarray,
    training: np.ndarray,
    session: np.ndarray | None = None,
) -> Candidate:
    """The candidate with C and epsilon in the scale of its training points alone: those held out may not set
    them.

    `speed` (by rising speed) and `friction_nm` are the points whose scale the candidate has; `training`
    chooses, (n,) bool."""
    if one.machine == "formula":
        return one
    if one.parts:
        parts = (
            (share, in_scale_of(part, speed, friction_nm, training, session)) for share, part in one.parts
        )
        return replace(one, parts=tuple(parts))
    v, f = speed[training], friction_nm[training]
    # C is a torque: half of the friction is as well bounded by half of it
    c = one.c * float(f.max()) / float(friction_nm.max())
    tube = one.tube
    if one.machine == "epsilon":
        kept = None if session is None else session[training]
        tube *= unit_nm(v, f, kept) / unit_nm(speed, friction_nm, session)
    return one if (c, tube) == (one.c, one.tube) else replace(one, c=c, tube=tube)


TOP_RAD_S = 2.0
"""Speed that joints reach; the largest of a linear axis's points stands for it."""


def unit_of(motion: str, speed_max: float) -> float:
    """Speed that counts as 1 in a kernel that is not scale-free: 1 rad/s, of a linear axis by its largest
    speed (m/s)."""
    return speed_max / TOP_RAD_S if motion == "linear" else 1.0


def candidates(
    family: str,
    speed: np.ndarray,
    friction_nm: np.ndarray,
    unit_rad_s: float = 1.0,
    session: np.ndarray | None = None,
) -> list[Candidate]:
    """Every candidate of one rung, in the scale of the points; `unit_rad_s` is that of `unit_of`, `session`
    as of `noise_nm`.

    Raises
    ------
    ValueError
        An unknown family."""
    if family in FORMULAS:
        return [Candidate("formula", family)]
    if family not in FAMILIES:
        raise ValueError(f"unknown family {family!r}: one of {', '.join(FAMILIES)}")
    machine, kind = family.split("-")
    top = float(friction_nm.max())
    unit = unit_nm(speed, friction_nm, session)
    # nu is a share of the points and knows no unit; an epsilon is a torque and goes by their noise
    tubes = NU if machine == "nu" else tuple(unit * factor for factor in EPSILON)
    kernel = KERNELS[kind]
    scaled = {UNIT: unit_rad_s} if UNIT in kernel.names and unit_rad_s != 1.0 else {}
    return [
        Candidate(machine, kind, top * c, tube, {**one, **scaled})
        for one, c, tube in itertools.product(
            kernel.grid(float(speed.max())), kernel.c_shares, tubes[kernel.tubes]
        )
    ]
