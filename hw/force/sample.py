"""From a sensor's reading to the tick's force: what is fresh, what is refused, and what of it is shown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hw.force.reading import Reading
from hw.interface import LinkFault

_DEVICE = int(LinkFault.DEVICE)


class ForceSample:
    """The newest usable force (and moment) of one sensor, and the count of samples.

    Parameters
    ----------
    matrix
        Rig force = matrix . reading: unit, axes, signs and cross-talk in one, shape (3, 3).
    moments
        The same for the moment; None: the sensor's moments are not shown.

    Attributes
    ----------
    count : int
        Fresh samples so far.
    refused, repeated : int
        Readings the device did not vouch for, and readings shown before.
    status : int
        The device's own status in its newest reading; 0 when it vouches for it."""

    def __init__(
        self, matrix: Sequence[Sequence[float]], moments: Sequence[Sequence[float]] | None = None
    ) -> None:
        # plain floats, multiplied by hand: 1 us, where NumPy takes 5 for nine numbers
        self._rows = [tuple(float(x) for x in row) for row in matrix]
        self._moment_rows = None if moments is None else [tuple(float(x) for x in row) for row in moments]
        # None is equal to no counter: the first reading after `forget` is always a new one
        self._mark: int | None = None
        self._force = self._moment = (0.0, 0.0, 0.0)
        self._tick: np.ndarray | None = None
        self.count = self.refused = self.repeated = self.status = 0

    def take(self, reading: Reading) -> int:
        """Use a reading if it is a new one the device vouches for. Returns bits of `LinkFault`."""
        # a counter that stands still is no fault of the link: the sample ages, and the law judges its age
        if reading.mark == self._mark:
            self.repeated += 1
            return 0
        # before it is judged: a reading that is refused and shown again is no second refusal
        self._mark, self.status = reading.mark, reading.status
        if reading.status:
            # the force before it stays in the tick, and does not count as fresh: no step of force to the law
            self.refused += 1
            return _DEVICE
        self._force = _product(self._rows, reading.force)
        if self._moment_rows is not None:
            # with the force of the same record: lever and pull are of one instant
            self._moment = _product(self._moment_rows, reading.moment)
        self.count += 1
        return 0

    def forget(self) -> None:
        """The link starts anew: its first reading is a new one. The count goes on."""
        # `count` goes on: the law takes a sample whose count has not risen for an old one
        self._mark = None

    def show(self, tick: np.ndarray, faults: int) -> None:
        """Write force, moment, count and faults into the tick."""
        # views of the fields are made once for a tick: looking them up costs more than filling them
        if tick is not self._tick:
            self._bind(tick)
        force = self._view
        force[0], force[1], force[2] = self._force
        if self._moment_rows is not None:
            moment = self._moment_view
            moment[0], moment[1], moment[2] = self._moment
        self._sample_count[0], self._link_faults[0] = self.count, faults

    def _bind(self, tick: np.ndarray) -> None:
        row = tick.view(np.ndarray)
        self._tick = tick
        self._view: Any = memoryview(row["force_n"][0])
        if self._moment_rows is not None:
            self._moment_view: Any = memoryview(row["moment_nm"][0])
        self._sample_count = row["sample_count"].data
        self._link_faults = row["link_faults"].data


def _product(
    rows: Sequence[tuple[float, ...]], vector: tuple[float, float, float]
) -> tuple[float, float, float]:
    x, y, z = vector
    (a, b, c), (d, e, f), (g, h, i) = rows
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z
