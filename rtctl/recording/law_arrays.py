"""The arrays that the law starts with, and their archive in a recording."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import Any

import numpy as np

from hw.outside import shown
from rtctl.bounded_npz import read_arrays
from rtctl.control.records import MODEL, command_dtype, params_dtype, state_dtype
from rtctl.errors import DataError

LAW_NAME = "law.npz"
# an archive of a stranger may unpack to any size
MOST_LAW_BYTES = 1 << 24
"""Largest size of the law's arrays, unpacked: those of eight axes have a hundredth of it."""


@dataclass(frozen=True)
class LawArrays:
    """The law's arrays at the start of a run; shapes as in `rtctl.control.records`.

    `missing` are fields of an archive of an earlier version that it lacks (`params.force_used`): 0."""

    params: np.ndarray
    model: np.ndarray
    command: np.ndarray
    state: np.ndarray | None = None
    missing: tuple[str, ...] = ()


_ONE_BEFORE = {"params.sure_viscous_nms_rad": "params.viscous_nms_rad"}
"""Fields that are two now: an archive that lacks the first means by the second what both say."""


def pack_law(law: LawArrays) -> bytes:
    """The arrays as a compressed npz, one array per field, readable without this package."""
    arrays: dict[str, Any] = {}
    for part in ("params", "model", "command", "state"):
        array = getattr(law, part)
        if array is not None:
            # by field, not as records: a version with other fields takes up those it knows
            arrays |= {f"{part}.{name}": array[name] for name in array.dtype.names or ()}
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


def unpack_law(data: bytes, n_axes: int) -> LawArrays:
    """The arrays of `pack_law`.

    Fields this version does not know are left out and missing ones are 0: whether the law still gives the
    same is for the replay to find out.

    Raises
    ------
    DataError
        Not such an archive, or one of another rig size."""
    try:
        archive = read_arrays(io.BytesIO(data), MOST_LAW_BYTES)
        parts = {
            "params": np.zeros(1, params_dtype(n_axes)),
            "model": np.zeros(n_axes, MODEL),
            "command": np.zeros(1, command_dtype(n_axes)),
            "state": np.zeros(1, state_dtype(n_axes)),
        }
        missing = []
        for part, array in parts.items():
            for name in array.dtype.names or ():
                known = f"{part}.{name}"
                if known not in archive:
                    known = _ONE_BEFORE.get(known, known)
                if known in archive:
                    array[name] = archive[known]
                else:
                    missing.append(f"{part}.{name}")
        # zeros are a state, too: that of a start
        has_state = any(name.startswith("state.") for name in archive)
    except (ValueError, TypeError) as error:
        raise DataError(f"the law's arrays in the recording cannot be read: {shown(error)}") from error
    state = parts["state"] if has_state else None
    return LawArrays(parts["params"], parts["model"], parts["command"], state, tuple(missing))
