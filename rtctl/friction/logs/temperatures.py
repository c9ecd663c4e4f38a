"""How warm the motor was along a log, from a column of its own: it changes so slowly that straight lines
between rows are good enough, whatever was done to place and torque.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hw.interface import BackendError
from hw.playback.columns import read_table
from hw.playback.reader import TIME_UNITS
from hw.playback.stamps import unwrapped
from hw.playback.units import require_unit
from rtctl.errors import DataError
from rtctl.friction.logs.logs import FrictionSamples
from rtctl.friction.point_columns import COLUMNS

NAME = "temperature_c"


def with_temperature(
    samples: FrictionSamples, options: Sequence[Mapping[str, Any]], column: Mapping[str, Any]
) -> FrictionSamples:
    """The samples of several logs (validated options of the reader, in the order of their numbers) with the
    temperature of each.

    Parameters
    ----------
    column
        Option table of the column, degC, the same in all logs.

    Raises
    ------
    DataError
        No such column, cells that are no numbers, another unit, a temperature of no motor."""
    warmth = np.empty(len(samples.time_s))
    for number, each in enumerate(options):
        rows = samples.columns["log"] == number
        warmth[rows] = np.interp(samples.time_s[rows], *_along(each, column))
    return replace(samples, columns={**samples.columns, NAME: warmth})


def _along(options: Mapping[str, Any], column: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Seconds after the first row of a log, and degC."""
    path, name, stamps = Path(options["file"]), column["column"], options.get("time")
    names = (name, stamps["column"]) if stamps else (name,)
    try:
        table = read_table(path, names, options.get("delimiter"), options.get("decimal"))
        require_unit(path, name, table.units.get(name, ""), column, ("degC",))
    except BackendError as error:
        raise DataError(str(error)) from error
    celsius = column.get("scale", 1.0) * (table.columns[name] - column.get("offset", 0.0))
    bounds = COLUMNS[NAME]
    wrong = np.flatnonzero(~((celsius >= bounds.low) & (celsius <= bounds.high)))
    if len(wrong):
        raise DataError(
            f"{path}: row {wrong[0] + 1}: {name!r} is {celsius[wrong[0]]:g} degC, no temperature of a motor; "
            "correct the column or its unit"
        )
    if not stamps:
        return np.arange(len(celsius)) / float(options["rate_hz"]), celsius
    time, _ = unwrapped(table.columns[stamps["column"]])
    since = stamps.get("scale", 1.0) * TIME_UNITS[stamps.get("unit", "s")] * (time - time[0])
    return since, celsius
