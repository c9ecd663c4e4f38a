"""Reading a recording back: its facts, and its ticks, events and commands chunk by chunk."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import count, takewhile
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from rtctl.control.records import command_dtype
from rtctl.errors import DataError
from rtctl.recording import law_state
from rtctl.recording.facts import MOST_DIGITS, axis_names, sound
from rtctl.recording.law_arrays import LAW_NAME, LawArrays, unpack_law
from rtctl.recording.mcap_scan import Chunk, Contents, channel_of, chunks
from rtctl.recording.read_ahead import ahead
from rtctl.recording.tick_blocks import Block
from rtctl.recording.tick_layout import axes_in, layout_in
from rtctl.recording.topics import COMMAND, EVENT, STATE
from rtctl.tick import tick_dtype

_PART = re.compile(r"(.*)-(\d{3,})\.mcap")


class OtherRunError(DataError):
    """Files of two runs were given as parts of one."""


@dataclass
class Batch:
    """One chunk: ticks with their numbers among all the loop recorded, events, commands, and the law's state
    before the first tick where it is told."""

    ticks: np.ndarray | Block
    numbers: np.ndarray
    events: list[dict[str, Any]]
    commands: np.ndarray
    state: np.ndarray | None = None

    @cached_property
    def rows(self) -> np.ndarray:
        """The ticks, shape (n,)."""
        return self.ticks.rows() if isinstance(self.ticks, Block) else self.ticks

    def rows_in(self, room: Callable[[int], np.ndarray]) -> np.ndarray:
        """The ticks, shape (n,), in the room for n ticks that is given, if they must be put anywhere."""
        return self.ticks.rows(room(self.ticks.n)) if isinstance(self.ticks, Block) else self.ticks

    def column(self, name: str) -> np.ndarray:
        """A field of one number per tick, shape (n,), by itself."""
        return self.ticks.column(name) if isinstance(self.ticks, Block) else self.ticks[name]


@dataclass
class Recording:
    """A recording read as a whole.

    Attributes
    ----------
    rows, numbers
        Ticks, shape (n,), and the number of each among all the loop recorded."""

    about: dict[str, str]
    rows: np.ndarray
    numbers: np.ndarray
    events: list[dict[str, Any]]
    commands: np.ndarray
    attachments: dict[str, bytes]


@dataclass
class RecordingReader:
    """Reads the parts of one recording in order.

    Attributes
    ----------
    parts
        Files, in order.
    about
        Facts of the recording (`rtctl.recording.setup`), of its first part.
    ends
        Closing facts of the parts that were closed.
    cut
        Parts that do not end as they should.
    left_out
        Parts that could not be read at all, and why.
    notes
        What was damaged beside the ticks, and what is taken in its place.
    bad_chunks : int
        Damaged chunks left out so far."""

    parts: Sequence[Path]
    about: dict[str, str] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    ends: dict[Path, dict[str, str]] = field(default_factory=dict)
    cut: list[Path] = field(default_factory=list)
    left_out: dict[Path, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    whole_chunks: int = 0
    bad_chunks: int = 0

    def __post_init__(self) -> None:
        """Read the facts, of the first part that can be read. Raises DataError when none can."""
        why = ""
        # the first that has facts stands for all: a first part that is gone or damaged takes no other with it
        for path in self.parts:
            first = Contents()
            try:
                chunk = next(chunks(path, first), None)
                self._adopt(first, chunk, path)
            except DataError as error:
                why = why or str(error)
                self.left_out[path] = str(error)
                continue
            break
        else:
            raise DataError(why or "there is no such recording")
        self.parts = [path for path in self.parts if path not in self.left_out]  # those before it as well

    @property
    def n_axes(self) -> int:
        """Number of axes."""
        return int(self.about["n_axes"])

    @property
    def axes(self) -> list[str]:
        """Names of the axes."""
        return axis_names(self.about)

    @property
    def motions(self) -> list[str]:
        """Motion of each axis (`hw.motion`); recordings that do not say are of rotary ones."""
        return list(json.loads(self.about["motion"])) if "motion" in self.about else ["rotary"] * self.n_axes

    @property
    def from_start(self) -> bool:
        """True when the first part begins with the first tick of the run."""
        return self.about.get("first_row") == "0"

    def law(self) -> LawArrays:
        """The law's arrays at the start of the run. Raises DataError when the recording has none."""
        if LAW_NAME not in self.attachments:
            raise DataError(f"{self.parts[0]}: has no {LAW_NAME}; it cannot be replayed")
        return unpack_law(self.attachments[LAW_NAME], self.n_axes)

    def missing_fields(self) -> list[str]:
        """Tick fields of this version that the recording does not have; they read as NaN, whole numbers as
        0."""
        return self._layout.missing

    def batches(self) -> Iterator[Batch]:
        """Chunk by chunk, over all parts."""
        self.cut, self.ends, self.whole_chunks, self.bad_chunks = [], {}, 0, 0  # it may be read again
        for path in self.parts:
            contents = Contents()
            try:
                yield from self._part(path, contents)
            except OtherRunError:
                raise
            except DataError as error:
                self.left_out[path] = str(error)
                continue
            self.whole_chunks += contents.whole_chunks
            self.bad_chunks += contents.bad_chunks
            if "rtctl.end" in contents.metadata:
                self.ends[path] = contents.metadata["rtctl.end"]
            if not contents.complete:  # known only once all of it was read
                self.cut.append(path)

    def _part(self, path: Path, contents: Contents) -> Iterator[Batch]:
        first_row: int | None = None
        for chunk in ahead(chunks(path, contents)):
            if first_row is None:
                if path != self.parts[0]:
                    self._same_run(contents, path)
                first_row = _first_row(contents)
            try:
                batch = self._batch(chunk, contents, first_row)
            except (DataError, ValueError, TypeError, KeyError, OverflowError, AttributeError):
                contents.bad_chunks += 1  # sound as a chunk, but no ticks of such a rig
                contents.whole_chunks -= 1
                continue
            if batch is not None:
                yield batch

    def read(self) -> Recording:
        """Everything at once: needs memory for all ticks."""
        found = list(self.batches())  # reads, too: what is left out is known then
        rows = np.concatenate([b.rows for b in found] or [np.zeros(0, tick_dtype(self.n_axes))])
        numbers = np.concatenate([b.numbers for b in found] or [np.zeros(0, np.int64)])
        none = np.zeros(0, command_dtype(self.n_axes))
        commands = np.concatenate([none, *(b.commands for b in found)])
        events = [event for b in found for event in b.events]  # in the order of the chunks
        return Recording(self.about, rows, numbers, events, commands, self.attachments)

    def _adopt(self, contents: Contents, chunk: Chunk | None, path: Path) -> None:
        told = contents.metadata.get("rtctl", {})
        self.about, notes = sound(told, axes_in(contents, chunk))  # of a stranger's file
        if not self.about:
            raise DataError(f"{path}: not a recording of rtctl, or cut off before its first facts")
        self.attachments = contents.attachments
        self.notes = [f"{path}: {note}" for note in notes]
        self._states_fit = told.get("state_layout_crc32") == law_state.layout_crc32(self.n_axes)
        self._layout, note = layout_in(contents, told, chunk, self.n_axes)
        self.notes += [f"{path}: {note}"] if note else []

    def _same_run(self, contents: Contents, path: Path) -> None:
        about = contents.metadata.get("rtctl", {})  # an old file may lack facts: no other run
        if any(about.get(name, self.about[name]) != self.about[name] for name in ("session", "n_axes")):
            stems = {
                found[1] if (found := _PART.fullmatch(part.name)) else part for part in (path, self.parts[0])
            }
            if len(stems) > 1:
                raise OtherRunError(f"{path}: a part of another run than {self.parts[0]}")
            self.notes.append(
                f"{path}: says that it is of another run; taken for a part of this one by its name"
            )

    def _batch(self, chunk: Chunk, contents: Contents, first_row: int) -> Batch | None:
        of = {kind: channel_of(kind, chunk, contents) for kind in (EVENT, COMMAND, STATE)}
        if len(chunk.table) == 0:  # a chunk without a message says nothing
            return None
        ticks, sequence = self._layout.decode(chunk, contents, self.n_axes)  # as the first part
        # a message's sequence has 32 bits: counted on from the part's first tick
        numbers = first_row + (sequence - first_row) % (1 << 32)
        events = [event for data in chunk.texts(of[EVENT]) if (event := _event(data)) is not None]
        commands = [orjson.loads(data) for data in chunk.texts(of[COMMAND])]
        states = chunk.texts(of[STATE])[:1] if self._states_fit else []  # a chunk begins with one
        state = law_state.decode(states[0], self.n_axes) if states else None
        return Batch(ticks, numbers, events, _commands(commands, self.n_axes), state)


def _first_row(contents: Contents) -> int:
    """Number of the part's first tick, as far as the part says; else its ticks are counted from 0."""
    text = contents.metadata.get("rtctl", {}).get("first_row", "")
    return int(text) if text.isdecimal() and len(text) <= MOST_DIGITS else 0  # a stranger's number


def _event(data: bytes) -> dict[str, Any] | None:
    """An event as everybody relies on it; None for anything else."""
    event = orjson.loads(data)  # what is no JSON raises, and spoils its chunk
    if not isinstance(event, dict) or not isinstance(event.get("event"), str):
        return None
    return event


def _commands(found: list[dict[str, Any]], n_axes: int) -> np.ndarray:
    dtype = command_dtype(n_axes)  # fields that it lacks are 0: nothing asked
    commands = np.zeros(len(found), dtype)
    for k, fields in enumerate(found):
        for name in dtype.names or ():
            if name in fields:  # a command of before has fewer
                commands[name][k] = fields[name]
        if "words" in fields and len(words := base64.b64decode(fields["words"])) == dtype.itemsize:
            commands[k] = np.frombuffer(words, dtype)[0]
    return commands


def _place(path: Path) -> tuple[int, Callable[[int], Path]] | None:
    """Number of a part, and what names the others of its recording; None for a file of another name."""
    if (match := _PART.fullmatch(path.name)) is None:
        return None
    stem, number = match.groups()
    width = len(number) if number.startswith("0") else 3  # the part before 1000 is 999
    return int(number), lambda k: path.with_name(f"{stem}-{k:0{width}d}.mcap")


def with_earlier_parts(path: Path) -> list[Path]:
    """The recording's parts from its first one up to `path`, as far as they lie beside it."""
    if (place := _place(path)) is None:
        return [path]
    number, named = place
    # the nearest first: in `rig-20261127.mcap` the number is a date
    earlier = list(takewhile(Path.is_file, map(named, reversed(range(number)))))
    return [path] if len(earlier) < number else [*reversed(earlier), path]


def all_parts(path: Path) -> list[Path]:
    """The recording's parts up to `path` and those after it."""
    parts = with_earlier_parts(path)  # whichever part was named
    if (place := _place(path)) is not None:
        number, named = place
        parts += takewhile(Path.is_file, map(named, count(number + 1)))
    return parts


def newest(folder: Path) -> Path | None:
    """The part written last of all recordings in `folder`; a file of another name only where there is none of
    those. None: neither."""
    found = [path for path in folder.glob("*.mcap") if path.is_file()]  # a draft has another ending
    own = [path for path in found if _PART.fullmatch(path.name)]
    return max(own or found, key=lambda path: (path.stat().st_mtime_ns, path.name), default=None)
