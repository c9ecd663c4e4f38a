"""Sealing and taking of rows that two processes share: checksum, mailbox intake, tick recording.

Notes
-----
The checksum of words w_0..w_{n-1} is the sum over i of (w_i + i + 1) * M_i mod 2^64, with odd multipliers
M_i = 2 (i + 1) * PHI + 1 (PHI the 64-bit golden-ratio constant). Odd multipliers are invertible, so any
change of a single word is seen for certain; a mixture of two rows passes with probability about 2^-64. It
guards against torn and reordered stores, not against malice: both processes are ours."""

from __future__ import annotations

from functools import cache

import numpy as np

from rtctl.control.jit import compiled
from rtctl.control.records import command_dtype

PHI = np.uint64(0x9E3779B97F4A7C15)
_ONE = np.uint64(1)
_TWO = np.uint64(2)
_MASK = (1 << 64) - 1


@cache
def slot_dtype(n_axes: int) -> np.dtype[np.void]:
    """A mailbox slot: the command and, last, its checksum."""
    return np.dtype([("command", command_dtype(n_axes)), ("checksum", "<u8")])


@cache
def _weights(n: int) -> tuple[np.ndarray, int]:
    """The multipliers of `n` words, and the part of the checksum that does not depend on them."""
    index = np.arange(1, n + 1, dtype=np.uint64)
    multipliers = _TWO * index * PHI + _ONE
    return multipliers, int(index @ multipliers)


def checksum(row: np.ndarray) -> int:
    """Checksum of one row of words (NumPy form, equal to the compiled one)."""
    multipliers, constant = _weights(row.size)
    return (int(row @ multipliers) + constant) & _MASK


def seals_fit(rows: np.ndarray) -> np.ndarray:
    """Which rows of words, shape (rows, words), end in the checksum of the words before. Boolean (rows,)."""
    multipliers, constant = _weights(rows.shape[1] - 1)
    fits: np.ndarray = rows[:, :-1] @ multipliers + np.uint64(constant) == rows[:, -1]
    return fits


@compiled
def compiled_checksum(row: np.ndarray, n: int) -> np.uint64:
    """Checksum of the first `n` words of `row`."""
    total = np.uint64(0)
    index = np.uint64(0)
    for i in range(n):
        index += _ONE
        # + index: a row of zeros has a checksum that is not 0
        total += (row[i] + index) * (_TWO * index * PHI + _ONE)
    return total


@compiled
def take(header: np.ndarray, slot_words: np.ndarray, command_words: np.ndarray) -> int:
    """Copy the newest command into `command_words[0]` if it is new and whole. Returns 1 then, else 0.

    A slot whose checksum does not fit is being overwritten: it is left alone, counted, and looked at again
    in the next tick."""
    seq = header[0].mailbox_seq
    if np.uint64(seq) == command_words[0, 0]:  # not one command more: nothing is copied, nothing summed
        return 0
    slot = slot_words[seq % slot_words.shape[0]]
    n = command_words.shape[1]
    for i in range(n):
        command_words[1, i] = slot[i]
    # checked in a copy of its own: the slot may be overwritten while it is read; an older one is no news
    if compiled_checksum(command_words[1], n) != slot[n] or command_words[1, 0] < command_words[0, 0]:
        header[0].commands_refused += 1
        return 0
    for i in range(n):
        command_words[0, i] = command_words[1, i]
    return 1


@compiled
def publish(header: np.ndarray, ring_words: np.ndarray, tick_words: np.ndarray) -> None:
    """Seal the tick, copy it into the ring's next row, then raise the head."""
    n = tick_words.shape[1]
    tick_words[0, n - 1] = compiled_checksum(tick_words[0], n - 1)
    head = header[0].head
    row = ring_words[head % ring_words.shape[0]]
    for i in range(n):
        row[i] = tick_words[0, i]
    header[0].head = head + 1  # last: a reader that sees it finds the row whole
