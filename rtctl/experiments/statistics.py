"""Mean over seeds with its confidence interval."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Estimate:
    """Mean of `count` runs and half the width of its 95 % confidence interval; same unit as the runs.

    `half` is 0 for a single run, of which nothing is known."""

    mean: float
    half: float
    count: int

    @property
    def low(self) -> float:
        """Lower end of the interval."""
        return self.mean - self.half

    @property
    def high(self) -> float:
        """Upper end of the interval."""
        return self.mean + self.half

    def text(self, scale: float = 1.0, shape: str = ".3g") -> str:
        """As `mean ± half` in another unit."""
        mean, half = scale * self.mean, scale * self.half
        # four digits of a thousand are whole: 1.23e+03 ± 40 would be read as two figures
        said = format(mean, ".0f" if shape.endswith("g") and 1e3 <= abs(mean) < 1e6 else shape)
        return f"{said} ± {format(half, '.0f' if half >= 9.5 else '.1g')}" if self.count > 1 else said

    def as_dict(self) -> dict[str, float | int | None]:
        """Plain values for JSON; null where a value is not finite."""
        mean, half = (x if np.isfinite(x) else None for x in (self.mean, self.half))
        return {"mean": mean, "ci95_half": half, "count": self.count}


def estimate(values: Sequence[float] | np.ndarray) -> Estimate:
    """Mean and 95 % confidence interval of independent runs, by Student's t.

    Raises
    ------
    ValueError
        Without a value."""
    x = np.asarray(values, dtype=float)
    if x.size == 0:
        raise ValueError("no runs to average")
    if x.size == 1:
        # no interval of one run: `text` and the verdicts say so by its count
        return Estimate(float(x[0]), 0.0, 1)
    from scipy.stats import t

    # Student's: with ten seeds the normal interval would be 13 % too narrow
    half = float(t.ppf(0.975, x.size - 1) * x.std(ddof=1) / np.sqrt(x.size))
    return Estimate(float(x.mean()), half, int(x.size))


def rms(values: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def reduction(without: np.ndarray, with_it: np.ndarray) -> Estimate:
    """How much smaller the second is than the first, 0 to 1, run by run: both had the same seed."""
    # the mean of ratios and not the ratio of means: each seed has a hand of its own, and counts once
    return estimate(1.0 - np.asarray(with_it, dtype=float) / np.asarray(without, dtype=float))
