"""Runs at one speed each: a file that becomes one friction point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hw.playback.quantum import quantum
from rtctl.errors import DataError, of_file

QUARTERS, UNSTEADY = 4, 0.5
"""Largest range of the mean velocities of the quarters of a file that is one point, share of its mean:
encoders count whole steps."""

OUTLIER_SCALES = 10.0
"""Rows of a run further from its median, robust standard deviations, are left out."""

STANDS = 0.2
"""Share of a run's rows at its largest torque above which the torque stands there."""


@dataclass(frozen=True)
class Signals:
    """Velocity (rad/s), friction torque (N m) and the other columns of the points, of one file. Arrays of one
    length."""

    velocity: np.ndarray
    torque: np.ndarray
    columns: dict[str, np.ndarray]

    def at(self, rows: np.ndarray) -> Signals:
        """Some of the rows."""
        beside = {name: column[rows] for name, column in self.columns.items()}
        return Signals(self.velocity[rows], self.torque[rows], beside)


def require_no_limit(files: Sequence[Path], parts: Sequence[Signals]) -> None:
    """Refuse runs in which the torque stands at the largest of all runs, while in most it does not stand."""
    sizes = [np.abs(part.torque) for part in parts]
    # of all runs: one alone cannot tell its limit from its largest torque
    top = max(float(size.max()) for size in sizes)
    # of a torque that is commanded and constant, or coarse, each run stands at its own largest value
    stands = [float(np.mean(size == size.max())) for size in sizes]
    if np.median(stands) > STANDS:
        return
    for file, size, share in zip(files, sizes, stands, strict=True):
        if share > STANDS and size.max() == top:
            with of_file(file):
                raise DataError(
                    f"{file}: the torque stands at {top:.4g} N m, the largest of all runs, in {share:.0%} of "
                    "its rows: clipped there (by a limit of the drive, or a converter's range), and the "
                    "friction is larger; leave the run out, or raise the limit and measure it again"
                )


def one_point(file: Path, part: Signals, notes: list[str]) -> tuple[tuple[float, ...], dict[str, float]]:
    """(velocity, friction, direction, std, count) of a run at one speed, and means of the other columns; rows
    far off are left out and told."""
    velocity, torque = part.velocity, part.torque
    # medians: the rows that are far off would widen a standard deviation to hold them
    off = np.abs(torque - np.median(torque))
    far = off > OUTLIER_SCALES * 1.4826 * max(float(np.median(off)), quantum(torque))
    if far.any():
        row = int(np.argmax(off))
        notes.append(
            f"{file}: {int(far.sum())} rows left out, the furthest row {row + 1} with {torque[row]:.4g} N m "
            f"against {np.median(torque):.4g}"
        )
    velocity, torque = velocity[~far], torque[~far]
    mean, friction = float(velocity.mean()), float(torque.mean())
    # means of quarters: a velocity row by row is the encoder's steps
    quarters = [float(part.mean()) for part in np.array_split(velocity, min(QUARTERS, len(velocity)))]
    if not np.ptp(quarters) <= UNSTEADY * abs(mean):
        raise DataError(
            f"{file}: not one speed: {min(quarters):.3g} rad/s in a quarter of it, {max(quarters):.3g} rad/s "
            "in another; cut what is not steady, or use --average speed"
        )
    if not mean:
        raise DataError(f"{file}: nothing moves: a run at rest is no point of friction; leave it out")
    # a point of help would be added to the motion by the loop
    if mean * friction <= 0:
        raise DataError(
            f"{file}: the torque, {friction:.4g} N m, has not the sign of the motion ({mean:.4g} rad/s): "
            "turn the sign of one of them (scale -1), or take its offset away"
        )
    beside = {name: float(column[~far].mean()) for name, column in part.columns.items()}
    return (mean, abs(friction), float(np.sign(mean)), float(torque.std(ddof=1)), float(len(torque))), beside
