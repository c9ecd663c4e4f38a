"""Presliding length of a joint from a log of its motion: what friction does where the motion turns back.

Behind a turn the bristles bend the other way before they slide: friction goes from -F to F over the travel, and how far
that takes is the presliding length L. Tried is, length by length over a grid, how well

    tau = J a + b v + F_+ s_+ + F_- s_- + (the same with a Stribeck peak) + offset of the log

explains the torque, s = s_+ - s_- being the stop operator s <- clip(s + dx/L, -1, 1) over the recorded path (docs/theory.md 5.6).
Both sides pass the same zero-phase low-pass, hence a turn that the filter blurs is blurred alike. The length that leaves
least is the one. Ruled out are lengths that leave so much more that it is no chance, one turn counted as one independent
sample: left > (1 + SURE^2/turns) least, as in the test of a nested regression (F = t^2).

LuGre's bristles approach sliding slowly, so that no stop operator is theirs. What is found is then the length of the stop
operator that takes up as much work in a turn, which is what credit and direction of the feed-forward are about.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.control.feedforward import saturate
from rtctl.control.jit import compiled
from rtctl.friction.logs.dynamics import CUTOFF_HZ, SAMPLES_PER_CUTOFF, SPEED_MIN_RAD_S, AxisLog, smooth
from rtctl.friction.points.presliding import Presliding

SHORTEST_RAD = 1e-5
"""Shortest length that is tried; below it a joint is one whose friction turns at once, for any hand."""

PER_DECADE = 10
"""Lengths tried per decade."""

LONGEST_SHARE = 0.2
"""Longest length that is tried, share of the range of the motion: strokes must be long enough to slide."""

TURNS_MIN = 6
"""Fewest turns that tell a length."""

SURE = 3.0
"""Standard errors of doubt about a length: one further away is ruled out."""

STRIBECK_RAD_S = (0.02, 0.1)
"""Speeds of the Stribeck peaks beside the Coulomb friction: without them a peak at rest looks like shorter bristles."""

EXPLAINED_MIN = 0.5
"""Least share of the torque, RMS, that must be explained for a turn to be looked at."""


@dataclass(frozen=True)
class _Part:
    """Filtered signals of one stretch, its Stribeck peaks (1 at rest), the path of its bristles, and the rows looked at."""

    motion: np.ndarray
    torque_nm: np.ndarray
    path_rad: np.ndarray
    peaks: tuple[np.ndarray, ...]
    rows: np.ndarray
    turns: int
    rate_hz: float
    cutoff_hz: float


def presliding_of_logs(
    logs: Sequence[AxisLog], cutoff_hz: float = CUTOFF_HZ, speed_min_rad_s: float = SPEED_MIN_RAD_S
) -> Presliding | None:
    """Presliding length over all turns of some logs, or of stretches of them.

    Returns
    -------
    Presliding or None
        `length_rad` is the length that leaves least, `spread_rad` half the way from it to the first longer one that is ruled out, and
        `ramps` the turns. Where all shorter lengths are as good, the length is the shortest that is told apart from
        a longer one: at most so long. None: too few turns, or a motion that tells nothing.
    """
    parts = [part for log in logs if (part := _part(log, cutoff_hz, speed_min_rad_s)) is not None]
    turns = sum(part.turns for part in parts)
    if turns < TURNS_MIN:
        return None
    longest = LONGEST_SHARE * min(float(np.ptp(part.path_rad)) for part in parts)
    if longest <= 2 * SHORTEST_RAD:
        return None
    count = 1 + round(PER_DECADE * np.log10(longest / SHORTEST_RAD))
    lengths = np.geomspace(SHORTEST_RAD, longest, count)
    left = _left(parts, lengths)
    if left is None:
        return None
    best = int(np.argmin(left))
    worse = left > (1 + SURE**2 / turns) * left[best]
    longer = np.flatnonzero(worse[best:])
    if not len(longer) or best == len(lengths) - 1:
        return None
    upper = float(lengths[best + longer[0]])
    if not worse[:best].any():
        return Presliding(upper, 0.0, turns)
    return Presliding(float(lengths[best]), 0.5 * (upper - float(lengths[best])), turns)


def _part(log: AxisLog, cutoff_hz: float, speed_min_rad_s: float) -> _Part | None:
    """One stretch made ready; None when it is too short or not finite."""
    rate, n = log.rate_hz, len(log.position_rad)
    edge = max(4, round(rate / cutoff_hz))
    if n < 10 * edge or not (np.isfinite(log.position_rad).all() and np.isfinite(log.torque_nm).all()):
        return None
    position = smooth(log.position_rad, rate, cutoff_hz)
    velocity = np.gradient(position, 1 / rate)
    acceleration = np.gradient(velocity, 1 / rate)
    # A joint that stands may hold any torque below break-away: it says nothing of a turn.
    travel = np.abs(np.diff(position, prepend=position[0]))
    window = np.convolve(travel, np.ones(edge), mode="same")
    kept = window >= speed_min_rad_s / cutoff_hz
    kept[: 2 * edge] = kept[n - 2 * edge :] = False
    turned = np.flatnonzero(np.diff(np.sign(velocity)) != 0)
    if not kept.any():
        return None
    return _Part(
        motion=np.column_stack([acceleration, velocity]),
        torque_nm=smooth(log.torque_nm, rate, cutoff_hz),
        path_rad=log.position_rad,
        peaks=tuple(np.exp(-((velocity / v) ** 2)) for v in STRIBECK_RAD_S),
        rows=np.flatnonzero(kept)[:: max(1, edge // SAMPLES_PER_CUTOFF)],
        turns=int(kept[turned].sum()),
        rate_hz=rate,
        cutoff_hz=cutoff_hz,
    )


@compiled
def stop_operator(path_rad: np.ndarray, length_rad: float) -> np.ndarray:
    """Bristles over a path (n,), as a share of their length: -1..1, unbent at first."""
    found = np.zeros(len(path_rad))
    for row in range(1, len(path_rad)):
        found[row] = saturate(found[row - 1] + (path_rad[row] - path_rad[row - 1]) / length_rad)
    return found


def _left(parts: Sequence[_Part], lengths_rad: np.ndarray) -> np.ndarray | None:
    """Sum of squared residuals by length, (m,); None where nothing explains the torque."""
    torque = np.concatenate([part.torque_nm[part.rows] for part in parts])
    offsets = np.repeat(np.eye(len(parts)), [len(part.rows) for part in parts], axis=0)
    motion = np.hstack([np.concatenate([part.motion[part.rows] for part in parts]), offsets])
    left = np.zeros(len(lengths_rad))
    for one, length in enumerate(lengths_rad):
        columns = np.hstack([motion, np.concatenate([_friction(part, length) for part in parts])])
        scale = np.sqrt((columns**2).mean(axis=0)) + np.finfo(float).tiny
        solution = np.linalg.lstsq(columns / scale, torque, rcond=1e-9)[0]
        residual = torque - columns / scale @ solution
        left[one] = residual @ residual
    varying = torque - offsets @ (offsets.T @ torque / offsets.sum(axis=0))
    return left if left.min() <= (1 - EXPLAINED_MIN) ** 2 * (varying @ varying) else None


def _friction(part: _Part, length_rad: float) -> np.ndarray:
    """Columns of friction in the kept rows: each direction, and the Stribeck peaks of both."""
    bent = stop_operator(part.path_rad, length_rad)
    columns = [np.maximum(bent, 0.0), np.minimum(bent, 0.0), *(bent * peak for peak in part.peaks)]
    return np.column_stack([smooth(each, part.rate_hz, part.cutoff_hz)[part.rows] for each in columns])
