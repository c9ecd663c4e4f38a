"""Recorded samples through the compiled law once more, at the law's own speed.

What the loop and the devices wrote is put into the tick as it was; the command in force is the recorded
one; the law decides anew. With the arrays of the recording the result is the same bit for bit, or the law
has changed. With those of another rig file it is what that one would have asked of the same motion.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rtctl.control import law
from rtctl.control.jit import compiled, records
from rtctl.control.records import state_dtype
from rtctl.errors import DataError
from rtctl.recording.reader import Batch, RecordingReader
from rtctl.recording.setup import LawArrays
from rtctl.tick import FIELDS, new_ticks, tick_dtype

_AFTER_LAW = ("read_ns", "law_ns", "write_ns", "record_ns", "cycle_ns")
"""Durations that the loop writes when the law has run: during the law the tick still has the last ones."""


@compiled
def run_law(
    words: np.ndarray,
    before: np.ndarray,
    after: np.ndarray,
    commands: np.ndarray,
    which: np.ndarray,
    tick: np.ndarray,
    tick_words: np.ndarray,
    state: np.ndarray,
    params: np.ndarray,
    model: np.ndarray,
    out: np.ndarray,
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
    """
    for i in range(len(words)):
        for k in before:
            tick_words[0, k] = words[i, k]
        law.step(tick, state, params, commands[which[i] : which[i] + 1], model)
        for k in range(words.shape[1]):
            out[i, k] = tick_words[0, k]
        for k in after:
            tick_words[0, k] = words[i, k]


def _field_words(n_axes: int, names: list[str]) -> np.ndarray:
    dtype = tick_dtype(n_axes)
    index: list[int] = []
    for name in names:
        kind, offset = dtype.fields[name][:2]  # type: ignore[index]
        index += range(offset // 8, (offset + kind.itemsize) // 8)
    return np.array(index, np.int64)


def _as_words(rows: np.ndarray) -> np.ndarray:
    """Ticks as words, shape (n, words per tick); the same memory where they are contiguous."""
    return np.ascontiguousarray(rows).view(np.uint64).reshape(len(rows), rows.dtype.itemsize // 8)


LAW_FIELDS = [f.name for f in FIELDS if f.writer == "law"]


@dataclass
class Difference:
    """Where a replay first differed from the recording."""

    tick: int
    field: str
    axis: int
    recorded: float
    replayed: float

    def __str__(self) -> str:
        """For a person."""
        where = f"{self.field}[{self.axis}]" if self.axis >= 0 else self.field
        return f"tick {self.tick}: {where} recorded {self.recorded!r}, now {self.replayed!r}"


@dataclass
class Verdict:
    """What a replay found.

    Attributes
    ----------
    ticks, span_s
        Ticks replayed and the loop time they cover, s.
    law_s
        Time the law took for them, s.
    differing
        Field -> ticks in which it differs.
    stopped
        Why the replay could not go to the end; empty when it did.
    """

    ticks: int = 0
    span_s: float = 0.0
    law_s: float = 0.0
    first: Difference | None = None
    differing: dict[str, int] = field(default_factory=dict)
    stopped: str = ""


class Replay:
    """Runs the law over a recording, chunk by chunk.

    Parameters
    ----------
    reader
        A recording that begins with the first tick of its run, or whose arrays hold the law's state.
    arrays
        The law's arrays; default those of the recording.
    commands_from
        The command at start whose settings replace those a client never changed (another rig file).

    Raises
    ------
    DataError
        A recording without the law's arrays, or one that begins in the middle of a run.
    """

    def __init__(
        self,
        reader: RecordingReader,
        arrays: LawArrays | None = None,
        commands_from: np.ndarray | None = None,
    ) -> None:
        own = reader.law()
        if not reader.from_start and own.state is None:
            raise DataError(
                f"{reader.parts[0]}: begins in the middle of a run (tick {reader.about.get('first_tick')}), and the law's "
                "state there is not known; give the recording's first part, or record from the start "
                "(record = true in the rig file, or rtctl run --record)"
            )
        used = arrays or own
        self._reader, self._n = reader, reader.n_axes
        self._params, self._model = records(used.params), records(used.model)
        state = np.zeros(1, state_dtype(self._n)) if own.state is None else own.state.copy()
        self._state = records(state)
        tick = new_ticks(1, self._n)
        self._tick, self._tick_words = records(tick), tick.view(np.uint64).reshape(1, -1)
        loop = [f.name for f in FIELDS if f.writer != "law" and f.name not in (*_AFTER_LAW, "seal")]
        self._before, self._after = _field_words(self._n, loop), _field_words(self._n, list(_AFTER_LAW))
        missing = reader.missing_fields()
        self._compared = [name for name in LAW_FIELDS if name not in missing]
        self._law_words = _field_words(self._n, self._compared)
        self._initial, self._other = own.command, commands_from
        self._commands = np.zeros(1, own.command.dtype)  # number 0: none yet
        self._next: int | None = None
        self.verdict = Verdict()
        rows = np.zeros(0, self._tick.dtype)
        self._run(rows, np.zeros(0, np.int64))  # compiles, or loads

    def run(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Recorded and replayed ticks, chunk by chunk, until the end or what stops the replay (`verdict`)."""
        for batch in self._reader.batches():
            rows, which = self._playable(batch)
            if len(rows):
                yield rows, self._run(rows, which)
            if self.verdict.stopped:
                return

    def check(self) -> Verdict:
        """Replay everything and compare every field of the law bit for bit."""
        for rows, replayed in self.run():
            self._compare(rows, replayed)
        return self.verdict

    def _playable(self, batch: Batch) -> tuple[np.ndarray, np.ndarray]:
        """Rows up to the first loss, and the index of each one's command."""
        rows, numbers = batch.rows, batch.numbers
        if len(rows) == 0:
            return rows, numbers
        expected = int(numbers[0]) if self._next is None else self._next
        whole = numbers == np.arange(expected, expected + len(numbers))
        count = len(rows) if whole.all() else int(np.argmin(whole))
        self._next = expected + len(numbers)
        if count < len(rows):
            self.verdict.stopped = f"ticks are missing from the recording before tick {rows['tick'][count]}"
        self._learn(batch.commands)
        which = np.searchsorted(self._commands["seq"], rows["command_seq"][:count])
        found = self._commands["seq"][np.minimum(which, len(self._commands) - 1)]
        known = found == rows["command_seq"][:count]
        if not known.all():
            count = int(np.argmin(known))
            missing = int(rows["command_seq"][count])
            self.verdict.stopped = (
                f"command {missing}, in force at tick {rows['tick'][count]}, was not recorded"
            )
        return rows[:count], which[:count]

    def _learn(self, commands: np.ndarray) -> None:
        """Take commands in; of the old ones only the newest can still be in force."""
        if len(commands) == 0:
            return
        commands = commands if self._other is None else self._translated(commands)
        joined = np.concatenate((self._commands[-1:], commands))[::-1]  # the newer of two counts
        _, index = np.unique(joined["seq"], return_index=True)
        self._commands = joined[index]

    def _translated(self, commands: np.ndarray) -> np.ndarray:
        """Settings that no client changed become those of the other rig file."""
        assert self._other is not None
        changed = commands.copy()
        for name in commands.dtype.names or ():
            if name.startswith("environment_") or name == "compensation":
                untouched = commands[name] == self._initial[name]
                changed[name] = np.where(untouched, self._other[name], commands[name])
        return changed

    def _run(self, rows: np.ndarray, which: np.ndarray) -> np.ndarray:
        replayed = np.zeros(len(rows), rows.dtype)
        words, out = _as_words(rows), _as_words(replayed)
        began = time.perf_counter()
        run_law(
            words, self._before, self._after, records(self._commands), which.astype(np.int64),
            self._tick, self._tick_words, self._state, self._params, self._model, out,
        )  # fmt: skip
        verdict = self.verdict
        verdict.law_s += time.perf_counter() - began if len(rows) else 0.0
        verdict.ticks += len(rows)
        verdict.span_s += len(rows) * float(self._reader.about["period_ns"]) * 1e-9
        return replayed

    def _compare(self, rows: np.ndarray, replayed: np.ndarray) -> None:
        words, out = _as_words(rows), _as_words(replayed)
        if np.array_equal(words[:, self._law_words], out[:, self._law_words]):
            return
        verdict = self.verdict
        firsts: list[tuple[int, str]] = []
        for name in self._compared:
            index = _field_words(self._n, [name])
            bad = (words[:, index] != out[:, index]).any(axis=1)
            if bad.any():
                verdict.differing[name] = verdict.differing.get(name, 0) + int(bad.sum())
                firsts.append((int(np.argmax(bad)), name))
        if verdict.first is None:
            row, name = min(firsts, key=lambda found: found[0])
            verdict.first = _difference(rows[row], replayed[row], name)


def _difference(recorded: Any, replayed: Any, name: str) -> Difference:  # noqa: ANN401
    then, now = np.atleast_1d(recorded[name]), np.atleast_1d(replayed[name])
    axis = int(np.argmax(then.view(np.uint64) != now.view(np.uint64)))
    shown = axis if recorded[name].ndim else -1
    return Difference(int(recorded["tick"]), name, shown, then[axis].item(), now[axis].item())
