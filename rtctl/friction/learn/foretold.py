"""Each session foretold by those before it: what held-out sessions cannot say of a friction that moves one
way.

A session that is held out of the others has neighbours on both sides. The next one has not: with wear, it
lies beyond them all (docs/theory.md 8.8)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.errors import UnidentifiableError
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


def said(found: Foretold | None, held_out_nm: float) -> str:
    """Say what the next session may be expected to err, where that is more than was held out; else
    nothing."""
    if found is None or found.rmse_nm <= held_out_nm:
        return ""
    return (
        f" Each session foretold by those before it errs {1e3 * found.rmse_nm:.3g} mN m, more than one held "
        "out among the others: expect that of the next."
    )
