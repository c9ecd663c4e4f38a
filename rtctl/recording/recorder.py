"""Records a run in a thread of its own: the giver of ticks never waits for the disk.

Ticks that do not fit into the queue are dropped and counted, and show in the file as a gap in the numbers
of the ticks; their events and commands are kept. A disk that refuses marks the recording as broken; a new
file is tried every second."""

from __future__ import annotations

import struct
import threading
import time
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.control.records import command_dtype
from rtctl.recording.limits import Limits
from rtctl.recording.parts import Parts
from rtctl.recording.setup import Setup
from rtctl.tick import copied

QUEUE_S = 15.0
"""Loop time that may wait for the disk: more than the ring holds, which comes all at once after a slow
start."""

RETRY_S = 1.0
# with the event log's own (`flight_recorder.END_S`, twice) below TimeoutStopSec= of the unit: at its end
# systemd kills, and nobody would say that the disk hangs
END_S = 12.0
"""Longest wait for the disk at the end."""

_Batch = tuple[int, np.ndarray, list[dict[str, Any]], np.ndarray, np.ndarray | None]


class Recorder:
    """One recording.

    Parameters
    ----------
    folder
        Where its files go; made when it does not exist.
    setup
        What the files say beside ticks.
    limits
        Rotation, and room left on the disk.
    wait
        Wait for room in the queue instead of dropping: for a virtual clock, which waits for its reader."""

    def __init__(
        self, folder: Path, setup: Setup, limits: Limits | None = None, *, wait: bool = False
    ) -> None:
        self.folder = folder
        self._parts = Parts(folder, setup, limits or Limits())
        # at least 20,000: a slow loop's 15 s are few ticks, and a disk may take its time all the same
        self._most_rows = max(20_000, round(QUEUE_S * float(setup.about["rate_hz"])))
        self._wait = wait
        self._queue: deque[_Batch] = deque()
        self._queued = self._dropped = self._failed = 0
        self._commands_lost = 0
        self._cpu_s = 0.0
        self._held: tuple[list[dict[str, Any]], np.ndarray] = [], np.zeros(0, command_dtype(setup.n_axes))
        self._last: tuple[int, np.ndarray] | None = None
        """Number and row of the newest tick that was dropped."""
        self._broken: str | None = None
        self._retry_at = 0.0
        self._reason = ""
        self._ending = False
        self._change = threading.Condition()
        self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
        self._thread.start()

    def observe(
        self,
        first_row: int,
        rows: np.ndarray,
        events: list[dict[str, Any]],
        commands: np.ndarray,
        commands_lost: int = 0,
        state: np.ndarray | None = None,
    ) -> None:
        """Take ticks in order (see `Parts.add`). Drops them when the queue is full."""
        if len(rows) == 0:
            return
        with self._change:
            self._commands_lost = commands_lost
            if self._wait:
                self._change.wait_for(lambda: self._fits(rows), END_S)
            # the events are kept all the same: what happened matters more than the ticks around it
            if not self._fits(rows):
                self._dropped += len(rows)
                self._held = (
                    # bounded, as the ticks are: a disk may hang for days
                    (self._held[0] + events)[-1000:],
                    np.concatenate((self._held[1], commands))[-1000:],
                )
                # copied: a view would keep the whole batch
                self._last = first_row + len(rows) - 1, copied(rows[-1:])
                return
            held_events, held_commands = self._held
            if held_events or len(held_commands):
                events, commands = held_events + events, np.concatenate((held_commands, commands))
                self._held = [], held_commands[:0]
            # not copied: whoever reads the ring has copied them, and each batch is of new memory
            self._queue.append((first_row, rows, events, commands, state))
            self._queued += len(rows)
            self._change.notify_all()

    def _fits(self, rows: np.ndarray) -> bool:
        """Whether there is room in the queue; an empty one takes whatever comes."""
        return self._queued == 0 or self._queued + len(rows) <= self._most_rows

    def status(self) -> dict[str, Any]:
        """How it goes. `broken` is why the disk refused, for good once it did; `dropped` counts lost ticks,
        `cpu_s` is the processor time of the recorder, s."""
        parts = self._parts
        return {
            "folder": str(self.folder),
            "file": None if parts.path is None else parts.path.name,
            "files": len(parts.files),
            "ticks": parts.written,
            "bytes": parts.bytes,
            "queued": self._queued + parts.pending,
            "dropped": self._dropped + self._failed,
            "commands_lost": self._commands_lost,
            "broken": self._broken,
            "cpu_s": self._cpu_s,
        }

    @property
    def broken(self) -> str | None:
        """Why the disk refused, for good once it did."""
        return self._broken

    @property
    def files(self) -> list[Path]:
        """Files written so far."""
        return list(self._parts.files)

    def close(self, reason: str = "") -> bool:
        """Write what is queued and end. False when the disk did not take it within `END_S`. Idempotent."""
        with self._change:
            # a run asks twice, after its last batch and on its way out: a disk that hangs is waited for once
            patience_s = 0.0 if self._ending else END_S
            self._ending, self._reason = True, self._reason or reason
            self._change.notify_all()
        self._thread.join(patience_s)
        if self._thread.is_alive():
            # what waits is lost when the process ends: nobody may call that a success
            self._broken = self._broken or f"{self.folder}: the disk took nothing for {END_S:g} s at the end"
            return False
        return True

    def _work(self) -> None:
        while True:
            with self._change:
                self._change.wait_for(lambda: self._queue or self._ending)
                # told to end, and nothing left: what was queued before is written first
                if not self._queue:
                    break
                batch = self._queue.popleft()
            self._write(batch)
            # this thread's alone, which is the recorder
            self._cpu_s = time.thread_time()
            with self._change:
                # only now: what is being written still takes memory
                self._queued -= len(batch[1])
                self._change.notify_all()
        events, commands = self._held
        # nothing came behind the ticks that were dropped: how a run ended is told with the last of them
        if self._last is not None and (events or len(commands)):
            self._dropped -= 1
            self._write((*self._last, events, commands, None))
        end = {
            "reason": self._reason,
            "dropped": str(self._dropped + self._failed),
            "broken": self._broken or "",
        }
        end |= {"commands_lost": str(self._commands_lost)}
        pending, written = self._parts.pending, self._parts.written
        try:
            self._parts.close(end)
        except OSError as error:
            # the last chunk may be on the disk, and only the summary not
            self._break(_refusal(error, self.folder), pending - (self._parts.written - written))

    def _write(self, batch: _Batch) -> None:
        parts, rows = self._parts, batch[1]
        # between two tries it is counted, not tried: opening a file for each batch would hold up the queue
        if self._broken is not None and parts.path is None and time.monotonic() < self._retry_at:
            self._failed += len(rows)
            return
        pending, written = parts.pending, parts.written
        try:
            parts.add(*batch)
        except OSError as error:
            self._break(_refusal(error, self.folder), pending + len(rows) - (parts.written - written))
        except (KeyError, TypeError, ValueError, OverflowError, struct.error) as error:
            # an event of a daemon of another version, over the wire: without this thread all else would be
            # lost unheard
            why = f"{self.folder}: what came cannot be recorded ({error!r})"
            self._break(why, pending + len(rows) - (parts.written - written))

    def _break(self, why: str, lost: int) -> None:
        self._parts.abandon()
        self._failed += lost
        self._broken = why
        self._retry_at = time.monotonic() + RETRY_S


def _refusal(error: OSError, folder: Path) -> str:
    return f"{error.filename or folder}: {error.strerror or error}"
