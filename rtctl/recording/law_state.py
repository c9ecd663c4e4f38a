"""The law's state before a chunk of ticks, as a ROS 2 message: with it a chunk is replayed without those
before it."""

from __future__ import annotations

import zlib
from functools import cache

import numpy as np

from rtctl.control.records import state_dtype
from rtctl.recording.tick_cdr import ENCAPSULATION

SCHEMA_NAME = "rtctl_msgs/msg/LawState"
SCHEMA = b"uint64[] words # the control law's state before the next block of ticks, as it lies in memory\n"


@cache
def layout_crc32(n_axes: int) -> str:
    """Checksum of the state's fields: a state is of use only to a law with the very same ones."""
    # names, types and places: a field moved is as wrong as one that is missing
    return str(zlib.crc32(str(state_dtype(n_axes).descr).encode()))


def encode(state: np.ndarray) -> bytes:
    """The message of a state, shape (1,)."""
    words = np.frombuffer(state.tobytes(), np.uint64)
    # a sequence's length has 4 bytes, and 4 of padding lead to its first word (CDR)
    return ENCAPSULATION + len(words).to_bytes(8, "little") + words.tobytes()


def decode(data: bytes, n_axes: int) -> np.ndarray | None:
    """The state, shape (1,); None for what is no state of a law of this size."""
    kind = state_dtype(n_axes)
    # 12: encapsulation, and length of the sequence with its padding
    if len(data) != 12 + kind.itemsize or data[:4] != ENCAPSULATION:
        return None
    return np.frombuffer(data[12:], kind).copy()
