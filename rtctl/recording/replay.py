"""Recorded samples through the compiled law once more, at the law's own speed.

What the loop and the devices wrote is put into the tick as it was; the command in force is the recorded
one; the law decides anew. With the arrays of the recording the result is the same bit for bit, or the law
has changed. With those of another rig file it is what that one would have asked of the same motion."""

from __future__ import annotations

import os
import queue
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
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
        Time the law took for them, summed over the cores, and the time until all was read and compared, s.
    differing
        Field -> ticks in which it differs.
    stopped
        Why the replay could not go to the end; empty when it did."""

    ticks: int = 0
    span_s: float = 0.0
    law_s: float = 0.0
    took_s: float = 0.0
    first: Difference | None = None
    differing: dict[str, int] = field(default_factory=dict)
    stopped: str = ""


@dataclass
class _Piece:
    """The first ticks of a chunk that can be replayed, the commands among which theirs are, and which each
    one's is."""

    batch: Batch
    commands: np.ndarray
    which: np.ndarray

    def rows(self, room: Callable[[int], np.ndarray]) -> np.ndarray:
        """The recorded ticks, in the room that is given."""
        return self.batch.rows_in(room)[: len(self.which)]


@dataclass
class _Found:
    """What the law gave for a piece: its state at the end, its time, and what differs as in `Verdict`."""

    state: np.ndarray
    law_s: float
    first: Difference | None
    differing: dict[str, int]


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

    Attributes
    ----------
    verdict : Verdict
        What was found so far.
    by_states : int
        Chunks that were replayed from their recorded state, beside others.

    Raises
    ------
    DataError
        A recording without the law's arrays, or one that begins in the middle of a run."""

    def __init__(
        self,
        reader: RecordingReader,
        arrays: LawArrays | None = None,
        commands_from: np.ndarray | None = None,
    ) -> None:
        own = reader.law()
        if not reader.from_start and own.state is None:
            raise DataError(
                f"{reader.parts[0]}: begins in the middle of a run (tick {reader.about.get('first_tick')}), "
                "and the law's state there is not known; give the recording's first part, or record from "
                "the start (record = true in the rig file, or rtctl run --record)"
            )
        used = arrays or own
        self._reader, self._n = reader, reader.n_axes
        # the state at the start is the recording's, whatever else is another
        self._arrays = LawArrays(used.params, used.model, used.command, own.state)
        self._law = LawRunner(self._arrays, self._n)
        self._others: queue.SimpleQueue[LawRunner] = queue.SimpleQueue()
        self._states_hold = arrays is None and commands_from is None
        missing = reader.missing_fields()
        self._compared = [name for name in LAW_FIELDS if name not in missing]
        self._initial, self._other = own.command, commands_from
        self._book = CommandBook(self._n)
        # where the state at the start belongs: a first chunk that is damaged is a loss, not another law
        self._next = int(reader.about["first_row"])
        self.verdict = Verdict()
        self.by_states = 0

    def run(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Recorded and replayed ticks, chunk by chunk, until the end or what stops the replay (`verdict`).

        They are good until the next chunk."""
        for piece in self._pieces():
            rows, began = piece.rows(self._law.room), time.perf_counter()
            replayed, _ = self._law.run(rows, piece.commands, piece.which)
            self._count(piece, time.perf_counter() - began)
            yield rows, replayed

    def check(self) -> Verdict:
        """Replay everything and compare every field of the law bit for bit.

        Chunks whose state before them is recorded are replayed beside each other. That counts only where the
        law came to this very state in the chunk before; from where it did not, they are replayed one after
        another."""
        began = time.perf_counter()
        cores = len(os.sched_getaffinity(0))
        for _ in range(cores):
            self._others.put(LawRunner(self._arrays, self._n))
        with ThreadPoolExecutor(cores) as pool:
            for piece, early in _some_ahead(
                # one more than run: while the oldest is waited for, no core is idle
                self._pieces(),
                lambda piece: self._begun(pool, piece),
                cores + 1,
            ):
                if early is not None and self._is_reached(piece):
                    found = early.result()
                    self.by_states += 1
                    self._law.state[:] = found.state
                else:
                    found = self._replayed(self._law, piece)
                self._count(piece, found.law_s)
                self._take(found)
        self.verdict.took_s = time.perf_counter() - began
        return self.verdict

    def _begun(self, pool: ThreadPoolExecutor, piece: _Piece) -> Future[_Found] | None:
        """Begin with a piece before it is known whether its state holds, if it has one and all did so far."""
        if piece.batch.state is None or not self._states_hold:
            return None
        return pool.submit(self._replayed_by_another, piece.batch.state, piece)

    def _is_reached(self, piece: _Piece) -> bool:
        """Whether the law came to the state recorded before this piece; if not, none is believed."""
        assert piece.batch.state is not None
        # as bytes: a NaN is the same NaN
        reached = np.array(self._law.state).tobytes() == piece.batch.state.tobytes()
        self._states_hold = self._states_hold and reached  # once not, never again
        return self._states_hold

    def _replayed_by_another(self, state: np.ndarray, piece: _Piece) -> _Found:
        """Replay a piece from a recorded state. For any thread."""
        law = self._others.get()
        try:
            law.state[:] = state
            return self._replayed(law, piece)
        finally:
            self._others.put(law)

    def _replayed(self, law: LawRunner, piece: _Piece) -> _Found:
        rows, began = piece.rows(law.room), time.perf_counter()
        replayed, differs = law.run(rows, piece.commands, piece.which)
        law_s = time.perf_counter() - began
        found = self._compared_with(rows, replayed) if differs.any() else (None, {})
        return _Found(np.array(law.state).copy(), law_s, *found)

    def _pieces(self) -> Iterator[_Piece]:
        """What can be replayed, chunk by chunk."""
        for batch in ahead(self._reader.batches()):
            which = self._playable(batch)
            if len(which):
                yield _Piece(batch, self._book.commands, which)
            if self.verdict.stopped:
                return

    def _playable(self, batch: Batch) -> np.ndarray:
        """The index of each tick's command, up to the first loss."""
        numbers = batch.numbers
        if len(numbers) == 0:
            return numbers
        expected = self._next
        whole = numbers == np.arange(expected, expected + len(numbers))
        count = len(numbers) if whole.all() else int(np.argmin(whole))
        self._next = expected + len(numbers)
        if count < len(numbers):
            tick = batch.column("tick")[count]
            self.verdict.stopped = f"ticks are missing from the recording before tick {tick}"
        self._book.learn(batch.commands if self._other is None else self._translated(batch.commands))
        commands = batch.column("command_seq")[:count]
        which, known = self._book.find(commands)
        if known < count:
            tick = batch.column("tick")[known]
            self.verdict.stopped = f"command {commands[known]}, in force at tick {tick}, was not recorded"
        return which[:known]

    def _translated(self, commands: np.ndarray) -> np.ndarray:
        """Settings that no client changed become those of the other rig file."""
        assert self._other is not None
        changed = commands.copy()
        for name in commands.dtype.names or ():
            if name.startswith("environment_") or name == "compensation":
                untouched = commands[name] == self._initial[name]
                changed[name] = np.where(untouched, self._other[name], commands[name])
        return changed

    def _count(self, piece: _Piece, law_s: float) -> None:
        verdict = self.verdict
        verdict.law_s += law_s
        verdict.ticks += len(piece.which)
        verdict.span_s += len(piece.which) * float(self._reader.about["period_ns"]) * 1e-9

    def _take(self, found: _Found) -> None:
        """Add what differs in the next piece to the verdict."""
        verdict = self.verdict
        verdict.first = verdict.first or found.first
        for name, count in found.differing.items():
            verdict.differing[name] = verdict.differing.get(name, 0) + count

    def _compared_with(
        self, rows: np.ndarray, replayed: np.ndarray
    ) -> tuple[Difference | None, dict[str, int]]:
        """The first difference between recorded and replayed ticks, and in how many ticks each field
        differs."""
        words, out = as_words(rows), as_words(replayed)
        differing: dict[str, int] = {}
        firsts: list[tuple[int, str]] = []
        for name in self._compared:
            index = field_words(self._n, [name])
            bad = (words[:, index] != out[:, index]).any(axis=1)
            if bad.any():
                differing[name] = int(bad.sum())
                firsts.append((int(np.argmax(bad)), name))
        if not firsts:  # but in what the recording lacks
            return None, {}
        row, name = min(firsts, key=lambda found: found[0])
        return _difference(rows[row], replayed[row], name), differing


def _some_ahead(
    pieces: Iterator[_Piece], begin: Callable[[_Piece], Future[_Found] | None], most: int
) -> Iterator[tuple[_Piece, Future[_Found] | None]]:
    """Each piece with what was begun for it, `most` pieces after it was begun."""
    begun: deque[tuple[_Piece, Future[_Found] | None]] = deque()
    for piece in pieces:
        begun.append((piece, begin(piece)))
        if len(begun) > most:
            yield begun.popleft()
    yield from begun


def _difference(recorded: np.void, replayed: np.void, name: str) -> Difference:
    then, now = np.atleast_1d(recorded[name]), np.atleast_1d(replayed[name])
    # as bits: a NaN differs from every number, itself too
    axis = int(np.argmax(then.view(np.uint64) != now.view(np.uint64)))
    shown = axis if recorded[name].ndim else -1  # -1: no axis to be named
    return Difference(int(recorded["tick"]), name, shown, then[axis].item(), now[axis].item())
