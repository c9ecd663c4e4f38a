"""Another column of logs, filtered and thinned out as their torque is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.regressors import of_stretches, pooled


def in_place_of_torque(
    logs: Sequence[Sequence[AxisLog]],
    column: Callable[[AxisLog], np.ndarray],
    cutoff_hz: float,
    speed_min_rad_s: float,
) -> np.ndarray:
    """What `column` gives of each stretch, on the rows of the signals of the logs, (n,)."""
    # through the very path of the torque: filter, thinning and what is left out are then the same for certain
    alone = [[replace(stretch, torque_nm=column(stretch)) for stretch in stretches] for stretches in logs]
    return pooled([of_stretches(stretches, cutoff_hz, speed_min_rad_s) for stretches in alone]).torque_nm
