"""What a test pulse measured of the actuator's timing, as events: one per axis when ARMING ends."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from rtctl.control.vocabulary import State
from rtctl.host.exchange.rig_description import RigDescription
from rtctl.rig_file.measured_timing import AxisTiming, plausible

EVENT = "measured"

FRESH_TICKS = 3
"""Older samples are no samples: the device is gone, and says nothing of its period."""


class TimingWatch:
    """Follows all ticks; tells what was measured in the first one after ARMING, passed or refused."""

    def __init__(self, rig: RigDescription) -> None:
        self._rig = rig
        self._state = int(State.INIT)
        self._fresh = self._seen = 0

    def changes(self, rows: np.ndarray) -> list[tuple[int, dict[str, Any]]]:
        """Row and content of each event of these ticks."""
        ages = rows["sample_age_ticks"]
        # over the whole run: a pulse of some tens of ticks sees too few samples of a slow sensor
        self._fresh += int(np.count_nonzero(ages == 0))
        self._seen += int(np.count_nonzero(ages < FRESH_TICKS))
        before = np.concatenate((np.array([self._state]), rows["state"][:-1]))
        self._state = int(rows["state"][-1])
        ended = np.flatnonzero((before == State.ARMING) & (rows["state"] != State.ARMING))
        return [(int(i), content) for i in ended for content in self._measured(rows[i])]

    def _measured(self, row: np.void) -> list[dict[str, Any]]:
        period_s = 1.0 / self._rig.rate_hz
        found = []
        for a, axis in enumerate(self._rig.axes):
            delay = float(row["arming_delay_ticks"][a])
            # no current is measured there, so that nothing answered
            if math.isnan(delay):
                continue
            found.append({
                "axis": axis.name,
                "motion": axis.motion,
                "delay_s": delay * period_s,
                "lag_s": float(row["arming_lag_ticks"][a]) * period_s,
                "gain": float(row["arming_gain"][a]),
                "offset_nm": float(row["arming_offset_nm"][a]),
                "sample_period_s": period_s * self._seen / max(self._fresh, 1),
            })  # fmt: skip
        return found


def measured_in(row: np.void, period_s: float) -> list[dict[str, float | None]]:
    """What is known of each axis' torque: by the last test pulse, and as motion shows it; None where nothing
    is."""
    ticks = {
        "delay_s": "arming_delay_ticks",
        "lag_s": "arming_lag_ticks",
        "running_delay_s": "running_delay_ticks",
    }
    plain = {
        "gain": "arming_gain",
        "offset_nm": "arming_offset_nm",
        "running_gain": "running_gain",
        "running_offset_nm": "running_offset_nm",
    }
    found: list[dict[str, float | None]] = []
    for a in range(len(row["position_rad"])):
        one = {key: float(row[name][a]) * period_s for key, name in ticks.items()}
        one |= {key: float(row[name][a]) for key, name in plain.items()}
        known = int(row["time_ns"]) != 0  # else there is no tick yet
        found.append({key: value if known and math.isfinite(value) else None for key, value in one.items()})
    return found


def timing_of(event: Mapping[str, Any], date: str) -> AxisTiming | None:
    """The timing that an event tells; None when it is no number that can be read again."""
    names = ("delay_s", "lag_s", "gain", "offset_nm", "sample_period_s")
    timing = AxisTiming(**{name: float(event[name]) for name in names}, date=date)
    return timing if plausible(timing) else None
