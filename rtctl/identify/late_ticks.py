"""Ticks that came late or not at all: what was measured beside them is measured again, and told."""

from __future__ import annotations

import numpy as np

LATE_SHARE = 0.01
"""Most ticks of a stretch that may be late: as many as the law takes before a loop with a motor stops
(OVERRUN). In a mean, what the joint did meanwhile weighs no more than a steady torque may change."""


def left_out(rows: np.ndarray) -> int:
    """Slots of the grid between the first and the last of these consecutive ticks in which the loop did not
    run."""
    ticks = rows["tick"]
    return int(ticks[-1] - ticks[0]) + 1 - len(np.unique(ticks)) if len(ticks) else 0


def begun_late(rows: np.ndarray, period_s: float) -> int:
    """How many of these ticks began so late that the next slot was nearer."""
    return int(np.count_nonzero(rows["wakeup_ns"] > 0.5e9 * period_s))


def late_ticks(rows: np.ndarray, before: np.void | None, period_s: float) -> int:
    """How many ticks were left out, or begun late, from the tick `before` (None: none) to the last of these,
    by the loop's own count: of ticks that belong to an earlier order nothing is handed on."""
    missed = 0 if before is None else int(rows["missed_ticks"][-1]) - int(before["missed_ticks"])
    return max(missed, 0) + begun_late(rows, period_s)


def ran_late(rows: np.ndarray, period_s: float) -> bool:
    """Whether more than `LATE_SHARE` of these consecutive ticks was left out, or began late."""
    slots = int(rows["tick"][-1] - rows["tick"][0]) + 1
    return left_out(rows) + begun_late(rows, period_s) > LATE_SHARE * slots


def on_every_slot(rows: np.ndarray, axis: int) -> np.ndarray:
    """These consecutive ticks with one for each slot: positions between the samples on a line, all else as
    the next tick shows it, for the torque sent was held until then.

    By rows the time of a slot left out would be none, and a joint that went on through it would have jumped:
    a loop that lost one tick of twenty saw cogging of a fifth of the friction that was none, and break-away
    28 % too low."""
    if left_out(rows) == 0:
        return rows
    slots = np.arange(int(rows["tick"][0]), int(rows["tick"][-1]) + 1)
    whole: np.ndarray = rows[np.searchsorted(rows["tick"], slots)].copy()
    whole["position_rad"][:, axis] = np.interp(slots, rows["tick"], rows["position_rad"][:, axis])
    return whole
