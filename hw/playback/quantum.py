"""The step of a column: that of an encoder, a converter or a lost digit."""

from __future__ import annotations

import numpy as np

SAME = 1e-9
"""Values nearer than this share of the range are the same, but for rounding in their units."""


def quantum(signal: np.ndarray) -> float:
    """Least step between two values of a signal; tiny where it is not coarse."""
    levels = np.unique(signal)
    if len(levels) < 2:
        return 0.0
    steps = np.diff(levels)
    return float(np.quantile(steps[steps > SAME * (levels[-1] - levels[0])], 0.02))
