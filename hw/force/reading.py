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
    force
        In the device's unit: N, or counts.
    """

    mark: int
    status: int
    force: tuple[float, float, float]
