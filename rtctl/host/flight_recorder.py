"""Keeps what happened: the event log, and the ticks around each incident. Written by a thread of its own.

The host's poller hands over events and finished incidents through a bounded queue and never waits for
the disk; what does not fit into the queue is counted. A full or missing disk breaks the log, not the run,
and the newest incidents that it refused are written once it has room."""

from __future__ import annotations

import math
import os
import queue
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.host.exchange.device_words import DeviceWords
from rtctl.host.exchange.events import EventDetector
from rtctl.host.exchange.friction_watch import FrictionWatch
from rtctl.host.exchange.late_watch import LateWatch
from rtctl.host.exchange.rig_description import RigDescription
from rtctl.host.exchange.timing_watch import EVENT, timing_of
from rtctl.host.repeated_events import ChatterFilter
from rtctl.recording.event_log import Event, EventLog, last_event
from rtctl.recording.incident import FOLDER, Capture, Incident, write_incident
from rtctl.rig_file import measured_timing as timing

STATE = ("zero of the force", "state of the friction")
TIMING = "measured timing"
"""What the next run is told by this one."""

QUEUE_ITEMS = 256
MOST_UNWRITTEN = 4
"""Incidents that the disk refused, kept until it has room: .2 MB each, of eight axes at most 7."""
RETRY_S = 1.0
END_S = 2.0
"""Longest wait for the disk at the end of a run."""

Task = Callable[[], None]
"""Writes something; may raise OSError, which is nobody's loss but its own."""

_Item = list[Event] | Incident | tuple[str, Task] | None


class FlightRecorder:
    """Event log and incidents of one run.

    Parameters
    ----------
    folder
        The rig's state folder (`rtctl.recording.state_folder`); made when it does not exist.
    rig
        Facts of the rig, with the session.
    words
        What the devices say.
    friction
        The watch over the friction; None: there is none."""

    def __init__(
        self,
        folder: Path,
        rig: RigDescription,
        words: DeviceWords | None = None,
        friction: FrictionWatch | None = None,
    ) -> None:
        self.folder = folder
        self._rig = rig
        self._about = {
            "rig": rig.name,
            "session": rig.session,
            "version": rig.version,
            "config_sha256": rig.config_sha256,
            "rate_hz": rig.rate_hz,
            "axes": [axis.name for axis in rig.axes],
            "motion": rig.motions,
            "start_wall_ns": rig.start_wall_ns,
        }
        self._detector = EventDetector(rig, words, friction)
        self._chatter = ChatterFilter()
        self._capture = Capture()
        # opens nothing yet: the first write is the thread's, which may wait for the disk
        self._log = EventLog(folder)
        self._queue: queue.Queue[_Item] = queue.Queue(QUEUE_ITEMS)
        self._last: Event = {"tick": -1, "epoch": 0}
        # a virtual clock begins at 0; until the first tick there is no other time for `started`
        self._time_ns = 0 if rig.virtual else time.monotonic_ns()
        self._crowded = self._incidents = self._incidents_lost = 0
        self._incident_error: str | None = None
        self._unwritten: deque[Incident] = deque()
        self._retry_at_s = 0.0
        self.state_broken: dict[str, str | None] = dict.fromkeys((*STATE, TIMING))
        before = last_event(folder)
        self.cut_off: float | None = None
        """When the last event of the run before happened, s since 1970, if that run told no end."""
        if before is not None and before.get("event") != "ended":
            last_s = before.get("timestamp")
            self.cut_off = float(last_s) if isinstance(last_s, int | float) else math.nan
        self._put([self._event("started", pid=os.getpid(), cut_off=self.cut_off, **self._about)])
        # daemon: a write that hangs in the kernel must not keep the process
        self._thread = threading.Thread(target=self._work, name="flight-recorder", daemon=True)
        # after the first event was put: the log begins with `started` whatever comes at once
        self._thread.start()

    def observe(self, rows: np.ndarray) -> list[Event]:
        """Take the next ticks, in order; returns their events. Never waits."""
        if len(rows) == 0:
            return []
        # filtered before incidents are cut, so that file and log tell the same events
        events = self._chatter(self._detector.detect(rows))
        self._time_ns = int(rows["time_ns"][-1])
        self._last = {"tick": int(rows["tick"][-1]), "epoch": int(rows["epoch"][-1])}
        self._put(events)
        for incident in self._capture.feed(rows, events):
            self._put(incident)
        return events

    def set_late(self, watch: LateWatch) -> None:
        """Keep the events of the watch over late ticks too."""
        self._detector.late.watch = watch

    def later(self, what: str, task: Task) -> None:
        """Have the thread do what may wait for the disk: `what` of STATE is written. Left out where the queue
        is full: it is asked again."""
        with suppress(queue.Full):
            self._queue.put_nowait((what, task))

    def status(self) -> dict[str, Any]:
        """How the log is doing, for `health` and the closing summary.

        `broken` is None, or why events or incidents could last not be written."""
        return {
            "folder": str(self.folder),
            "broken": self.broken or next(filter(None, self.state_broken.values()), None),
            "written": self._log.written,
            "dropped": self._log.dropped + self._crowded,
            "incidents": self._incidents,
            "incidents_lost": self._incidents_lost + len(self._unwritten),
        }

    @property
    def broken(self) -> str | None:
        """Why events or incidents could last not be written."""
        return self._log.broken or self._incident_error

    def close(self, error: BaseException | None = None) -> None:
        """Write what is left and end; `error` is why the run ended, when it did not end by itself.
        Idempotent."""
        if not self._thread.is_alive():
            return
        cause = "" if error is None else f"{type(error).__name__}: {error}".rstrip(": ")
        ended = self._event("ended", cause=cause)
        # Ctrl-C is how a run is ended, and no incident
        died = None if error is None or isinstance(error, KeyboardInterrupt) else ended
        for incident in self._capture.flush(died):
            self._put(incident)
        # before `ended`, which is the last line of a run
        self._put([{**self._event(""), **rest} for rest in self._chatter.flush()])
        self._put([ended])
        try:
            self._queue.put(None, timeout=END_S)
        except queue.Full:
            return  # a disk that hangs: the thread ends with the process
        self._thread.join(END_S)

    def _event(self, kind: str, **more: object) -> Event:
        return {
            "timestamp": (self._time_ns + self._rig.start_wall_ns) * 1e-9,
            "monotonic_s": self._time_ns * 1e-9,
            "session": self._rig.session,
            **self._last,
            "event": kind,
            **more,
        }

    def _put(self, item: list[Event] | Incident) -> None:
        if not item:
            return
        try:
            self._queue.put_nowait(item)
        except queue.Full:
            if isinstance(item, Incident):
                self._incidents_lost += 1
            else:
                self._crowded += len(item)

    def _work(self) -> None:
        while (item := self._next()) is not None:
            if isinstance(item, Incident):
                self._unwritten.append(item)
                self._write_incidents()
            elif isinstance(item, tuple):
                self._keep_state(*item)
            else:
                self._log.append(item)
                self._keep_timing(item)
        self._write_incidents()
        self._log.close()

    def _next(self) -> _Item:
        """The next item. Meanwhile incidents that the disk refused are tried again, every `RETRY_S`."""
        while self._unwritten:
            with suppress(queue.Empty):
                return self._queue.get(timeout=max(0.0, self._retry_at_s - time.monotonic()))
            self._write_incidents()
        return self._queue.get()

    def _keep_state(self, what: str, task: Task) -> None:
        why = None
        try:
            task()
        except OSError as error:
            why = f"{self.folder}: {error.strerror or error}"
        except ValueError as error:  # a number that is none: what was kept before stays
            why = f"{self.folder}: {error}"
        self.state_broken[what] = why

    def _keep_timing(self, events: list[Event]) -> None:
        """What test pulses measured, for `rtctl check` and the next run; the log has it too when the disk
        fails."""
        axes = {}
        for event in events:
            if event["event"] == EVENT:
                date = datetime.fromtimestamp(event["timestamp"], UTC).isoformat(timespec="seconds")
                found = timing_of(event, date)
                if found is not None:
                    # of several test pulses in one batch the last one counts
                    axes[str(event["axis"])] = found
        if axes:
            self._keep_state(TIMING, lambda: timing.write(self.folder, self._rig.devices_sha256, axes))

    def _write_incidents(self) -> None:
        """Write the incidents that wait, the oldest first, as far as the disk takes them."""
        while self._unwritten and self._write(self._unwritten[0]):
            self._unwritten.popleft()
        self._retry_at_s = time.monotonic() + RETRY_S
        while len(self._unwritten) > MOST_UNWRITTEN:
            self._unwritten.popleft()
            self._incidents_lost += 1

    def _write(self, incident: Incident) -> bool:
        incident.about = self._about
        try:
            path = write_incident(self.folder / FOLDER, incident)
        except OSError as error:
            self._incident_error = f"{self.folder / FOLDER}: {error.strerror or error}"
            return False
        # counted by this thread alone: `status` reads a number that is whole at any time
        self._incidents += 1
        self._incident_error = None
        same = {  # the trigger's time, not that of the writing: the log's line and the file can be joined
            name: incident.trigger[name] for name in ("timestamp", "monotonic_s", "session", "tick", "epoch")
        }
        self._log.append([{**same, "event": "incident", "file": str(path), "ticks": len(incident.ticks)}])
        return True
