"""Ticks thinned out to some 200 a second: means of whole bins, so that noise is averaged and nothing
aliases."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# 13 bins to a period of the watch's low-pass (`drift_sliding.CUTOFF_HZ`)
RATE_HZ = 200.0
"""Bins a second, or the loop's rate where that is lower."""


@dataclass(frozen=True)
class Bins:
    """Whole bins. `number` (n,) counts on the grid of time, a step of 1 where nothing is missing; the others
    are (n, axes)."""

    number: np.ndarray
    position_rad: np.ndarray
    torque_nm: np.ndarray
    trust: np.ndarray


class Binning:
    """Makes bins of ticks that come in batches of any size.

    Parameters
    ----------
    stride
        Ticks of one bin."""

    def __init__(self, stride: int) -> None:
        self.stride = stride
        self._left: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None

    def __call__(self, ticks: np.ndarray, usable: np.ndarray, values: np.ndarray) -> Bins:
        """Bins that are complete by now.

        Parameters
        ----------
        ticks
            Numbers of the ticks, shape (n,), rising over all calls.
        usable
            Which of them say something, shape (n,). A bin with a tick that does not, or that is missing, is
            none.
        values
            Position (rad), all torques on the joint (N m), and share by which its place is trusted, shape (3,
            n, axes)."""
        if self._left is not None:
            before = self._left
            ticks, usable = np.concatenate([before[0], ticks]), np.concatenate([before[1], usable])
            values = np.concatenate([before[2], values], axis=1)
        # by the tick and not by the row: a tick that is missing leaves its bin short, and moves no other
        number = ticks // self.stride
        done = int(np.searchsorted(number, number[-1])) if len(number) else 0  # more of the last bin may come
        if len(number) and ticks[-1] % self.stride == self.stride - 1:
            done = len(number)
        # copies: views would keep the whole batch
        self._left = (ticks[done:].copy(), usable[done:].copy(), values[:, done:].copy())
        number, usable, values = number[:done], usable[:done], values[:, :done]
        if done == 0:
            return Bins(number, *values)
        starts = np.flatnonzero(np.diff(number, prepend=number[0] - 1))
        # all axes of a bin or none: they share its number, and a rig is usable as a whole
        # NaN counts as a tick that says nothing: the mean of its bin would be NaN
        whole = np.add.reduceat((usable & np.isfinite(values).all(axis=(0, 2))).astype(int), starts)
        kept = whole == self.stride
        with np.errstate(invalid="ignore", over="ignore"):  # in bins that are not kept
            means = np.add.reduceat(values, starts, axis=1)[:, kept] / self.stride
        return Bins(number[starts][kept], *means)

    def forget(self) -> None:
        """Begin anew: what comes next has nothing to do with what was."""
        self._left = None
