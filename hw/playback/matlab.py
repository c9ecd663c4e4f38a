"""Arrays of a MATLAB file by name: of structures, also several of one name (`meas.Y(2).Data`), as Simulink
and ControlDesk write them."""

from __future__ import annotations

import io
import warnings
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hw.interface import BackendError
from hw.playback.matlab_hdf import MOST_ENTRIES, only_in_objects, read_hdf
from hw.playback.text_table import Table
from hw.playback.units import units_beside

HDF = b"MATLAB 7.3"

HEAD_BYTES, PACKED_ELEMENT = 128, 15


def read_matlab(path: Path, raw: bytes, names: Sequence[str], most: int) -> Table:
    """Arrays of a file of at most `most` bytes, unpacked, by their path, and units that their structures say.

    Raises
    ------
    BackendError
        Of version 7.3 what `hw.playback.matlab_hdf.read_hdf` says; a bomb; one of `names` that only an object
        can hold."""
    from scipy.io import loadmat

    if raw.startswith(HDF) or raw[:8] == b"\x89HDF\r\n\x1a\n":
        return read_hdf(path, raw, names, most)
    packs = 0 not in raw[:4]  # a file of version 4 has a zero there, and packs nothing
    if packs and _unpacks_beyond(raw, most):
        raise BackendError(f"{path}: unpacks to more than {most} bytes, which no log does; cut it into parts")
    found: dict[str, Any] = {}
    spelt: dict[str, str] = {}
    objects = False
    with warnings.catch_warnings():  # objects have no name of their own here: SciPy calls each of them None
        warnings.filterwarnings("ignore", "Duplicate variable name")
        arrays = loadmat(io.BytesIO(raw), squeeze_me=True)
    # looked for in all of them: an object beside the wanted arrays is no fault
    for name, value in arrays.items():
        if type(value).__name__ == "MatlabOpaque" or name == "__function_workspace__":
            objects = True
        elif not name.startswith("__"):
            _fields(name, value, found, spelt)
    if objects:
        only_in_objects(path, names, found)
    return Table(found, units_beside(found, spelt))


def _unpacks_beyond(raw: bytes, most: int) -> bool:
    """Whether the packed elements of a file of version 7 hold more than `most` bytes; each is unpacked no
    further."""
    # MI where the bytes of this mark are swapped, IM where they are not
    order: Literal["little", "big"] = "big" if raw[126:128] == b"MI" else "little"
    at, left = HEAD_BYTES, most
    while at + 8 <= len(raw):
        kind, size = (int.from_bytes(raw[k : k + 4], order) for k in (at, at + 4))
        # asked before SciPy unpacks it: 10 MB of zeros pack into 10 KB
        if kind == PACKED_ELEMENT:
            left -= len(zlib.decompressobj().decompress(raw[at + 8 : at + 8 + size], left + 1))
            if left < 0:
                return True
        at += 8 + size
    return False


def _fields(name: str, value: object, found: dict[str, Any], spelt: dict[str, str], depth: int = 5) -> None:
    """Numbers and words of a MATLAB structure, by their path; of several structures the k-th is `name(k)`,
    of several cells `name{k}`."""
    array = np.asarray(value)
    # a structure for each sample would be a million names
    entries = array.reshape(-1)[:MOST_ENTRIES]
    if array.dtype.names and depth:
        for k, entry in enumerate(entries):
            own = name if len(entries) == 1 else f"{name}({k + 1})"
            for field in array.dtype.names:
                _fields(f"{own}.{field}", entry[field], found, spelt, depth - 1)
    elif array.dtype == object and depth:
        for k, entry in enumerate(entries):
            _fields(name if len(entries) == 1 else f"{name}{{{k + 1}}}", entry, found, spelt, depth - 1)
    elif array.dtype.kind in "fiub":
        found[name] = array
    elif array.dtype.kind == "U" and array.size == 1:
        spelt[name] = str(array.item())
