"""What the simulated board's motor got, cycle by cycle, in a file that outlives the process that wrote it.

A test maps the same file: after the host has died it still sees when the torque went to zero."""

from __future__ import annotations

import mmap
from functools import cache
from pathlib import Path

import numpy as np

_HEADER = np.dtype([("count", "<i8"), ("n_axes", "<i8"), ("capacity", "<i8")])
CAPACITY = 1 << 15


@cache
def row_dtype(n_axes: int) -> np.dtype[np.void]:
    """One board cycle."""
    return np.dtype(
        [
            ("time_ns", "<i8"),  # CLOCK_MONOTONIC when the motor got it
            ("slot", "<i8"),  # board cycle
            ("enabled", "<i8"),
            ("status", "<i8"),  # hw.serial.frame.Status
            ("command_sequence", "<i8"),
            ("command_age", "<i8"),
            ("current_a", "<f8", (n_axes,)),
            ("torque_nm", "<f8", (n_axes,)),  # at the link
            ("position_rad", "<f8", (n_axes,)),
        ]
    )


class Observation:
    """A ring of the newest `capacity` rows. One writer, any readers."""

    def __init__(self, path: Path, *, writable: bool) -> None:
        with path.open("r+b" if writable else "rb") as file:
            access = mmap.ACCESS_WRITE if writable else mmap.ACCESS_READ
            self._map = mmap.mmap(file.fileno(), 0, access=access)
        self._header = np.frombuffer(self._map, _HEADER, 1)
        self.n_axes = int(self._header[0]["n_axes"])
        dtype = row_dtype(self.n_axes)
        self._rows = np.frombuffer(self._map, dtype, int(self._header[0]["capacity"]), _HEADER.itemsize)

    @classmethod
    def create(cls, path: Path, n_axes: int, capacity: int = CAPACITY) -> Observation:
        """Make an empty file at `path`."""
        header = np.zeros(1, _HEADER)
        header["n_axes"], header["capacity"] = n_axes, capacity
        with path.open("wb") as file:
            file.write(header.tobytes())
            file.truncate(_HEADER.itemsize + capacity * row_dtype(n_axes).itemsize)
        return cls(path, writable=True)

    @classmethod
    def attach(cls, path: Path) -> Observation:
        """Read the file another process writes."""
        return cls(path, writable=False)

    @property
    def count(self) -> int:
        """Rows written so far."""
        return int(self._header[0]["count"])

    def append(self, row: np.ndarray) -> None:
        """Add a row of `row_dtype`; it counts once it is whole."""
        count = self.count
        self._rows[count % len(self._rows)] = row
        # last: a reader of another process must not count a row that is not written
        self._header[0]["count"] = count + 1

    def rows(self) -> np.ndarray:
        """The newest rows, oldest first; a copy."""
        count, capacity = self.count, len(self._rows)
        if count <= capacity:
            return self._rows[:count].copy()
        return np.roll(self._rows, -(count % capacity)).copy()[1:]  # the oldest may be half overwritten
