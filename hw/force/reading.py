"""What every force sensor's codec makes of a frame."""

from __future__ import annotations

from typing import NamedTuple


class Reading(NamedTuple):
    """One sample.

    Attributes
    ----------
    mark
        A number that differs from one sample to the next: the device's counter or time stamp.
    status
        The device's own status, 0 when it vouches for the sample.
    force, moment
        In the device's unit: N and N m, or counts. Sensors of forces only have moments of 0."""

    mark: int
    status: int
    force: tuple[float, float, float]
    moment: tuple[float, float, float] = (0.0, 0.0, 0.0)
