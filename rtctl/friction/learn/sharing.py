"""Whether both directions share one curve (decision 0043)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.friction.learn.hold_out import TRAINS
from rtctl.friction.learn.search import Side
from rtctl.friction.learn.selection import Rung


def as_good_together(
    together: Rung, pooled: Side, apart: Rung, sides: Sequence[Side], equal_nm: float
) -> bool:
    """Whether one curve for both directions is expected to err no more than one for each, on the points that
    are held out of both (decision 0043)."""
    if together.refused:
        return False
    if together.rmse_nm <= equal_nm:
        return True
    ours, theirs = on_all_points(together, [pooled]), on_all_points(apart, sides)
    # the ends train always, and those of two directions are others than those of both together
    both = np.isfinite(ours) & np.isfinite(theirs)
    more = float(np.mean(ours[both] ** 2 - theirs[both] ** 2))
    return more + together.luck_nm2 - apart.luck_nm2 <= 0


def on_all_points(rung: Rung, sides: Sequence[Side]) -> np.ndarray:
    """Held-out errors of a rung on every point of its sides, in their order; NaN where a point always
    trains."""
    found = []
    for score, data in zip(rung.scores, sides, strict=True):
        errors = np.full(len(data.speed), np.nan)
        errors[data.fold != TRAINS] = score.errors
        found.append(errors)
    return np.concatenate(found)


def said(rung: Rung, *, shared: bool) -> str:
    """Say what one symmetric curve is worth."""
    if shared:
        return (
            f" One symmetric curve is as good ({1e3 * rung.rmse_nm:.3g} mN m), so both directions share it."
        )
    said = f"could not be learned ({rung.refused})" if rung.refused else f"errs {1e3 * rung.rmse_nm:.3g} mN m"
    # by however little: that they surely differ is another question
    return f" Each direction has its own: one symmetric curve {said}."
