"""The readings of a sample, kept and shown again, compiled: a slow device and a lost link show what they
showed last."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import literal_unroll

from hw.channels import QUANTITIES
from hw.jit import compiled

FIELDS = tuple(reading.field for reading in QUANTITIES)
"""Fields of a tick and of a `kept_field`."""


def kept_field(name: str, n_axes: int) -> tuple[Any, ...]:
    """A field of a state record that holds one sample's readings, by the names that they have in the tick."""
    return (name, [reading.dtype(n_axes) for reading in QUANTITIES])


@compiled
def copy_readings(source: np.record, target: np.record) -> None:
    """Keep the readings of a tick, or let a tick show those that were kept."""
    # unrolled: fields of different shapes have different types, and a compiled loop has one
    for field in literal_unroll(FIELDS):
        old, new = source[field], target[field]
        # here, not in a function: a call for each field takes eight times as long
        for i in range(len(old)):
            new[i] = old[i]
