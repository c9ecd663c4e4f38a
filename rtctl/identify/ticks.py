"""Every tick of an identification, in blocks: the columns worth keeping, as compressed arrays.

A block holds all ticks since the one before, the moves between the runs too: whoever doubts a point can
look at what the rig did, or measure it again by another rule."""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Mapping, Sequence

import numpy as np

from hw.motion import name as own_name

FIELDS = (
    "tick",
    "position_rad",
    "current_a",
    "force_n",
    "temperature_c",
    "current_command_a",
    "program_kind",
    "program_flags",
    "sample_age_ticks",
)
"""What was measured, what was sent, and under which program. Fields of the tick record, of one axis."""

_NARROW = {"program_kind": "u1", "program_flags": "u1", "sample_age_ticks": "u4"}
_FAST = 1  # of zlib: 2 % larger than the default, at a third of its time, while a rig waits


class TickBlock:
    """Ticks of one axis since the block began.

    Parameters
    ----------
    axis
        The axis whose columns are kept.
    period_ns
        Control period, ns.
    motion
        Of the axis: the position of a linear one is kept as `position_m`."""

    def __init__(self, axis: int, period_ns: int, motion: str = "rotary") -> None:
        self._axis, self._period_ns, self._motion = axis, period_ns, motion
        self._parts: list[dict[str, np.ndarray]] = []
        self._first_ns = 0

    def __call__(self, rows: np.ndarray) -> None:
        """Take ticks, in order. They are copied: a batch of full ticks is a hundred times as large."""
        if len(rows) == 0:
            return
        if not self._parts:
            self._first_ns = int(rows["time_ns"][0])
        self._parts.append({name: self._column(rows, name) for name in FIELDS})

    def _column(self, rows: np.ndarray, name: str) -> np.ndarray:
        values = rows[name]
        # the force is the rig's, in three parts
        one = values[:, self._axis] if values.ndim == 2 and name != "force_n" else values
        return one.astype(_NARROW.get(name, one.dtype))

    def take(self, measured: Sequence[tuple[int, int]] = ()) -> bytes:
        """End the block: its ticks as NPZ bytes, without pickle. What follows is the next block.

        Parameters
        ----------
        measured
            First tick number and number of ticks of each measurement kept of this block.

        Returns
        -------
        bytes
            Columns `FIELDS`; `first_time_ns` and `period_ns`, so that a tick's time is `first_time_ns + (tick
            - tick[0]) * period_ns`; `measurement_start` (row) and `measurement_rows` of each measurement."""
        parts, self._parts = self._parts, []
        columns = {name: np.concatenate([part[name] for part in parts]) for name in FIELDS if parts}
        tick = columns.get("tick", np.zeros(0, np.int64))
        first = np.array([one for one, _ in measured], np.int64)
        rows = np.array([n for _, n in measured], np.int64)
        return _npz(
            {
                **{own_name(name, self._motion): values for name, values in columns.items()},
                "first_time_ns": np.array(self._first_ns, np.int64),
                "period_ns": np.array(self._period_ns, np.int64),
                "measurement_start": np.searchsorted(tick, first),
                "measurement_rows": rows,
            }
        )


def _npz(columns: Mapping[str, np.ndarray]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=_FAST) as archive:
        for name, values in columns.items():
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, np.asarray(values), allow_pickle=False)
    return buffer.getvalue()


def mean_c(temperatures_c: np.ndarray) -> float | None:
    """Mean of what a thermometer showed, degrees C; None where there is none, which shows NaN."""
    mean = float(np.mean(temperatures_c))
    return mean if math.isfinite(mean) else None


def before_the_guard(rows: np.ndarray, axis: int) -> np.ndarray:
    """The ticks up to the first in which the joint was braked by a guard, as a late host leaves it to do."""
    # any flag: whichever guard it was, the joint is braked from there on
    ended = rows["program_flags"][:, axis] != 0
    return rows[: int(np.argmax(ended)) if ended.any() else len(rows)]
