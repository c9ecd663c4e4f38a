"""The points to measure, in the order in which they are measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rtctl.identify.settings import Settings

BEND_SHARE = 0.03
"""A fall of friction by this much between the lowest speed and twice of it is the flank of a peak."""

FIVE_DIGITS_FROM = 2e-4
"""Speed down to which five digits tell two tasks apart."""


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
        digits = 5 if self.speed_rad_s > FIVE_DIGITS_FROM else 7  # a slow carriage in m/s
        what = "breakaway" if self.speed_rad_s == 0 else f"{self.speed_rad_s:.{digits}f}"
        return f"{self.number:03d}_{self.use}_{'plus' if self.direction > 0 else 'minus'}_{what}"


@dataclass(frozen=True)
class Known:
    """A point that was measured already; torque as a magnitude."""

    direction: int
    speed_rad_s: float
    friction_nm: float
    presliding_rad: float | None = None


def speeds(settings: Settings) -> tuple[np.ndarray, np.ndarray]:
    """Speeds for training and for test, rad/s: logarithmic, no speed in both.

    The test speeds are geometric means of neighbours among the training speeds (of every k-th pair, or of
    finer divisions when there are more test than training speeds), so they lie inside the trained range."""
    low, high = np.log(settings.speed_min_rad_s), np.log(settings.speed_max_rad_s)
    n = settings.train_levels
    train = np.exp(np.linspace(low, high, n))
    # exp(log) rounds: the fastest must not be above the limit by a digit
    train[[0, -1]] = settings.speed_min_rad_s, settings.speed_max_rad_s
    gaps = n - 1
    # rounded up
    per_gap = -(-settings.test_levels // gaps) if settings.test_levels else 1
    # between neighbours and never at one: a test point at a training speed would test nothing
    places = np.concatenate([gap + (np.arange(per_gap) + 1) / (per_gap + 1) for gap in range(gaps)])
    chosen = places[np.unique(np.round(np.linspace(0, len(places) - 1, settings.test_levels)).astype(int))]
    return train, np.exp(low + (high - low) * chosen / gaps)


def tasks(settings: Settings) -> list[Task]:
    """All points: break-away first, then the speeds shuffled, each in both directions one after the other.

    Shuffled, so that a drift of the friction with time does not look like a dependence on speed; to and
    fro, so that the joint stays within about one turn."""
    train, test = speeds(settings)
    runs: list[tuple[Literal["train", "test"], float]] = [("train", float(v)) for v in train]
    runs += [("test", float(v)) for v in test]
    # by the seed of the settings: a resumed identification goes on in the same order
    order = np.random.default_rng(settings.seed).permutation(len(runs))
    todo: list[tuple[Literal["train", "test"], float]] = [("train", 0.0), *(runs[i] for i in order)]
    # directions next to each other: what drifts with time is alike in both
    pairs = [(use, speed, direction) for use, speed in todo for direction in (1, -1)]
    return [Task(number, use, direction, speed) for number, (use, speed, direction) in enumerate(pairs)]


def remaining(settings: Settings, is_over: Callable[[Task], bool], known: Sequence[Known]) -> list[Task]:
    """Points still to measure: those of the plan, and when they are over, lower speeds where friction still
    rises there.

    Notes
    -----
    A Stribeck peak below the lowest speed would be cut off. While friction in either direction falls by more
    than `BEND_SHARE` from the lowest speed measured to twice that speed, half of it is measured too, in both
    directions, `lower_levels` times at most."""
    planned = tasks(settings)
    if todo := [task for task in planned if not is_over(task)]:
        return todo
    for level in range(settings.lower_levels):
        lowest = settings.speed_min_rad_s / 2**level
        if not any(_still_rises(known, direction, lowest) for direction in (1, -1)):
            break
        pair = [
            Task(len(planned) + 2 * level + n, "train", direction, 0.5 * lowest)
            for n, direction in enumerate((1, -1))
        ]
        if todo := [task for task in pair if not is_over(task)]:
            return todo
    return []


def _still_rises(known: Sequence[Known], direction: int, lowest_rad_s: float) -> bool:
    """Whether friction falls markedly from this speed, which must have been measured, to twice of it."""
    moving = sorted(
        (one.speed_rad_s, one.friction_nm)
        for one in known
        # speeds are products of halves and exponentials, and equal but for rounding
        if one.direction == direction and one.speed_rad_s > (1 - 1e-9) * lowest_rad_s
    )
    if not moving or moving[0][0] > (1 + 1e-9) * lowest_rad_s or moving[-1][0] < 2 * lowest_rad_s:
        return False
    speed, friction = np.array(moving).T
    # twice, and not the next speed: that is 12 % above it by default, where friction hardly differs yet
    twice = float(np.interp(2 * lowest_rad_s, speed, friction))
    return bool(friction[0] - twice > BEND_SHARE * friction[0])
