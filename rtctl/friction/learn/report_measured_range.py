"""Where a curve stands on points, and where it is only drawn: dashed there, and said below the figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtctl.friction.points import level_starts

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rtctl.friction.points import FrictionPoints

GAP_TIMES, GAP_SHARE = 3.0, 0.05
"""A gap in the measured speeds: so many times its neighbours, and more than this share of the range."""

GAP_RATIO = 5.0
"""A gap, too: this factor between two measured speeds."""


def unmeasured(speed: np.ndarray) -> list[tuple[float, float]]:
    """Spans (rad/s) of 0 to the highest speed in which no point lies, rising; `speed` of one direction, >= 0,
    shape (n,)."""
    levels = level_starts(speed)
    spans = [(0.0, float(levels[0]))] if levels[0] > 0 else []
    gaps = np.diff(levels)
    for at, gap in enumerate(gaps):
        # the larger neighbour: speeds by ratio have gaps that grow, none of which is a hole
        beside = max(gaps[max(0, at - 1)] if at else 0.0, gaps[at + 1] if at + 1 < len(gaps) else 0.0)
        wide = gap > GAP_TIMES * beside and gap > GAP_SHARE * levels[-1]
        if wide or (levels[at] > 0 and levels[at + 1] > GAP_RATIO * levels[at]):
            spans.append((float(levels[at]), float(levels[at + 1])))
    return spans


def said(points: FrictionPoints) -> str:
    """The spans of both directions in words; empty where every speed was measured."""
    parts = []
    for direction in (1, -1):
        spans = unmeasured(points.branch(direction)[0])
        # the unit behind each: `words` makes mm/s of a slow span of a linear axis, and not of its neighbour
        words = ", ".join(
            f"{low:.3g} to {high:.3g} rad/s" if low else f"below {high:.3g} rad/s" for low, high in spans
        )
        parts += [f"{words} (direction {direction:+d})"] if words else []
    return f" Dashed, because nothing was measured there: {'; '.join(parts)}." if parts else ""


def draw(
    plot: Axes,
    v: np.ndarray,
    curve: np.ndarray,
    speed: np.ndarray,
    *,
    label: str | None,
    linewidth: float | None = None,
) -> None:
    """Draw a curve over v (rad/s, its sign is the direction's), solid where points at `speed` carry it,
    dashed elsewhere."""
    dashed = np.zeros(len(v), dtype=bool)
    for low, high in unmeasured(speed):
        dashed |= (np.abs(v) >= low) & (np.abs(v) < high)
    dashed |= np.abs(v) > speed.max()
    # A dash begins at the last solid point, so that no hole is left between them.
    edge = dashed | np.append(dashed[1:], False) | np.append(False, dashed[:-1])
    plot.plot(v, np.where(dashed, np.nan, curve), color="tab:blue", linewidth=linewidth, label=label)
    if dashed.any():
        plot.plot(
            v,
            np.where(edge, curve, np.nan),
            linestyle="--",
            color="tab:blue",
            linewidth=linewidth,
            label=None,
        )
