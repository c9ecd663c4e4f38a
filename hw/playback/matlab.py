"""Arrays of a MATLAB file by name: of structures, also several of one name (`meas.Y(2).Data`), as Simulink
and ControlDesk write them.
"""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hw.interface import BackendError
from hw.playback.matlab_hdf import MOST_ENTRIES, read_hdf

HDF = b"MATLAB 7.3"


def read_matlab(path: Path, raw: bytes, most: int) -> Mapping[str, Any]:
    """Arrays of a file of at most `most` bytes, unpacked, by their path.

    Raises
    ------
    BackendError
        Of version 7.3 what `hw.playback.matlab_hdf.read_hdf` says; a bomb.
    """
    from scipy.io import loadmat, whosmat

    if raw.startswith(HDF) or raw[:8] == b"\x89HDF\r\n\x1a\n":
        return read_hdf(path, raw, most)
    size = 8 * sum(math.prod(shape) for _, shape, _ in whosmat(io.BytesIO(raw)))
    if size > most:
        raise BackendError(f"{path}: unpacks to {size} bytes, which no log does; cut it into parts")
    found: dict[str, Any] = {}
    objects = False
    for name, value in loadmat(io.BytesIO(raw), squeeze_me=True).items():
        objects |= type(value).__name__ == "MatlabOpaque" or name == "__function_workspace__"
        if not name.startswith("__"):
            _fields(name, value, found)
    if objects and not found:
        raise BackendError(
            f"{path}: holds MATLAB objects only (a timeseries, timetable, table or Dataset), which MATLAB "
            "alone can read; save their arrays: t = ts.Time; x = ts.Data; save(..., 't', 'x', '-v7')"
        )
    return found


def _fields(name: str, value: object, found: dict[str, Any], depth: int = 5) -> None:
    """Numbers of a MATLAB structure, by their path; of several structures the k-th is `name(k)`, of several
    cells `name{k}`.
    """
    array = np.asarray(value)
    entries = array.reshape(-1)[:MOST_ENTRIES]
    if array.dtype.names and depth:
        for k, entry in enumerate(entries):
            own = name if len(entries) == 1 else f"{name}({k + 1})"
            for field in array.dtype.names:
                _fields(f"{own}.{field}", entry[field], found, depth - 1)
    elif array.dtype == object and depth:
        for k, entry in enumerate(entries):
            _fields(name if len(entries) == 1 else f"{name}{{{k + 1}}}", entry, found, depth - 1)
    elif array.dtype.kind in "fiub":
        found[name] = array
