"""Presliding length of a joint from a log of its motion: what friction does where the motion turns back.

Behind a turn the bristles bend the other way before they slide: friction goes from -F to F over the travel,
and how far that takes is the presliding length L. Tried is, length by length over a grid, how well

    tau = J a + b v + F_+ s_+ + F_- s_- + (the same with a Stribeck peak) + offset of the log

explains the torque, s = s_+ - s_- being the stop operator s <- clip(s + dx/L, -1, 1) over the recorded path
(docs/theory.md 5.6). Both sides pass the same zero-phase low-pass, hence a turn that the filter blurs is
blurred alike. The length that leaves least is the one. Ruled out are lengths that leave so much more that it
is no chance, one turn counted as one independent sample: left > (1 + SURE^2/turns) least, as in the test of a
nested regression (F = t^2).

LuGre's bristles approach sliding slowly, so that no stop operator is theirs. What is found is then the length
of the stop operator that takes up as much work in a turn, which is what credit and direction of the
feed-forward are about."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.friction.logs.dynamics import CUTOFF_HZ, SPEED_MIN_RAD_S, AxisLog
from rtctl.friction.logs.turns import TurningPart, longest_length, parts_of, shortest_length, stop_operator
from rtctl.friction.presliding import Presliding

# 1.26 apart: a log tells a length to .7 to 1.45 times (docs/identify.md)
PER_DECADE = 10
"""Lengths tried per decade."""

TURNS_MIN = 6
"""Fewest turns that tell a length."""

SURE = 3.0
"""Standard errors of doubt about a length: one further away is ruled out."""

EXPLAINED_MIN = 0.5
"""Least share of the torque, RMS, that must be explained for a turn to be looked at."""


def presliding_of_logs(
    logs: Sequence[AxisLog], cutoff_hz: float = CUTOFF_HZ, speed_min_rad_s: float = SPEED_MIN_RAD_S
) -> Presliding | None:
    """Presliding length over all turns of some logs, or of stretches of them.

    Returns
    -------
    Presliding or None
        `length_rad` is the length that leaves least, `spread_rad` half the way from it to the first longer
        one that is ruled out, and `ramps` the turns. Where all shorter lengths are as good, the length is the
        shortest that is told apart from a longer one: at most so long. None: too few turns, or a motion that
        tells nothing."""
    parts = parts_of(logs, cutoff_hz, speed_min_rad_s)
    # a turn is one sample, however many rows it has: its bristles bend once
    turns = sum(part.turns for part in parts)
    if turns < TURNS_MIN:
        return None
    shortest, longest = shortest_length(parts), longest_length(parts)
    # one octave of lengths would always have one that leaves least
    if longest <= 2 * shortest:
        return None
    count = 1 + round(PER_DECADE * np.log10(longest / shortest))
    lengths = np.geomspace(shortest, longest, count)
    left = _left(parts, lengths)
    if left is None:
        return None
    best = int(np.argmin(left))
    worse = left > (1 + SURE**2 / turns) * left[best]
    longer = np.flatnonzero(worse[best:])
    # no longer length is ruled out: the strokes were too short to end what bends
    if not len(longer) or best == len(lengths) - 1:
        return None
    upper = float(lengths[best + longer[0]])
    if not worse[:best].any():
        return Presliding(upper, 0.0, turns)
    return Presliding(float(lengths[best]), 0.5 * (upper - float(lengths[best])), turns)


def _left(parts: Sequence[TurningPart], lengths_rad: np.ndarray) -> np.ndarray | None:
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
    # about the zero of each stretch: an offset explains nothing of a turn
    varying = torque - offsets @ (offsets.T @ torque / offsets.sum(axis=0))
    return left if left.min() <= (1 - EXPLAINED_MIN) ** 2 * (varying @ varying) else None


def _friction(part: TurningPart, length_rad: float) -> np.ndarray:
    """Columns of friction in the kept rows: each direction, and the Stribeck peaks of both."""
    # over the path as it was recorded: the low-pass blurs where it turned, and comes behind
    bent = stop_operator(part.path_rad, length_rad)
    columns = [np.maximum(bent, 0.0), np.minimum(bent, 0.0), *(bent * peak for peak in part.peaks)]
    return part.smoothed(columns)
