"""Rows on which friction is that of sliding: low-passed motion and torque, long enough after a reversal.

Both sides of the balance pass the same low-pass of 15 Hz, a bell whose derivatives give velocity and
acceleration. A row counts where the motion keeps its direction over the whole bell, is neither slower nor
faster than what is watched, and has gone `PRESLIDING_LENGTHS` since the last reversal: before that the
bristles are still on their way. LuGre's approach sliding as 1 - 2 exp(-x/L): .005 are left after 6 L; the
last element of Maxwell-slip slides after less than 4."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rtctl.friction.drift_bins import Bins

# gears of 20 Hz and more swing above it (decision 0071); 200 bins a second have 13 to its period
CUTOFF_HZ = 15.0
PRESLIDING_LENGTHS = 6.0
BELL_SIGMAS = 4.0


@dataclass(frozen=True)
class Rows:
    """Rows of one axis, in order of time, shape (n,) each: rad, rad/s, rad/s^2, N m, share by which the place
    is trusted, and the number of the stroke they belong to."""

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    torque: np.ndarray
    trust: np.ndarray
    stroke: np.ndarray


def bell(rate_hz: float) -> np.ndarray:
    """Low-pass, first and second derivative as columns, shape (2 h + 1, 3), for samples in the order of
    time."""
    sigma_s = math.sqrt(math.log(2.0)) / (2.0 * math.pi * CUTOFF_HZ)  # -3 dB at the cut-off
    # at four sigmas a bell is 3e-4 of its height
    half = max(2, math.ceil(BELL_SIGMAS * sigma_s * rate_hz))
    t = np.arange(-half, half + 1) / rate_hz
    g = np.exp(-0.5 * (t / sigma_s) ** 2)
    first, second = t * g, (t**2 / sigma_s**2 - 1.0) * g
    second -= g * (second.sum() / g.sum())  # 0 of a constant: the bell is cut off
    # each is exact of what it is for: a constant, a straight line, a parabola
    return np.column_stack([g / g.sum(), first / (first @ t), second / (0.5 * (second @ t**2))])


class Sliding:
    """Finds the rows of one axis in bins that come in batches.

    Parameters
    ----------
    rate_hz
        Bins a second.
    settle_rad
        Travel after a reversal from which rows count.
    slowest_rad_s, fastest_rad_s
        Speeds that are watched.

    Attributes
    ----------
    moved : int
        Rows of such speeds so far, whether they slide or not."""

    def __init__(self, rate_hz: float, settle_rad: float, slowest_rad_s: float, fastest_rad_s: float) -> None:
        self._kernel = bell(rate_hz)
        self._half = len(self._kernel) // 2
        self._settle, self._slowest, self._fastest = settle_rad, slowest_rad_s, fastest_rad_s
        self._stroke = 0
        self.moved = 0
        self._restart()

    def _restart(self) -> None:
        self._next = -1
        self._bins = np.zeros((3, 0))
        self._filtered = np.zeros((0, 7))
        self._from = math.nan  # a joint that stands after a gap has no travel yet
        self._sign = 0.0
        self._stroke += 1

    def __call__(self, bins: Bins, axis: int) -> Rows:
        """Rows that the bins so far decide; those of the last tenth of a second come with the next call."""
        found = []
        cuts = np.flatnonzero(np.diff(bins.number) != 1) + 1
        for part in np.split(np.arange(len(bins.number)), cuts):
            if len(part) == 0:
                continue
            # over a gap nobody knows whether the joint turned: travel and stroke begin anew
            if bins.number[part[0]] != self._next:
                self._restart()
            self._next = int(bins.number[part[-1]]) + 1
            columns = (bins.position_rad, bins.torque_nm, bins.trust)
            found.append(self._stretch(np.stack([column[part, axis] for column in columns])))
        if not found:
            none = np.zeros(0)
            return Rows(none, none, none, none, none, np.zeros(0, int))
        return Rows(*(np.concatenate(parts) for parts in zip(*found, strict=True)))

    def _stretch(self, bins: np.ndarray) -> tuple[np.ndarray, ...]:
        """Rows of bins (3, n) that follow those before without a gap."""
        self._bins = np.concatenate([self._bins, bins], axis=1)
        x, tau, trust = self._bins
        width = 2 * self._half + 1
        if len(x) >= width:
            # x[0]: far from 0 the second derivative would be rounding
            windows = np.lib.stride_tricks.sliding_window_view(np.stack([x - x[0], tau]), width, axis=1)
            position, velocity, acceleration = (windows[0] @ self._kernel).T
            torque = windows[1] @ self._kernel[:, 0]
            trust = trust[self._half : len(x) - self._half]
            fresh = self._strokes(np.column_stack([position + x[0], velocity, acceleration, torque, trust]))
            speed = np.abs(fresh[:, 1])
            self.moved += int(((speed >= self._slowest) & (speed <= self._fastest)).sum())
            self._filtered = np.concatenate([self._filtered, fresh])
            self._bins = self._bins[:, 1 - width :]
        return self._decided(width)

    def _strokes(self, signals: np.ndarray) -> np.ndarray:
        """Position, velocity, acceleration, torque, trust, travel since the reversal, stroke, (n, 7); a
        reversal is a velocity that changes sign."""
        x, v = signals[:, 0], signals[:, 1]
        sign = np.sign(v)
        # a speed of exactly 0 is a sign of its own: a joint that rests begins a stroke when it goes on
        turns = sign != np.concatenate([[self._sign], sign[:-1]])
        # numbers go on over calls: rows of one stroke may come in two of them
        numbers = self._stroke + np.cumsum(turns)
        starts = np.concatenate([[self._from], x[turns]])
        travel = np.abs(x - starts[numbers - self._stroke])
        self._sign, self._stroke, self._from = float(sign[-1]), int(numbers[-1]), float(starts[-1])
        return np.column_stack([signals, travel, numbers])

    def _decided(self, width: int) -> tuple[np.ndarray, ...]:
        """Rows whose whole bell is known; the others stay."""
        signals = self._filtered
        if len(signals) < width:
            return *np.zeros((5, 0)), np.zeros(0, int)
        speed = np.abs(signals[:, 1])
        good = (speed >= self._slowest) & (speed <= self._fastest)
        # a run of one direction, fast enough, as long as the bell
        # sums of signs over a bell are its length only where all of it goes one way, and none is too slow
        ways = np.cumsum(np.concatenate([[0.0], np.where(good, np.sign(signals[:, 1]), 0.0)]))
        same = ways[width:] - ways[:-width]
        middle = signals[self._half : len(signals) - self._half]
        kept = middle[(np.abs(same) == width) & (middle[:, 5] >= self._settle)]
        # what the next rows need before them
        self._filtered = signals[1 - width :]
        return *kept[:, :5].T, kept[:, 6].astype(int)
