"""The points to measure, in the order in which they are measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from rtctl.identify.settings import Settings


@dataclass(frozen=True)
class Task:
    """One friction point: break-away (`speed_rad_s` 0) or a constant speed, in one direction."""

    number: int
    use: Literal["train", "test"]
    direction: int
    speed_rad_s: float

    @property
    def name(self) -> str:
        """Name of the task's tick file, and what a person sees."""
        what = "breakaway" if self.speed_rad_s == 0 else f"{self.speed_rad_s:.5f}"
        return f"{self.number:03d}_{self.use}_{'plus' if self.direction > 0 else 'minus'}_{what}"


def speeds(settings: Settings) -> tuple[np.ndarray, np.ndarray]:
    """Speeds for training and for test, rad/s: logarithmic, no speed in both.

    The test speeds are geometric means of neighbours among the training speeds (of every k-th pair, or of
    finer divisions when there are more test than training speeds), so they lie inside the trained range.
    """
    low, high = np.log(settings.speed_min_rad_s), np.log(settings.speed_max_rad_s)
    n = settings.train_levels
    train = np.exp(np.linspace(low, high, n))
    train[[0, -1]] = settings.speed_min_rad_s, settings.speed_max_rad_s
    gaps = n - 1
    per_gap = -(-settings.test_levels // gaps) if settings.test_levels else 1
    places = np.concatenate([gap + (np.arange(per_gap) + 1) / (per_gap + 1) for gap in range(gaps)])
    chosen = places[np.unique(np.round(np.linspace(0, len(places) - 1, settings.test_levels)).astype(int))]
    return train, np.exp(low + (high - low) * chosen / gaps)


def tasks(settings: Settings) -> list[Task]:
    """All points: break-away first, then the speeds shuffled, each in both directions one after the other.

    Shuffled, so that a drift of the friction with time does not look like a dependence on speed; to and
    fro, so that the joint stays within about one turn.
    """
    train, test = speeds(settings)
    runs: list[tuple[Literal["train", "test"], float]] = [("train", float(v)) for v in train]
    runs += [("test", float(v)) for v in test]
    order = np.random.default_rng(settings.seed).permutation(len(runs))
    todo: list[tuple[Literal["train", "test"], float]] = [("train", 0.0), *(runs[i] for i in order)]
    pairs = [(use, speed, direction) for use, speed in todo for direction in (1, -1)]
    return [Task(number, use, direction, speed) for number, (use, speed, direction) in enumerate(pairs)]
