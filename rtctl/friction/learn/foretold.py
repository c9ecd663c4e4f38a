"""Each session foretold by those before it: what held-out sessions cannot say of a friction that moves one
way.

A session that is held out of the others has neighbours on both sides. The next one has not: with wear, it
lies beyond them all (docs/theory.md 8.8)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.errors import UnidentifiableError
from rtctl.friction.learn import certainty
from rtctl.friction.learn.grids import in_scale_of
from rtctl.friction.learn.machines import Candidate, FailedFitError, train
from rtctl.friction.learn.search import Side

SESSIONS_MIN = 4
"""Fewest sessions of which anything is foretold: the later half of them are judged, each from two or more
before it."""


@dataclass(frozen=True)
class Foretold:
    """Errors (N m) of sessions at their speeds (rad/s), each learned from those before it alone, and the
    session of each, (n,)."""

    speed: np.ndarray
    error_nm: np.ndarray
    block: np.ndarray

    @property
    def rmse_nm(self) -> float:
        """Root mean square of the errors, N m."""
        return float(np.sqrt(np.mean(self.error_nm**2)))


def foretold(candidates: Sequence[tuple[Candidate, Side]]) -> Foretold | None:
    """Errors of each session of the later half; None of too few sessions, where sessions are not held out, or
    where a fit fails.

    Sessions come in the order of their numbers. The earlier half foretell from little, and not far. What is
    faster than all before was never in question, and is not judged."""
    parts = []
    for one, data in candidates:
        sessions = np.unique(data.session) if data.session is not None else np.zeros(0)
        if len(sessions) < SESSIONS_MIN:
            return None
        # one session alone foretells itself moved: from two on a mean is known
        for at in sessions[len(sessions) // 2 :]:
            kept = data.session < at
            # kernels go anywhere beyond their points: no model is used there, hence none is blamed
            held = (data.session == at) & (data.speed <= data.speed[kept].max())
            # C and tube in the scale of what was known then: those of later sessions are not known beforehand
            scaled = in_scale_of(one, data.speed, data.friction_nm, kept, data.session)
            try:
                trained = train(scaled, data.speed[kept], data.learned_nm(kept), data.weight[kept])
            except (FailedFitError, UnidentifiableError):  # of few points, a formula has more numbers
                return None
            if not trained.converged:  # where a solver stopped is no curve of its machine
                return None
            speed = data.speed[held]
            parts.append((speed, trained.curve(speed) - data.friction_nm[held], np.full(len(speed), at)))
    speed, error_nm, block = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Foretold(speed, error_nm, block) if len(speed) else None


SHARE = 0.8
"""Share of next sessions that `next_nm` is for: eight of ten."""

# learned from one of three sessions of either lever of docs/evidence.md: .02 to .24 (decision 0174)
APART = 0.25
"""Most that a recorded session erred beside one other session alone, as a share of the friction's RMS."""


def next_nm(held: Foretold, directions: np.ndarray, ahead: Foretold | None) -> tuple[float, float]:
    """Between what the RMS error of the next session lies in `SHARE` of all cases, N m: by sessions held out,
    each error in its direction (+1 or -1); where `ahead` errs more, as many times larger, as the band is."""
    low, high = certainty.next_session(held.error_nm, held.block, directions, SHARE)
    # the band's factor: both are to say the same of a friction that wears
    times = 1.0 if ahead is None or held.rmse_nm <= 0 else max(1.0, ahead.rmse_nm / held.rmse_nm)
    return times * low, times * high


def next_of_one_nm(held_out_nm: float, friction_nm: np.ndarray) -> tuple[float, float]:
    """Between what the next session may err where one session is known, N m: what was held out of it, with
    what its levels differ by between stretches where they know it, and what that is if `APART` of the
    friction differs."""
    return held_out_nm, math.hypot(held_out_nm, APART * float(np.sqrt(np.mean(friction_nm**2))))


def said(found: Foretold | None, held_out_nm: float) -> str:
    """Say what the next session may be expected to err, where that is more than was held out; else
    nothing."""
    if found is None or found.rmse_nm <= held_out_nm:
        return ""
    return (
        f" Each session foretold by those before it errs {1e3 * found.rmse_nm:.3g} mN m, more than one held "
        "out among the others: expect that of the next."
    )


def said_of_next(next_nm: tuple[float, float], sessions: int, held_out_nm: float) -> str:
    """Say between what the next session errs, by how many sessions are known."""
    low, high = (f"{1e3 * one:.2g}" for one in next_nm)
    if sessions == 1:
        by = "by as much as stretches of this one do" if next_nm[0] > held_out_nm else "by nothing"
        return (
            f" One session does not know what the next differs by: that errs {low} mN m if {by}, and {high} "
            f"if by {100 * APART:.0f} % of the friction, as sessions of a recorded lever did."
        )
    return (
        f" Of the next session expect {low} to {high} mN m, eight times of ten: that is what {sessions} "
        "sessions know."
    )
