"""Which words of a device's own tick are copied to which words of the rig's tick, and back; worked out once.

A tick is a row of 8-byte words. A device that serves some of the rig's axes has a tick with these axes only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from hw.channels import READINGS
from hw.interface import Rig
from hw.record_fields import placed

_XYZ = {reading.field for reading in READINGS if reading.shape == "xyz"} | {
    "force_tared_n",
    "moment_tared_nm",
}
_MEASURED = {reading.field for reading in READINGS} | {"sample_count", "link_faults"}


def subset(rig: Rig, axes: Sequence[int]) -> Rig:
    """The rig as a device sees it that serves only `axes`."""
    # the same object: a device of the whole rig need not be told apart from a rig of one device
    if list(axes) == list(range(rig.n_axes)):
        return rig
    index = list(axes)
    arrays = {
        name: getattr(rig, name)[index]
        for name in (
            "gear_ratio",
            "gear_efficiency",
            "torque_constant_nm_a",
            "encoder_counts_per_rev",
            "lever_m",
        )
    }
    directions = None if rig.axis_direction is None else rig.axis_direction[index]
    lead_m = None if rig.lead_m is None else rig.lead_m[index]
    return replace(rig, n_axes=len(index), axis_direction=directions, lead_m=lead_m, **arrays)


def device_dtype(dtype: np.dtype[np.void], n_axes: int) -> np.dtype[np.void]:
    """The tick's dtype with `n_axes` axes in place of the rig's."""
    fields: list[tuple[Any, ...]] = []
    for name in dtype.names or ():
        base, shape = dtype[name].base, dtype[name].shape
        if not shape:
            fields.append((name, base))
        else:
            fields.append((name, base, shape if name in _XYZ else (n_axes,)))
    return np.dtype(fields)


def _pairs(rig: np.dtype[np.void], own: np.dtype[np.void], name: str, axes: Sequence[int]) -> list[Any]:
    """Word numbers (in the rig's tick, in the device's) of one field."""
    # every field of a tick is made of words of 8 bytes
    rig_at, own_at = placed(rig, name)[1] // 8, placed(own, name)[1] // 8
    shape = own[name].shape
    if not shape:
        return [(rig_at, own_at)]
    if name in _XYZ:
        return [(rig_at + i, own_at + i) for i in range(shape[0])]
    return [(rig_at + axis, own_at + i) for i, axis in enumerate(axes)]


MOST_SLICES = 6
"""With more separate runs of words than this, copying by index is cheaper than slice by slice."""


def copier(pairs: Sequence[tuple[int, int]], source: np.ndarray, target: np.ndarray) -> Callable[[], None]:
    """A call that copies words from one row to another: slices where they are adjacent, else by index."""
    # the fewest calls that do it: most devices serve all axes, and then it is one slice
    runs: list[list[int]] = []
    # by the source: runs then come out whole, whatever the order of the axes
    for at, to in sorted(pairs):
        if runs and at == runs[-1][0] + runs[-1][2] and to == runs[-1][1] + runs[-1][2]:
            runs[-1][2] += 1
        else:
            runs.append([at, to, 1])
    if len(runs) > MOST_SLICES:
        chosen, places = np.array([at for at, _ in pairs]), np.array([to for _, to in pairs])

        def _by_index() -> None:
            target[places] = source[chosen]

        return _by_index
    read = source.data
    write = target.data
    steps = [partial(write.__setitem__, slice(to, to + n), read[at : at + n]) for at, to, n in runs]
    if len(steps) == 1:
        return steps[0]

    def _slice_by_slice() -> None:
        for step in steps:
            step()

    return _slice_by_slice


def _words(tick: np.ndarray) -> np.ndarray:
    return tick.view(np.ndarray).view(np.int64).reshape(-1)


class Exchange:
    """Everything that passes between the rig's tick and one device's, as ready-made copies.

    Parameters
    ----------
    tick, own
        The rig's one-row tick and the device's.
    axes
        The rig's axes in the order of the device's.
    fields
        Measured fields the device provides.
    commanded
        Whether the device gets the command; one that does not is told zero and disabled, and the time."""

    def __init__(
        self,
        tick: np.ndarray,
        own: np.ndarray,
        axes: Sequence[int],
        fields: Sequence[str],
        *,
        commanded: bool,
    ) -> None:
        names = tick.dtype.names or ()
        lead = names[: names.index("sample_count")]
        # a sensor sees the clock only: what the motors are sent is none of its business
        rest = [name for name in names if name not in _MEASURED] if commanded else lead
        rig_words, own_words = _words(tick), _words(own)

        def _of(fields: Sequence[str]) -> list[tuple[int, int]]:
            return [pair for name in fields for pair in _pairs(tick.dtype, own.dtype, name, axes)]

        def _back(pairs: list[tuple[int, int]]) -> list[tuple[int, int]]:
            return [(to, at) for at, to in pairs]

        self.lead_in = copier(_of(lead), rig_words, own_words)
        """Show the device which cycle it is."""
        self.command = copier(_of(rest), rig_words, own_words)
        """Show it the command."""
        # the emergency stop is not copied but joined: that of any device stops the rig
        measured = [name for name in fields if name != "estop"]
        self.deliver = copier(_back(_of(measured)), own_words, rig_words)
        """Show the rig what it has measured."""
        self.words: Any = own_words.data
        """The device's own tick as words; the numbers of some of them follow."""
        at = own.dtype.fields
        assert at is not None
        self.sample_count, self.link_faults, self.estop = (
            at[name][1] // 8 for name in ("sample_count", "link_faults", "estop")
        )
