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
def keep(tick: np.record, kept: np.record) -> None:
    """Keep the readings of a tick."""
    for field in literal_unroll(FIELDS):
        source, target = tick[field], kept[field]
        # here, not in a function: a call for each field takes eight times as long
        for i in range(len(source)):
            target[i] = source[i]


@compiled
def show(tick: np.record, kept: np.record) -> None:
    """Let a tick show the readings that were kept."""
    for field in literal_unroll(FIELDS):
        source, target = kept[field], tick[field]
        for i in range(len(source)):
            target[i] = source[i]
