"""A log made ready to look at its turns, and the stop operator over its path: what presliding length and
memory share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.control.feedforward import saturate
from rtctl.control.jit import compiled
from rtctl.friction.logs.dynamics import SAMPLES_PER_CUTOFF, AxisLog, smooth
from rtctl.friction.logs.signal_shift import derivatives

SHORTEST_RAD = 1e-5
"""Shortest length that is tried; below it a joint is one whose friction turns at once, for any hand."""

LONGEST_SHARE = 0.2
"""Longest length that is tried, share of the range of the motion: strokes must be long enough to slide."""

FEW_TURNS = 0.1
"""Share of the turns up to which stretches are left out whose whole range is below `LONGEST_SHARE` of the
widest: the end of a log, in which the joint hardly moves."""

STRIBECK_RAD_S = (0.02, 0.1)
"""Speeds of the Stribeck peaks beside the Coulomb friction: without them a peak at rest looks like shorter
bristles."""


@dataclass(frozen=True)
class TurningPart:
    """One stretch: acceleration and velocity (n, 2) and torque, filtered; Stribeck peaks (1 at rest); the
    path of its bristles.

    `rows` are the rows looked at, `turned` those in which the motion turns back while the joint moves;
    `radian` is that of `AxisLog`."""

    motion: np.ndarray
    torque_nm: np.ndarray
    path_rad: np.ndarray
    peaks: tuple[np.ndarray, ...]
    rows: np.ndarray
    turned: np.ndarray
    rate_hz: float
    cutoff_hz: float
    radian: float = 1.0

    @property
    def turns(self) -> int:
        """How many turns there are."""
        return len(self.turned)

    def smoothed(self, columns: Sequence[np.ndarray]) -> np.ndarray:
        """Columns (n,) through the filter of the motion, all at once, in the rows looked at: (rows, k)."""
        filtered = smooth(np.stack(columns), self.rate_hz, self.cutoff_hz)
        return np.ascontiguousarray(filtered[:, self.rows].T)


def parts_of(logs: Sequence[AxisLog], cutoff_hz: float, speed_min_rad_s: float) -> list[TurningPart]:
    """Stretches made ready, without those that are too short and those that hardly move beside the others
    (`FEW_TURNS`): the longest length that is tried would go by their range, and end below the true one."""
    parts = [part for log in logs if (part := made_ready(log, cutoff_hz, speed_min_rad_s)) is not None]
    widest = max((float(np.ptp(part.path_rad)) for part in parts), default=0.0)
    wide = [part for part in parts if np.ptp(part.path_rad) >= LONGEST_SHARE * widest]
    turns = sum(part.turns for part in parts)
    return wide if sum(part.turns for part in wide) >= (1 - FEW_TURNS) * turns else parts


def made_ready(log: AxisLog, cutoff_hz: float, speed_min_rad_s: float) -> TurningPart | None:
    """One stretch made ready; None when it is too short or not finite."""
    rate, n = log.rate_hz, len(log.position_rad)
    # four rows at least: the derivatives reach two rows to either side
    edge = max(4, round(rate / cutoff_hz))
    if n < 10 * edge or not (np.isfinite(log.position_rad).all() and np.isfinite(log.torque_nm).all()):
        return None
    position, torque = smooth(np.stack([log.position_rad, log.torque_nm]), rate, cutoff_hz)
    # of five points, as the balance has them: of three what is left near turns is a tenth more at 50 Hz
    # never a recorded velocity: path and velocity must turn back in the same row
    velocity, acceleration = derivatives(position, 1 / rate)
    # A joint that stands may hold any torque below break-away: it says nothing of a turn.
    travel = np.abs(np.diff(position, prepend=position[0]))
    # over a period of the cut-off, as what the filter blurs is
    window = np.convolve(travel, np.ones(edge), mode="same")
    kept = window >= speed_min_rad_s / cutoff_hz
    # two periods: the acceleration is a derivative of a derivative of what the filter made up at an end
    kept[: 2 * edge] = kept[n - 2 * edge :] = False
    # of the filtered velocity: an encoder at rest turns back with every flicker of a count
    turned = np.flatnonzero(np.diff(np.sign(velocity)) != 0)
    if not kept.any():
        return None
    return TurningPart(
        motion=np.column_stack([acceleration, velocity]),
        torque_nm=torque,
        path_rad=log.position_rad,
        peaks=tuple(np.exp(-((velocity / v) ** 2)) for v in np.multiply(STRIBECK_RAD_S, log.radian)),
        rows=np.flatnonzero(kept)[:: max(1, edge // SAMPLES_PER_CUTOFF)],
        turned=turned[kept[turned]],
        rate_hz=rate,
        cutoff_hz=cutoff_hz,
        radian=log.radian,
    )


def shortest_length(parts: Sequence[TurningPart]) -> float:
    """The shortest presliding length that is tried, rad."""
    return SHORTEST_RAD * max((part.radian for part in parts), default=1.0)


def longest_length(parts: Sequence[TurningPart]) -> float:
    """The longest presliding length that these motions could tell, rad; 0 without a part."""
    return LONGEST_SHARE * min((float(np.ptp(part.path_rad)) for part in parts), default=0.0)


@compiled
def stop_operator(path_rad: np.ndarray, length_rad: float) -> np.ndarray:
    """Bristles over a path (n,), as a share of their length: -1..1, unbent at first."""
    found = np.zeros(len(path_rad))
    for row in range(1, len(path_rad)):
        found[row] = saturate(found[row - 1] + (path_rad[row] - path_rad[row - 1]) / length_rad)
    return found
