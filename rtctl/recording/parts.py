"""The files of one recording: channels, chunks of bounded age, rotation by size and time."""

from __future__ import annotations

import base64
import errno
import os
import re
import time
from collections.abc import Mapping
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from rtctl.control.records import command_dtype
from rtctl.recording import law_state, tick_blocks, tick_cdr
from rtctl.recording import mcap_format as fmt
from rtctl.recording.declarations import checksums, declarations
from rtctl.recording.limits import Limits
from rtctl.recording.log_lines import log_line
from rtctl.recording.mcap_file import McapFile
from rtctl.recording.setup import Setup
from rtctl.recording.topics import COLUMNS, COMMAND, EVENT, LOG, STATE, TICK, TOPICS
from rtctl.tick import joined, new_ticks

# memory of a burst, and what one bad byte on the disk may cost; one axis at 10 kHz fills .8 of it in .5 s
CHUNK_BYTES = 1 << 22
CHUNK_S = 0.5
"""A crash of the program costs at most this much of a recording (a power cut more: `mcap_file.SYNC_S`)."""

ROWS_HZ = 1000.0
"""A quicker loop is recorded as columns, which have two thirds of the bytes; its rows are a choice of at most
`CHOSEN_HZ` then."""
CHOSEN_HZ = 100.0

ROWS_LEVEL, COLUMNS_LEVEL = 1, 3
"""zstd levels of a running recording: 1.1 us a tick either way; rows become no smaller at higher ones."""


_NO_NAME = re.compile(r"[^A-Za-z0-9_-]")


def part_name(setup: Setup, number: int, again: str = "") -> str:
    """Name of a part: rig, start of the run, session, number; sorts by time. `again` tells a later recording
    of the same session: without it its second file would be taken for one of the first recording."""
    began_ns = int(setup.about.get("began_wall_ns", setup.about["start_wall_ns"]))
    when = datetime.fromtimestamp(began_ns * 1e-9, UTC)
    session = int(setup.about["session"])
    # over the wire it may be anything, a path too; and an older recording need not name its rig
    rig = _NO_NAME.sub("_", setup.about.get("rig", "rig"))[:32]
    return f"{rig}-{when:%Y%m%dT%H%M%SZ}-{session:08x}{again}-{number:03d}.mcap"


class Parts:
    """Writes ticks, events and commands into a row of files. Not for several threads.

    Parameters
    ----------
    rows
        Every tick as a message of its own, however quick the loop is.

    Attributes
    ----------
    path
        The file being written, None between two. Until its first chunk is on the disk it has a draft's name:
        a file with a part's name always holds ticks, and one that the disk refused is taken away.
    written : int
        Ticks on disk.
    files : list of Path
        All files so far."""

    def __init__(self, folder: Path, setup: Setup, limits: Limits, *, rows: bool = False) -> None:
        self._folder, self._setup, self._limits = folder, setup, limits
        rate_hz = float(setup.about["rate_hz"])
        self._columns = rate_hz > ROWS_HZ and not rows
        # of so many ticks one is a row, too
        self._chosen = round(rate_hz / CHOSEN_HZ) if self._columns else 1
        if self._columns:  # compiled, or loaded, before the first chunk
            tick_blocks.encode(new_ticks(1, setup.n_axes), COLUMNS, 0, 0)
        self._level = COLUMNS_LEVEL if self._columns else ROWS_LEVEL
        self._tick_bytes = tick_cdr.MESSAGE_HEAD + tick_cdr.own_layout(setup.n_axes).itemsize
        # MCAP has no time before 1970, where a machine without a battery begins; `facts` reads 0, too
        self._start_wall_ns = max(0, int(setup.about["start_wall_ns"]))
        self._file: McapFile | None = None
        self._final = folder  # the name of the file being written, once it has a chunk
        self._again = ""  # the first of its session, as far as is known
        self._records: list[bytes | memoryview] = []
        self._size = 0
        self._index: dict[int, tuple[list[np.ndarray], list[np.ndarray]]] = {}
        self._ticks: list[tuple[int, np.ndarray]] = []  # number of the first, rows
        self._rows = 0
        self._in_force = np.zeros(0, command_dtype(setup.n_axes))
        self._chunk_ns = self._file_ns = 0
        self._numbers = dict.fromkeys(TOPICS, 0)
        self.written = self.bytes = 0
        self.files: list[Path] = []

    @property
    def path(self) -> Path | None:
        """The open file."""
        return None if self._file is None else self._final

    @property
    def pending(self) -> int:
        """Ticks not yet on disk."""
        return self._rows

    def add(
        self,
        first_row: int,
        rows: np.ndarray,
        events: list[dict[str, Any]],
        commands: np.ndarray,
        state: np.ndarray | None = None,
    ) -> None:
        """Take ticks with the events among them and the commands that came into force.

        `first_row` numbers the first tick among all the loop recorded; a gap in these numbers is a loss.
        `state` is the law's before the first of them, where it is known: a file that begins here can then be
        replayed, and a chunk of columns beside others.

        Raises
        ------
        OSError
            The disk refused; the ticks not yet written are lost, and the next call begins a new file."""
        if len(rows) == 0:
            return
        first_ns, last_ns = (int(t) + self._start_wall_ns for t in rows["time_ns"][[0, -1]])
        # of this batch: it is in force behind it, also where the disk refuses all that follows
        before, self._in_force = self._in_force, commands[-1:] if len(commands) else self._in_force
        begins = not self._rows
        if begins:
            self._chunk_ns = first_ns
        if self._file is None:
            self._open(first_row, rows, state)
            commands = np.concatenate((before, commands))  # each part says what was in force before it
        if begins and self._columns and state is not None:
            self._single(STATE, first_ns, law_state.encode(state))
        for command in commands:
            self._single(COMMAND, first_ns, orjson.dumps(command_fields(command)))
        for event in events:
            event_ns = max(0, int(event["timestamp"] * 1e9))
            self._single(EVENT, event_ns, orjson.dumps(event))
            self._single(LOG, event_ns, log_line(event, self._setup.about["rig"], event_ns))
        self._ticks.append((first_row, rows))  # encoded with the chunk, all in one step
        self._rows += len(rows)
        # before compression, in memory: a burst of a virtual clock is bounded by it
        size = self._size + self._rows * self._tick_bytes
        if size >= CHUNK_BYTES or last_ns - self._chunk_ns >= CHUNK_S * 1e9:
            self.flush()
            self._rotate(last_ns)

    def flush(self) -> None:
        """Write what is pending as a chunk. Raises OSError as `add`."""
        if not self._rows or self._file is None:
            return
        self._encode_ticks()
        records = b"".join(self._records)
        index = {k: (np.concatenate(t), np.concatenate(o)) for k, (t, o) in self._index.items()}
        rows, before = self._rows, self._file.size
        self._clear()
        try:
            self._leave_room(len(records))
            self._file.add_chunk(records, index)
            if self._file.path != self._final:
                # asked again: another recorder may have taken the name meanwhile, and a rename replaces
                self._final = self._free_name()
                self._file.rename(self._final)
                self.files.append(self._final)  # only now: it holds ticks
            self._file.bring_to_disk()
        except OSError:
            self.abandon()
            raise
        self.bytes += self._file.size - before
        self.written += rows

    def close(self, end: Mapping[str, str]) -> None:
        """Write what is pending, the closing metadata and the summary. Raises OSError as `add`."""
        self.flush()
        if self._file is not None:
            try:
                self._file.add_metadata("rtctl.end", end)
                self._file.close()
            except OSError:
                self.abandon()
                raise
            self._file = None

    def abandon(self) -> None:
        """Close the file as it is and forget what is pending; a file without ticks is taken away."""
        self._clear()
        if self._file is not None:
            self._file.abandon()
            if self._file.path != self._final:
                with suppress(OSError):  # a disk that became read-only keeps it
                    self._file.path.unlink(missing_ok=True)
            self._file = None

    def _encode_ticks(self) -> None:
        """All ticks that are pending become messages in one step: rows, or columns and a choice of rows."""
        numbers = np.concatenate([np.arange(first, first + len(rows)) for first, rows in self._ticks])
        rows = joined([rows for _, rows in self._ticks])
        times = rows["time_ns"] + self._start_wall_ns
        if self._columns:
            ends = [*(np.flatnonzero(np.diff(numbers) != 1) + 1).tolist(), len(rows)]
            for begin, end in zip([0, *ends], ends, strict=False):
                block = tick_blocks.encode(rows[begin:end], COLUMNS, int(numbers[begin]), int(times[begin]))
                self._append(COLUMNS, block, times[begin : begin + 1], np.zeros(1, np.int64))
            chosen = rows["tick"] % self._chosen == 0
            # a chunk has one row at least: by its length a reader knows the layout where the schema is lost
            chosen[0] = True
            rows, numbers, times = rows[chosen], numbers[chosen], times[chosen]
        messages = tick_cdr.encode(rows, TICK, numbers, times)
        self._append(TICK, messages.data, times, np.arange(len(rows)) * messages.shape[1])

    def _clear(self) -> None:
        self._records, self._index, self._size, self._rows, self._ticks = [], {}, 0, 0, []

    def _rotate(self, now_ns: int) -> None:
        file = self._file
        if file is None:
            return
        if file.size >= self._limits.file_bytes or now_ns - self._file_ns >= self._limits.file_s * 1e9:
            self.close({"reason": "continued in the next part"})

    def _leave_room(self, size: int) -> None:
        # asked before every chunk: others fill the disk as well
        disk = os.statvfs(self._folder)
        # f_bavail, not f_bfree: what is kept for root is no room
        if disk.f_bavail * disk.f_frsize < self._limits.free_bytes + size:
            free = self._limits.free_bytes / 1e6
            left = f"less than {free:g} MB" if free else "nothing"
            raise OSError(errno.ENOSPC, f"{left} would be left on the disk", str(self._folder))

    def _open(self, first_row: int, rows: np.ndarray, state: np.ndarray | None) -> None:
        setup = self._setup if state is None else self._setup.with_state(state)
        self._folder.mkdir(mode=0o750, parents=True, exist_ok=True)
        self._leave_room(0)
        path = self._free_name()
        # hidden, and by process: who looks for *.mcap finds no file without ticks, and two recorders share
        # none
        draft = path.with_name(f".{path.name}.{os.getpid()}.draft")
        draft.unlink(missing_ok=True)
        # all of its head or nothing: a draft that stayed would hide behind its dot for ever
        file: McapFile | None = None
        try:
            file = McapFile(draft, *declarations(self._setup.n_axes, columns=self._columns), self._level)
            facts = {
                "part": str(len(self.files)),
                "first_row": str(first_row),
                "first_tick": str(rows["tick"][0]),
            }
            facts |= checksums(self._setup.n_axes, columns=self._columns)
            facts["waiver"] = str(bool(rows["waiver"][0])).lower()
            file.add_metadata(
                "rtctl", {"recorded_wall_ns": str(time.time_ns()), **self._setup.about, **facts}
            )
            for name, (media, data) in setup.attachments.items():
                file.add_attachment(name, media, self._start_wall_ns, data)
        except OSError:
            if file is not None:
                file.abandon()
            draft.unlink(missing_ok=True)
            raise
        # last: until here there is no file for `abandon` to close
        self._file, self._file_ns = file, int(rows["time_ns"][0]) + self._start_wall_ns
        self._final = path

    def _free_name(self) -> Path:
        """Name of the next part, which no file has."""
        while (path := self._folder / part_name(self._setup, len(self.files), self._again)).exists():
            self._again += "b"  # two recordings of one session
        return path

    def _single(self, channel: int, time_ns: int, data: bytes) -> None:
        record = fmt.message(channel, self._numbers[channel], time_ns, data)
        self._numbers[channel] += 1  # over all files: it is of the recording
        self._append(channel, record, np.array([time_ns]), np.zeros(1, np.int64))

    def _append(
        self, channel: int, records: bytes | memoryview, times: np.ndarray, offsets: np.ndarray
    ) -> None:
        all_times, all_offsets = self._index.setdefault(channel, ([], []))
        all_times.append(times)
        all_offsets.append(offsets + self._size)
        self._records.append(records)
        self._size += memoryview(records).nbytes


def command_fields(command: np.void) -> dict[str, Any]:
    """A command as JSON can say it; with its bytes where a number in it is not finite."""
    fields = {name: command[name].tolist() for name in command.dtype.names or ()}
    floats = [command[name] for name in fields if command.dtype[name].base.kind == "f"]
    if not all(np.isfinite(value).all() for value in floats):
        fields["words"] = base64.b64encode(command.tobytes()).decode()
    return fields
