"""Ticks as messages: decimated state samples, and full-rate columns. Pure functions of the rows."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rtctl.host.exchange.rig_description import RigDescription
from rtctl.tick import FIELDS, single_words

STATE_FIELDS = tuple(field.name for field in FIELDS if field.name != "seal")
"""Tick fields of a state sample. The seal guards shared memory and says nothing to a client."""


class Decimator:
    """Picks the first tick of every `stride` slots of the time grid, also where ticks were missed."""

    def __init__(self, rate_hz: float, state_hz: float) -> None:
        self._stride = max(1, round(rate_hz / state_hz))
        # before every slot: the first tick is shown
        self._slot = -1

    def pick(self, ticks: np.ndarray) -> np.ndarray:
        """Indices of the ticks to show. `ticks` are tick numbers, shape (n,), in order over all calls."""
        if len(ticks) == 0:
            return np.zeros(0, np.intp)
        # by the grid, not by counting: after missed ticks samples lie on the same slots as before
        slots = ticks // self._stride
        before = np.concatenate(([self._slot], slots[:-1]))
        self._slot = int(slots[-1])
        return np.flatnonzero(slots != before)


def state_samples(
    rows: np.ndarray, rig: RigDescription, first_sequence: int, now_ns: int
) -> list[dict[str, Any]]:
    """One map per row for the topic `rtctl/state`.

    Every number is a float, also counts and flags: PlotJuggler fixes a series' type by its first value.

    Parameters
    ----------
    rows
        Ticks, shape (n,).
    rig
        For time stamps and session.
    first_sequence
        Number of the first sample.
    now_ns
        CLOCK_MONOTONIC now, ns."""
    loop_ns = rows["time_ns"]
    age_s = np.full(len(rows), math.nan) if rig.virtual else (now_ns - loop_ns) * 1e-9
    heads = zip(
        ((loop_ns + rig.start_wall_ns) * 1e-9).tolist(),
        (loop_ns * 1e-9).tolist(),
        age_s.tolist(),
        strict=True,
    )
    columns = [rows[name].astype(np.float64).tolist() for name in STATE_FIELDS]
    return [
        {
            "timestamp": timestamp,
            "monotonic_s": monotonic_s,
            "sent_monotonic_s": now_ns * 1e-9,
            "age_s": age,
            "session": float(rig.session),
            "sequence": float(first_sequence + i),
            **dict(zip(STATE_FIELDS, values, strict=True)),
        }
        for i, ((timestamp, monotonic_s, age), values) in enumerate(
            zip(heads, zip(*columns, strict=True), strict=True)
        )
    ]


def tick_columns(rows: np.ndarray) -> dict[str, dict[str, Any]]:
    """Columns of the topic `rtctl/ticks`: name -> {dtype, shape, data}, little endian, C order."""
    words, n = single_words(rows.dtype), len(rows)
    # all columns of a word one behind the other: copied at once
    flat = (
        np.ascontiguousarray(rows).view((np.uint64, rows.dtype.itemsize // 8)).T.tobytes() if words else b""
    )
    columns = {}
    for name in rows.dtype.names or ():
        if word := words.get(name):
            data = flat[8 * n * word.place : 8 * n * (word.place + 1)]
            columns[name] = {"dtype": word.dtype, "shape": [n, *word.shape], "data": data}
        else:
            column = rows[name]
            columns[name] = {"dtype": column.dtype.str, "shape": list(column.shape), "data": column.tobytes()}
    return columns
