"""Recorded samples through the compiled law once more, at the law's own speed.

What the loop and the devices wrote is put into the tick as it was; the command in force is the recorded
one; the law decides anew. With the arrays of the recording the result is the same bit for bit, or the law
has changed. With those of another rig file it is what that one would have asked of the same motion.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from rtctl.errors import DataError
from rtctl.recording.law_arrays import LawArrays
from rtctl.recording.law_runner import LAW_FIELDS, CommandBook, LawRunner, as_words, field_words
from rtctl.recording.read_ahead import ahead
from rtctl.recording.reader import Batch, RecordingReader


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
    law_s, took_s
        Time the law took for them, and reading and comparing with it, s.
    differing
        Field -> ticks in which it differs.
    stopped
        Why the replay could not go to the end; empty when it did.
    """

    ticks: int = 0
    span_s: float = 0.0
    law_s: float = 0.0
    took_s: float = 0.0
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
        self._law = LawRunner(LawArrays(used.params, used.model, used.command, own.state), self._n)
        missing = reader.missing_fields()
        self._compared = [name for name in LAW_FIELDS if name not in missing]
        self._law_words = field_words(self._n, self._compared)
        self._initial, self._other = own.command, commands_from
        self._book = CommandBook(self._n)
        self._next: int | None = None
        self.verdict = Verdict()

    def run(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Recorded and replayed ticks, chunk by chunk, until the end or what stops the replay (`verdict`).

        The replayed ones are good until the next chunk.
        """
        for batch in ahead(self._reader.batches()):
            rows, which = self._playable(batch)
            if len(rows):
                yield rows, self._run(rows, which)
            if self.verdict.stopped:
                return

    def check(self) -> Verdict:
        """Replay everything and compare every field of the law bit for bit."""
        began = time.perf_counter()
        for rows, replayed in self.run():
            self._compare(rows, replayed)
        self.verdict.took_s = time.perf_counter() - began
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
        self._book.learn(batch.commands if self._other is None else self._translated(batch.commands))
        which, known = self._book.find(rows["command_seq"][:count])
        if known < count:
            count, missing = known, int(rows["command_seq"][known])
            self.verdict.stopped = (
                f"command {missing}, in force at tick {rows['tick'][count]}, was not recorded"
            )
        return rows[:count], which[:count]

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
        began = time.perf_counter()
        replayed = self._law.run(rows, self._book.commands, which)
        verdict = self.verdict
        verdict.law_s += time.perf_counter() - began
        verdict.ticks += len(rows)
        verdict.span_s += len(rows) * float(self._reader.about["period_ns"]) * 1e-9
        return replayed

    def _compare(self, rows: np.ndarray, replayed: np.ndarray) -> None:
        words, out = as_words(rows), as_words(replayed)
        if (
            not (words != out).any(axis=0)[self._law_words].any()
        ):  # three times as quick as to pick the words first
            return
        verdict = self.verdict
        firsts: list[tuple[int, str]] = []
        for name in self._compared:
            index = field_words(self._n, [name])
            bad = (words[:, index] != out[:, index]).any(axis=1)
            if bad.any():
                verdict.differing[name] = verdict.differing.get(name, 0) + int(bad.sum())
                firsts.append((int(np.argmax(bad)), name))
        if verdict.first is None:
            row, name = min(firsts, key=lambda found: found[0])
            verdict.first = _difference(rows[row], replayed[row], name)


def _difference(recorded: np.void, replayed: np.void, name: str) -> Difference:
    then, now = np.atleast_1d(recorded[name]), np.atleast_1d(replayed[name])
    axis = int(np.argmax(then.view(np.uint64) != now.view(np.uint64)))
    shown = axis if recorded[name].ndim else -1
    return Difference(int(recorded["tick"]), name, shown, then[axis].item(), now[axis].item())
