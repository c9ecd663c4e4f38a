"""How warm the motor was along a log, from a column of its own: it changes so slowly that straight lines
between rows are good enough, whatever was done to place and torque.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hw.interface import BackendError
from hw.playback.reader import load_beside
from rtctl.errors import DataError
from rtctl.friction.logs.logs import FrictionSamples
from rtctl.friction.logs.regressors import Regressors
from rtctl.friction.point_columns import COLUMNS

NAME = "temperature_c"


def with_temperature(
    samples: FrictionSamples,
    signals: Regressors,
    options: Sequence[Mapping[str, Any]],
    column: Mapping[str, Any],
) -> FrictionSamples:
    """Samples of the pooled `signals` of several logs (validated options of the reader, in the order of their
    numbers), with the temperature of each.

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
        # the column has the clock of its own file, the samples that of all logs one after the other
        since_s = samples.time_s[rows] - signals.began_s(number)
        warmth[rows] = np.interp(since_s, *_along(each, column))
    return replace(samples, columns={**samples.columns, NAME: warmth})


def _along(options: Mapping[str, Any], column: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Seconds after the first row of a log, and degC."""
    try:
        since_s, celsius = load_beside(options, column, {"degC": 1.0})
    except BackendError as error:
        raise DataError(str(error)) from error
    bounds = COLUMNS[NAME]
    wrong = np.flatnonzero(~((celsius >= bounds.low) & (celsius <= bounds.high)))
    if len(wrong):
        raise DataError(
            f"{options['file']}: row {wrong[0] + 1}: {column['column']!r} is {celsius[wrong[0]]:g} degC, no "
            "temperature of a motor; correct the column or its unit"
        )
    return since_s, celsius
