"""What a joint's magnets or poles do to it at each place, whichever way it turns: measured once, and taken
off what the motor gives.

Turned one way and back a motor gives F + c(x) and -F + c(x): half the sum is c, friction aside, of any order
and over any travel. Its mean is left in: an offset of the sensor, or of a direction, is no cogging."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from rtctl.identify.tick_readings import Measurement

MATTERS_SHARE = 0.1
"""Cogging with a smaller RMS, as a share of the friction, is left to the mean over places."""
CELLS = 512
"""Places of a turn: twenty for each wave of a motor of 24 a turn."""
_WAYS_LEAST = 8


@dataclass(frozen=True)
class Cogging:
    """Torque of the motor that a place asks for beside friction.

    Attributes
    ----------
    place_rad, torque_nm : array, shape (n,)
        Rising places and what is wanted there, N m along +x, zero in the mean; empty: none that matters.
    turn_rad
        It comes back after so much; 0: the places are all the travel there is."""

    place_rad: np.ndarray
    torque_nm: np.ndarray
    turn_rad: float = 0.0

    @classmethod
    def none(cls) -> Cogging:
        """No cogging."""
        return cls(np.zeros(0), np.zeros(0))

    @property
    def matters(self) -> bool:
        """Whether there is anything to take off."""
        return len(self.place_rad) > 0

    @property
    def slope_nm_rad(self) -> float:
        """Steepest change over place, N m/rad."""
        if not self.matters:
            return 0.0
        return float(np.abs(np.diff(self.torque_nm) / np.diff(self.place_rad)).max())

    def at(self, position_rad: np.ndarray) -> np.ndarray:
        """Torque at these positions, N m."""
        if not self.matters:
            return np.zeros(len(position_rad))
        period = self.turn_rad or None
        torque: np.ndarray = np.interp(position_rad, self.place_rad, self.torque_nm, period=period)
        return torque

    def noted(self, measurement: Measurement) -> Measurement:
        """The measurement with what was taken off at its mean place."""
        return replace(measurement, cogging_nm=float(self.at(np.array([measurement.position_rad]))[0]))

    def taken_off(self, rows: np.ndarray, axis: int) -> np.ndarray:
        """The same ticks with the motor's torque, measured and sent, as it would be without; a copy where
        there is any."""
        if not self.matters:
            return rows
        rows, torque_nm = rows.copy(), self.at(rows["position_rad"][:, axis])
        # both: friction is made of what was measured, an uneven motion is told by what was sent
        for name in ("motor_torque_nm", "torque_applied_nm"):
            rows[name][:, axis] -= torque_nm
        return rows


def cogging_of(
    forward: tuple[np.ndarray, np.ndarray],
    backward: tuple[np.ndarray, np.ndarray],
    turn_rad: float,
    whole: bool,
) -> Cogging:
    """Cogging out of even motion to and fro.

    Parameters
    ----------
    forward, backward
        Position, rad, and torque that the motor gave without what moved the inertia, N m, each array of shape
        (n,).
    whole
        The way is a turn and more: what follows comes back after `turn_rad`.

    Returns
    -------
    Cogging
        None where it is small beside the friction, or the ways have few places in common."""
    # parts of a turn, whatever the travel: a cell is then as wide as a wave asks for
    way = turn_rad / CELLS
    there, back = (_means(*each, way, turn_rad if whole else math.inf) for each in (forward, backward))
    both = np.intersect1d(list(there), list(back))  # half a sum needs both ways at a place
    if len(both) < _WAYS_LEAST:
        return Cogging.none()
    one, other = (np.array([means[cell] for cell in both]) for means in (there, back))
    torque_nm, friction_nm = 0.5 * (one + other), 0.5 * abs(float(np.mean(one - other)))
    torque_nm -= torque_nm.mean()  # an offset of the sensor is no cogging
    if not float(np.sqrt(np.mean(torque_nm**2))) > MATTERS_SHARE * friction_nm:
        return Cogging.none()
    return Cogging((both + 0.5) * way, torque_nm, turn_rad if whole else 0.0)


def _means(x: np.ndarray, torque_nm: np.ndarray, way: float, turn_rad: float) -> dict[int, float]:
    cells = np.floor((x % turn_rad if math.isfinite(turn_rad) else x) / way).astype(int)
    found, inverse, count = np.unique(cells, return_inverse=True, return_counts=True)
    mean = np.bincount(inverse, torque_nm) / count
    return dict(zip(found.tolist(), mean.tolist(), strict=True))
