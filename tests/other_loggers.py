"""What writes down the motion of `other_rigs`: a clock of its own, a drive's filters and words, an encoder's
counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from other_rigs import STEP_S, Rig, first_order, run


@dataclass(frozen=True)
class Logger:
    """What writes the log: its clock, its filters and its words."""

    rate_hz: float = 1000.0
    jitter: float = 0.0
    """Of when a row is taken, share of a period."""
    stamp_s: float = 1e-6
    """Resolution of the stamps."""
    counts: float = 65536.0
    current_step: float = 1e-3
    current_noise: float = 5e-3
    current_filter_hz: float = 0.0
    """Of the drive, first order; 0: none."""
    current_late_s: float = 0.0
    hand_noise: float = 5e-3
    hand_bias: float = 0.0
    on_link: bool = False
    """The encoder sits behind the shaft."""
    seed: int = 1


@dataclass(frozen=True)
class Log:
    """Columns as the logger has them, SI: stamps, angle, speed as the drive estimates it, current, hand's
    torque.
    """

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    current: np.ndarray
    hand: np.ndarray
    kt: float
    truth: dict[str, float]

    @property
    def torque(self) -> np.ndarray:
        return self.kt * self.current


@cache
def log_of(rig: Rig, logger: Logger) -> Log:
    """A log of the rig."""
    whole, rng = run(rig), np.random.default_rng(logger.seed)
    n = int(whole.time[-1] * logger.rate_hz) - 2
    at = np.arange(1, n) / logger.rate_hz
    at = at + rng.uniform(0, logger.jitter, len(at)) / logger.rate_hz
    current = whole.current
    if logger.current_filter_hz:
        current = first_order(current, 1 - math.exp(-2 * math.pi * logger.current_filter_hz * STEP_S))
    quantum = 2 * math.pi / logger.counts
    place = whole.link if logger.on_link and rig.link else whole.position
    counts = np.floor(np.interp(at, whole.time, place) / quantum)
    amperes = np.interp(at - logger.current_late_s, whole.time, current) + rng.normal(
        0, logger.current_noise, len(at)
    )
    hand = (
        np.interp(at, whole.time, whole.hand) + logger.hand_bias + rng.normal(0, logger.hand_noise, len(at))
    )
    velocity = first_order(np.interp(at, whole.time, whole.velocity), 0.5)
    return Log(
        np.round(at / logger.stamp_s) * logger.stamp_s,
        counts * quantum,
        velocity,
        np.round(amperes / logger.current_step) * logger.current_step,
        hand,
        rig.kt,
        whole.truth,
    )
