"""Incidents: the ticks around a fault, as one compressed npz file each; the flight recorder's tape.

An npz file holds one array per tick field (first dimension: tick) and `incident`, a JSON text with rig,
versions, the transition that caused it, and the events inside the window."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from hw.outside import json_of, opened, shown
from rtctl.bounded_npz import read_arrays
from rtctl.errors import DataError
from rtctl.recording.event_log import Event
from rtctl.tick import MOST_AXES, copied, forget, joined, tick_dtype

# at 1 kHz twice the silence of a renderer that stops a rig (`law_plan.TARGET_STOP_S`)
BEFORE_TICKS = 200
# RAMP takes no more (`law_plan.STOP_TICKS`): afterwards no torque is left to look at
AFTER_TICKS = 50
MOST_TICKS = 2000
"""A window that faults keep extending ends here."""

FOLDER = "incidents"
# as the log, incidents must not fill a disk in a night of faults
KEPT_FILES = 64
KEPT_BYTES = 64 << 20
# ten times the longest window of eight axes, 3.2 kB a tick
MOST_BYTES = 1 << 26
"""Largest incident that is read, unpacked."""

_TO_INCIDENT = ("FAULT", "ESTOP", "LOCKOUT")


@dataclass
class Incident:
    """Ticks around one transition.

    Attributes
    ----------
    trigger
        The event that caused it; its tick is in `ticks` unless the loop died.
    ticks
        Rows of the tick record, in order.
    events
        Events inside the window, the trigger among them.
    about
        Rig, session, version, config."""

    trigger: Event
    ticks: np.ndarray
    events: list[Event] = field(default_factory=list)
    about: dict[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """File name: sorts by time, says what happened."""
        when = datetime.fromtimestamp(self.trigger["timestamp"], UTC)
        # a loop that died has no state to go to
        what = self.trigger.get("to", self.trigger["event"])
        # a cause may hold what a device said, and slashes with it
        cause = "".join(c if c.isalnum() or c == "_" else "-" for c in str(self.trigger.get("cause", "")))
        return f"{when:%Y%m%dT%H%M%S.%f}Z-{what}-{cause[:40]}-tick{self.trigger['tick']}.npz"


def is_incident(event: Event) -> bool:
    """True for a change of state that a fault or an emergency stop caused."""
    if event["event"] != "state":
        return False
    return event["to"] in _TO_INCIDENT or (event["to"] == "STOPPING" and event.get("fault") is not None)


class Capture:
    """Cuts incidents out of the stream of ticks. Pure: no file, no clock.

    A further incident inside an open window extends it instead of starting a second one: a ramp that ends
    in FAULT is one incident. An emergency stop gives the incident its name."""

    def __init__(self, before: int = BEFORE_TICKS, after: int = AFTER_TICKS) -> None:
        self._before, self._after = before, after
        self._kept: np.ndarray | None = None
        self._events: list[Event] = []
        self._trigger: Event | None = None
        self._parts: list[np.ndarray] = []
        self._left = 0

    def feed(self, rows: np.ndarray, events: list[Event]) -> list[Incident]:
        """Take the next ticks, in order, and their events; returns the incidents that are complete."""
        if len(rows) == 0:
            return []
        # bounded: an incident takes those of its own ticks, MOST_TICKS at most
        self._events = (self._events + events)[-1000:]
        done: list[Incident] = []
        at = 0
        for event in filter(is_incident, events):
            # ticks rise, and slots may be missing
            i = int(np.searchsorted(rows["tick"], event["tick"]))
            done += self._take(rows[at:i])
            if self._trigger is None:
                self._trigger, self._parts = event, [self._history(rows[:i])]
            elif event["to"] == "ESTOP":  # what it brought with it, a dying supply say, is not its name
                self._trigger = event
            self._parts.append(rows[max(at, i) : i + 1])
            at, self._left = i + 1, self._after
        done += self._take(rows[at:])
        # last: what lies before the next batch ends with this one
        self._kept = self._history(rows)
        return done

    def flush(self, trigger: Event | None = None) -> list[Incident]:
        """End of the run: what is open as it is; with `trigger`, the last ticks as an incident of their
        own."""
        if self._trigger is None and trigger is not None and self._kept is not None:
            self._trigger, self._parts = trigger, [self._kept]
            self._events.append(trigger)
        return [] if self._trigger is None else [self._finish()]

    def _take(self, rows: np.ndarray) -> list[Incident]:
        """Let the open window have these rows; returns it when that completes it."""
        if self._trigger is None:
            return []
        more = rows[: self._left]
        self._parts.append(more)
        self._left -= len(more)
        # a fault that chatters starts `_left` anew each time
        full = self._left == 0 or sum(map(len, self._parts)) >= MOST_TICKS
        return [self._finish()] if full else []

    def _history(self, rows: np.ndarray) -> np.ndarray:
        """The last `before` ticks up to the end of `rows`, copied."""
        # copied: a view would keep the whole batch
        if len(rows) >= self._before or self._kept is None:
            return copied(rows[max(0, len(rows) - self._before) :])
        return joined((self._kept, rows))[-self._before :]

    def _finish(self) -> Incident:
        assert self._trigger is not None
        ticks = joined(self._parts)
        first, last = (int(ticks["tick"][0]), int(ticks["tick"][-1])) if len(ticks) else (0, 0)
        inside = [e for e in self._events if first <= e["tick"] <= last or e is self._trigger]
        incident = Incident(self._trigger, ticks, inside)
        self._trigger, self._parts = None, []
        return incident


def write_incident(folder: Path, incident: Incident) -> Path:
    """Write one file, whole or not at all, and remove the oldest ones above the limits. Raises OSError."""
    folder.mkdir(mode=0o750, parents=True, exist_ok=True)
    path = folder / incident.name
    part = path.with_suffix(".part")
    body = {"about": incident.about, "trigger": incident.trigger, "events": incident.events}
    columns: dict[str, Any] = {name: incident.ticks[name] for name in incident.ticks.dtype.names or ()}
    try:
        with part.open("wb") as file:
            # an open file: to a name NumPy would add .npz, and the rename would miss it
            np.savez_compressed(file, incident=np.array(json.dumps(body)), **columns)
            file.flush()
            # before the rename: a name that stands for a whole file must not come to the disk first
            os.fsync(file.fileno())
        part.replace(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise
    prune(folder, path.name)
    return path


def prune(folder: Path, written: str, files: int = KEPT_FILES, size: int = KEPT_BYTES) -> None:
    """Remove the oldest incidents until at most `files` and `size` bytes are left, and a crash's leftovers.

    Names begin with the time of a clock that may have been set. What is dated after the one that was
    `written` last is older all the same: a machine that wakes up in 2000 keeps what happens then."""
    # by this process alone: a rig's state folder has one daemon (`wire.endpoints.kept_alone`)
    for leftover in folder.glob("*.part"):
        leftover.unlink(missing_ok=True)
    total = 0
    newest_first = sorted(folder.glob("*.npz"), key=lambda at: (at.name <= written, at.name), reverse=True)
    for k, path in enumerate(newest_first):
        total += path.stat().st_size
        if k >= files or (k and total > size):  # the newest one stays, however long it is
            path.unlink(missing_ok=True)


def read_incident(path: Path) -> Incident:
    """Read a file of `write_incident`. Raises DataError for anything else."""
    try:
        with opened(path) as file:
            archive = read_arrays(file, MOST_BYTES)
        body = json_of(str(archive["incident"]))
        n_axes = archive["position_rad"].shape[1]
        if not 1 <= n_axes <= MOST_AXES:
            raise ValueError(f"{n_axes} axes")
        n, kind = len(archive["tick"]), tick_dtype(n_axes)
        # a column of bytes has a hundredth of the ticks that would be made of it
        if n * kind.itemsize > MOST_BYTES:
            raise ValueError(f"{n} ticks")
        ticks = np.zeros(n, kind)
        # of an older version: of fields that it lacks the ticks say nothing
        forget(ticks, ticks.dtype.names or ())
        for name in archive.keys() & set(ticks.dtype.names or ()):
            ticks[name] = archive[name]
        return Incident(dict(body["trigger"]), ticks, list(body["events"]), dict(body["about"]))
    except OSError as error:
        raise DataError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (KeyError, ValueError, IndexError, TypeError) as error:
        raise DataError(f"{path}: not an incident file of rtctl ({shown(error)})") from error
