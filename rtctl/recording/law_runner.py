"""The compiled law over rows of recorded ticks, and the commands that were in force in them."""

from __future__ import annotations

import numpy as np

from hw.entry_points import Address, call, entry_point
from hw.record_fields import placed
from rtctl.control import law
from rtctl.control.jit import records
from rtctl.control.records import command_dtype, state_dtype
from rtctl.recording.jit import compiled
from rtctl.recording.law_arrays import LawArrays
from rtctl.tick import FIELDS, new_ticks, tick_dtype

_AFTER_LAW = ("read_ns", "law_ns", "write_ns", "record_ns", "cycle_ns")
"""Durations that the loop measures once the law has run. While the law runs, a tick still holds those of the
tick before."""


@compiled
def run_law(
    words: np.ndarray,
    before: np.ndarray,
    after: np.ndarray,
    commands: np.ndarray,
    which: np.ndarray,
    law_at: Address,
    arguments: tuple[np.ndarray, ...],
    tick_words: np.ndarray,
    out: np.ndarray,
    first: int,
    differs: np.ndarray,
) -> None:
    """Run the law for every row, in place in `state`.

    Parameters
    ----------
    words : array of uint64, shape (n, words per tick)
        Recorded ticks.
    before, after : array of int
        Words to copy into the tick before and after the law.
    commands, which : array
        Commands, and for each row the index of the one in force.
    tick, tick_words : array
        The tick the law works on, and the same memory as words, shape (1, words per tick).
    out : array of uint64, shape (n, words per tick)
        The ticks as the law leaves them.
    first
        The first word that the law writes; the last word of a tick is its seal.
    differs : array of bool, shape (n,)
        Whether the law has written anything else than was recorded."""
    command, in_force = arguments[3], -1
    for i in range(len(words)):
        for k in before:
            tick_words[0, k] = words[i, k]
        # a command lasts for thousands of ticks
        if which[i] != in_force:
            in_force = which[i]
            command[0] = commands[in_force]
        # by its address: compiled into this function the law would be compiled again with each change of
        # either
        call(law_at, arguments)
        changed = np.uint64(0)
        for k in range(words.shape[1]):
            out[i, k] = tick_words[0, k]
        for k in range(first, words.shape[1] - 1):
            changed |= words[i, k] ^ tick_words[0, k]
        # gathered and asked once: no branch for each word
        differs[i] = changed != 0
        for k in after:
            tick_words[0, k] = words[i, k]


def field_words(n_axes: int, names: list[str]) -> np.ndarray:
    """Indices of the words of a tick that these fields take."""
    dtype = tick_dtype(n_axes)
    index: list[int] = []
    for name in names:
        kind, offset = placed(dtype, name)
        index += range(offset // 8, (offset + kind.itemsize) // 8)
    return np.array(index, np.int64)


def as_words(rows: np.ndarray) -> np.ndarray:
    """Ticks as words, shape (n, words per tick); the same memory where they are contiguous."""
    return np.ascontiguousarray(rows).view(np.uint64).reshape(len(rows), rows.dtype.itemsize // 8)


LAW_FIELDS = [f.name for f in FIELDS if f.writer == "law"]
"""Fields the law writes: what a replay compares."""


class LawRunner:
    """The law with its arrays, from one state on.

    Parameters
    ----------
    arrays
        The law's arrays; the state is zero where they have none.

    Attributes
    ----------
    state : array, shape (1,)
        The law's state after the last row.
    tick_words : array of uint64, shape (1, words per tick)
        The tick that the law works on."""

    def __init__(self, arrays: LawArrays, n_axes: int) -> None:
        start = np.zeros(1, state_dtype(n_axes)) if arrays.state is None else arrays.state.copy()
        self.state = records(start)
        tick, command = new_ticks(1, n_axes), np.zeros(1, command_dtype(n_axes))
        self.tick_words = tick.view(np.uint64).reshape(1, -1)
        params, model = records(arrays.params), records(arrays.model)
        self._arguments = (records(tick), self.state, params, records(command), model)
        self._law_at = entry_point(law.step, *self._arguments)
        # what devices and clock gave: the law decides the rest anew
        loop = [f.name for f in FIELDS if f.writer != "law" and f.name not in (*_AFTER_LAW, "seal")]
        self._before = field_words(n_axes, loop)
        self._after = field_words(n_axes, list(_AFTER_LAW))
        written = field_words(n_axes, LAW_FIELDS)
        self._first = int(written[0])
        # one run of words up to the seal: `run_law` compares from the first on
        assert written.tolist() == list(range(self._first, tick.dtype.itemsize // 8 - 1))
        self._out = self._room = np.zeros(0, tick.dtype)
        self.run(tick[:0], command, np.zeros(0, np.int64))  # compiles, or loads

    def room(self, n: int) -> np.ndarray:
        """Room for `n` recorded ticks, the same for every call."""
        if n > len(self._room):
            self._room = np.zeros(n, self._out.dtype)
        return self._room[:n]

    def run(self, rows: np.ndarray, commands: np.ndarray, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The ticks as the law leaves them, until the next call, and whether each differs from its row in
        what the law writes.

        `which` is each row's index in `commands`."""
        if len(rows) > len(self._out):
            self._out = np.zeros(len(rows), rows.dtype)
        replayed, differs = self._out[: len(rows)], np.empty(len(rows), np.bool_)
        run_law(
            as_words(rows), self._before, self._after, records(commands), which.astype(np.int64),
            self._law_at, self._arguments, self.tick_words, as_words(replayed), self._first, differs,
        )  # fmt: skip
        return replayed, differs


class CommandBook:
    """The commands that may be in force: the newest known, and those after it."""

    def __init__(self, n_axes: int) -> None:
        self.commands = np.zeros(1, command_dtype(n_axes))  # number 0: none yet

    def learn(self, commands: np.ndarray) -> None:
        """Take commands in; of the old ones only the newest can still be in force."""
        if len(commands):
            joined = np.concatenate((self.commands[-1:], commands))[::-1]  # the newer of two counts
            # the first of equal ones, which is the newer by the turned order
            _, index = np.unique(joined["seq"], return_index=True)
            self.commands = joined[index]

    def find(self, sequence: np.ndarray) -> tuple[np.ndarray, int]:
        """Index of each row's command, and how many rows there are before the first unknown one."""
        # sorted by `learn`: numbers only rise within a run
        which = np.searchsorted(self.commands["seq"], sequence)
        found = self.commands["seq"][np.minimum(which, len(self.commands) - 1)]
        known = found == sequence
        # argmin: the first False
        return which, len(sequence) if known.all() else int(np.argmin(known))
