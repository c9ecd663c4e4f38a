"""A slow turn each way: what tells the conservative part from friction, as friction alone turns its sign."""

from __future__ import annotations

import math

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.points import POINTS_MAX
from rtctl.identify.cogging import Cogging, cogging_of
from rtctl.identify.late_ticks import on_every_slot
from rtctl.identify.motion import HandSeen, Motion, Steps
from rtctl.identify.place_rows import Row
from rtctl.identify.places import make_room
from rtctl.identify.points import settle
from rtctl.identify.ticks import before_the_guard
from rtctl.identify.travel_guard import SPARE_S
from rtctl.identify.windows import run_up_rad

_PER_RIPPLE = 16
_ROWS_LEAST = 512
WHOLE_SHARE, TRIES = 0.8, 20
"""A turn of which less was seen is made again, so many times at most."""
SMOOTH_S = 0.02
"""The inertia is moved as the mean position over so long is."""


def rows_per_turn(ripple_per_turn: float) -> int:
    """Places of a turn that a sweep is averaged over: 16 for each period of the ripple, 512 to as many as a
    file may have."""
    return min(POINTS_MAX, max(_ROWS_LEAST, math.ceil(_PER_RIPPLE * ripple_per_turn)))


def sweep(motion: Motion, speed_rad_s: float, bias_nm: float) -> Steps[list[Row]]:
    """Turn slowly through a turn, or the travel there is, each way; raises as the motions do."""
    rows: list[Row] = []
    known, motion.cogging = motion.cogging, Cogging.none()  # it is the cogging that this measures
    for direction in (1, -1):
        ticks = yield from _one_way(motion, direction, speed_rad_s, steady=True)
        rows += averaged(motion, ticks, direction, speed_rad_s, bias_nm)
    motion.cogging = known
    return rows


def look_for_cogging(motion: Motion) -> Steps[None]:
    """Turn to and fro at the jog speed: what the motor gives at a place whichever way it turns is taken off
    from then on."""
    speed, rig, ways = motion.jog_speed_rad_s(), motion.rig, []
    for direction in (1, -1):
        ticks = yield from _one_way(motion, direction, speed, steady=False)
        x = ticks["position_rad"][:, rig.axis]
        n = max(3, round(SMOOTH_S / rig.period_s) | 1)  # odd: its middle is a tick
        smooth = np.convolve(x, np.full(n, 1.0 / n), "valid")
        # at the jog speed a joint that cogs swings, and what swings it is no torque of the place
        moves_nm = rig.inertia_kgm2 * np.gradient(np.gradient(smooth, rig.period_s), rig.period_s)
        cut = slice(n // 2, n // 2 + len(smooth))
        ways.append((x[cut], ticks["motor_torque_nm"][cut, rig.axis] - moves_nm))
    # a hundredth may be missing: of a turn that is nearly whole the ends of the table join
    whole = min(float(np.ptp(x)) for x, _ in ways) >= 0.99 * rig.turn_rad
    motion.cogging = cogging_of(ways[0], ways[1], rig.turn_rad, whole)
    motion.creeps = motion.cogging.matters
    if motion.creeps and not whole:  # what lies beyond the places that were seen has no cogging to take off
        motion.low_rad, motion.high_rad = (float(motion.cogging.place_rad[k]) for k in (0, -1))
    yield from motion.rest()


def _one_way(motion: Motion, direction: int, speed_rad_s: float, *, steady: bool) -> Steps[np.ndarray]:
    before = run_up_rad(motion, speed_rad_s) + SPARE_S * speed_rad_s
    reach = min(motion.rig.turn_rad, motion.high_rad - motion.low_rad - before)
    pauses = tries = 0
    while True:
        tries += 1
        try:
            yield from make_room(motion, direction, reach + before)
            if steady:
                yield from settle(motion, direction * speed_rad_s)
            else:  # a joint that cogs has no steady torque to wait for, and a short travel no room to wait in
                lead_rad = run_up_rad(motion, speed_rad_s) - motion.stopping_rad(speed_rad_s)
                yield from motion.advance(direction * lead_rad, speed_rad_s)
            count = round(min(reach, motion.room_rad(direction)) / speed_rad_s / motion.rig.period_s)
            ticks = yield from motion.watch(count * motion.rig.period_s)
            yield from motion.rest()
            # what a late host let run on, or into the guard, is no turn at this speed
            ticks = before_the_guard(ticks[: max(count, 0)], motion.rig.axis)
            ticks = on_every_slot(ticks, motion.rig.axis)
            if len(ticks) * motion.rig.period_s * speed_rad_s > WHOLE_SHARE * reach:
                return ticks
            if tries == TRIES:
                raise DataError(
                    f"{TRIES} turns at {speed_rad_s:.3g} rad/s ran out of the travel: this program was late "
                    "each time; leave more of the machine to it, or run it elsewhere"
                )
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
