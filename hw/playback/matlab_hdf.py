# ruff: noqa: ANN401 - what h5py gives has no types without it
"""Arrays of an HDF5 file, and of a MATLAB file of version 7.3, which is one: structures are groups, arrays
lie transposed, several structures of one name and cells are references."""

from __future__ import annotations

import io
from collections.abc import Container, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from hw.interface import BackendError
from hw.playback.text_table import Table
from hw.playback.units import unit_of, units_beside

MOST_ENTRIES = 200
"""Most structures of one name, and cells, that are looked at."""

LONGEST_UNIT = 40
"""Most letters of a word that may be a unit."""

DEPTH = 6
"""Most structures within each other."""

NO_NUMBERS = ("char", "string", "function_handle", "FileWrapper__")
"""Classes of MATLAB whose arrays are integers and no numbers."""


def only_in_objects(path: Path, names: Sequence[str], found: Container[str]) -> None:
    """Refuse names that are not among the arrays of a MATLAB file that holds objects, too. Raises
    BackendError."""
    missing = [name for name in names if name not in found and name.rpartition("#")[0] not in found]
    if missing:
        raise BackendError(
            f"{path}: no array {missing[0]!r}; the file holds MATLAB objects (a timeseries, timetable, "
            "table or Dataset), which MATLAB alone can read: save their arrays, t = ts.Time; x = ts.Data; "
            "save(..., 't', 'x'), where ts of a Dataset is logsout.get('x').Values"
        )


def read_hdf(path: Path, raw: bytes, names: Sequence[str], most: int, between: str = ".") -> Table:
    """Arrays of a file of at most `most` bytes, unpacked, by their path: `between` groups and what is in
    them, as `hw.playback.matlab` has them or as HDF5 does; units as their attributes say them.

    Raises
    ------
    BackendError
        h5py is not installed, no sound file, a bomb, one of `names` that only an object can hold."""
    if find_spec("h5py") is None:
        other = "save it with save(..., '-v7')" if between == "." else "save the arrays as .npz (numpy.savez)"
        raise BackendError(
            f"{path}: HDF5 (a MATLAB file of version 7.3 is one) needs h5py: install rtctl with its extra "
            f"`matlab73` (pip install 'rtctl[matlab73]'), or {other}"
        )
    h5py: Any = import_module("h5py")
    try:
        with h5py.File(io.BytesIO(raw), "r") as file:
            reader = _Reader(path, file, h5py, most, between)
            for name in file:
                if not name.startswith("#"):
                    reader.put(name, reader.inside(file, name), DEPTH)
    except RuntimeError as error:
        raise BackendError(
            f"{path}: not a sound {path.suffix} file ({str(error)[:200]}); copy or save it again"
        ) from error
    if reader.objects:
        only_in_objects(path, names, reader.found)
    return Table(reader.found, units_beside(reader.found, reader.spelt, between) | reader.units)


class _Reader:
    def __init__(self, path: Path, file: Any, h5py: Any, most: int, between: str) -> None:
        self.path, self.file, self.h5py, self.left, self.between = path, file, h5py, most, between
        self.found: dict[str, Any] = {}
        self.units: dict[str, str] = {}
        self.spelt: dict[str, str] = {}
        self.objects = False

    def inside(self, group: Any, name: str) -> Any:
        """A member of a group that lies in this file, else None: a link may lead to any other."""
        return group[name] if isinstance(group.get(name, getlink=True), self.h5py.HardLink) else None

    def put(self, name: str, item: Any, depth: int) -> None:
        """Arrays of one variable, field or entry."""
        # a null data space has no shape: a remark's place, or a variable that was never written
        if item is None or not depth or getattr(item, "shape", ()) is None:
            return
        if isinstance(item, self.h5py.Group):
            for field in item:
                self.put(f"{name}{self.between}{field}", self.inside(item, field), depth - 1)
        elif self.h5py.check_ref_dtype(item.dtype):  # words are objects of NumPy, too
            self._entries(name, item, depth)
        else:
            self._array(name, item)

    def _entries(self, name: str, item: Any, depth: int) -> None:
        """Cells, `name{k}`; or a field of several structures: `s.x` is that of `s(k)`."""
        entries = self._taken(item).reshape(-1)[:MOST_ENTRIES]
        stem, dot, field = name.rpartition(".")
        for k, reference in enumerate(entries):
            own = name if len(entries) == 1 else f"{name}{{{k + 1}}}"
            if _class(item) != "cell" and dot:
                own = f"{stem}({k + 1}).{field}" if len(entries) > 1 else name
            if reference:
                self.put(own, self.file[reference], depth - 1)

    def _array(self, name: str, item: Any) -> None:
        if "MATLAB_object_decode" in item.attrs:
            self.objects = True
        elif item.dtype.names:  # records, as PyTables and pandas write a table
            records = self._taken(item)
            self.found |= {
                f"{name}{self.between}{field}": records[field]
                for field in item.dtype.names
                if item.dtype[field].kind in "fiub"
            }
        elif (
            item.dtype.kind in "fiub" and _class(item) not in NO_NUMBERS and "MATLAB_empty" not in item.attrs
        ):
            # MATLAB counts columns first, HDF5 rows
            array = self._taken(item).T
            self.found[name] = array.reshape(-1) if array.ndim == 2 and 1 in array.shape else array
            if told := unit_of(item.attrs):
                self.units[name] = told
        elif item.size <= LONGEST_UNIT and _class(item) == "char":
            self.spelt[name] = "".join(map(chr, self._taken(item).T.reshape(-1)))
        elif item.size == 1 and self.h5py.check_string_dtype(item.dtype):
            self.spelt[name] = str(np.ravel(item.asstr(errors="replace")[()])[0])

    def _taken(self, item: Any) -> np.ndarray:
        # before it is read: HDF5 packs, too
        self.left -= item.size * item.dtype.itemsize
        if self.left < 0:
            raise BackendError(f"{self.path}: unpacks to more than a log does; cut it into parts")
        return np.asarray(item[()])


def _class(item: Any) -> str:
    told = item.attrs.get("MATLAB_class", b"")
    return told.decode() if isinstance(told, bytes) else str(told)
