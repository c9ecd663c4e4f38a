"""The step of a column: that of an encoder, a converter or a lost digit."""

from __future__ import annotations

import numpy as np

SAME = 1e-9
"""Values nearer than this share of the range are the same, but for rounding in their units."""

WHOLE = 0.02
"""Share of a step by which all are off from so many of it at most, where it is the grid's."""

MOST_PARTS = 5
"""Steps of the grid that the least one may be of."""


def quantum(signal: np.ndarray) -> float:
    """Least step between two values of a signal; tiny where it is not coarse."""
    # of all levels and not of neighbours: a fast joint skips most counts between two rows
    levels = np.unique(signal)
    if len(levels) < 2:
        return 0.0
    steps = np.diff(levels)
    # one level read through two units differs in its last digit
    steps = steps[steps > SAME * (levels[-1] - levels[0])]
    # what is whole in a step is whole in a half of it, too: the first that explains all is the largest
    for parts in range(1, MOST_PARTS + 1):  # brisk motion on few rows: hardly two are one step apart
        step = float(steps.min()) / parts
        if np.abs(steps / step - np.round(steps / step)).max() < WHOLE:
            return step
    # no grid explains all: what is nearly the least, for the very least may be a rounding
    return float(np.quantile(steps, 0.02))
