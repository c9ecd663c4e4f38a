"""A slow turn each way: what tells the conservative part from friction, as friction alone turns its sign."""

from __future__ import annotations

import math

import numpy as np

from rtctl.friction.points import POINTS_MAX
from rtctl.identify.motion import SPARE_S, HandSeen, Motion, Steps
from rtctl.identify.place_rows import Row
from rtctl.identify.places import make_room
from rtctl.identify.points import settle
from rtctl.identify.windows import run_up_rad

_PER_RIPPLE = 16
_ROWS_LEAST = 512


def rows_per_turn(ripple_per_turn: float) -> int:
    """Places of a turn that a sweep is averaged over: 16 for each period of the ripple, 512 to as many as a file may have."""
    return min(POINTS_MAX, max(_ROWS_LEAST, math.ceil(_PER_RIPPLE * ripple_per_turn)))


def sweep(motion: Motion, speed_rad_s: float, bias_nm: float) -> Steps[list[Row]]:
    """Turn slowly through a turn, or the travel there is, each way; raises as the motions do."""
    rows: list[Row] = []
    for direction in (1, -1):
        rows += yield from _one_way(motion, direction, speed_rad_s, bias_nm)
    return rows


def _one_way(motion: Motion, direction: int, speed_rad_s: float, bias_nm: float) -> Steps[list[Row]]:
    before = run_up_rad(motion, speed_rad_s) + SPARE_S * speed_rad_s
    reach = min(motion.rig.turn_rad, motion.high_rad - motion.low_rad - before)
    pauses = 0
    while True:
        try:
            yield from make_room(motion, direction, reach + before)
            yield from settle(motion, direction * speed_rad_s)
            ticks = yield from motion.watch(min(reach, motion.room_rad(direction)) / speed_rad_s)
            yield from motion.rest()
            return averaged(motion, ticks, direction, speed_rad_s, bias_nm)
        except HandSeen:
            pauses += 1
            yield from motion.wait_for_free_rig(pauses)


def averaged(
    motion: Motion, ticks: np.ndarray, direction: int, speed_rad_s: float, bias_nm: float
) -> list[Row]:
    """Mean torque over each short way of the turn, where it has the sign of the motion."""
    rig = motion.rig
    x, torque = ticks["position_rad"][:, rig.axis], ticks["motor_torque_nm"][:, rig.axis] - bias_nm
    way = rig.turn_rad / rows_per_turn(rig.ripple_per_turn)
    cells, inverse, count = np.unique(np.floor(x / way), return_inverse=True, return_counts=True)
    place, mean = (np.bincount(inverse, one) / count for one in (x, torque))
    return [
        (direction * speed_rad_s, float(mean[k]), direction, int(count[k]), float(place[k]), way)
        for k in range(len(cells))
        if mean[k] * direction > 0
    ]
