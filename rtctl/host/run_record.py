"""What the host keeps of a run: event log, incidents, commands in force, and a recording if the rig file
asks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from rtctl.host.command_trace import CommandTrace
from rtctl.host.exchange.device_words import DeviceWords
from rtctl.host.exchange.force_zero import ForceZero
from rtctl.host.exchange.friction_watch import FrictionWatch
from rtctl.host.exchange.rig_description import RigDescription
from rtctl.host.exchange.samples import tick_columns
from rtctl.host.exchange.streams import Telemetry
from rtctl.host.exchange.veiled_leases import veil_leases
from rtctl.host.flight_recorder import STATE, FlightRecorder
from rtctl.recording.event_log import Event
from rtctl.recording.law_arrays import LawArrays
from rtctl.recording.limits import Limits
from rtctl.recording.recorder import Recorder
from rtctl.recording.setup import Setup
from rtctl.recording.shadow import ShadowLaw
from rtctl.recording.state_folder import recording_folder, state_folder
from rtctl.rig_file.config import LoadedConfig
from rtctl.rig_file.host_tables import RecordTable
from rtctl.rt.shared_memory import CommandWriter


class RunRecord:
    """Hands every batch of ticks to those who keep it. Never waits for a disk (on a wall clock).

    Parameters
    ----------
    arrays
        The law's arrays at the start of the run.
    record_to
        Folder of a recording, whatever the rig file says; None: as it says.
    words
        What the devices say.
    friction
        The watch over the friction, which is kept from run to run; None: there is none.
    zero
        The zero of the force sensor, likewise."""

    def __init__(
        self,
        loaded: LoadedConfig,
        rig: RigDescription,
        arrays: LawArrays,
        writer: CommandWriter,
        telemetry: Telemetry,
        record_to: Path | None = None,
        words: DeviceWords | None = None,
        friction: FrictionWatch | None = None,
        zero: ForceZero | None = None,
    ) -> None:
        self.rig = rig
        self._telemetry = telemetry
        self._trace = CommandTrace(writer, rig.n_axes)
        self._shadow = ShadowLaw(arrays, rig.n_axes)
        self._setup: dict[str, Any] = {}
        # who asked for a recording gets one, also where the rig file has no [record]
        self._table = RecordTable() if record_to is not None else loaded.config.record
        self._folder = record_to or recording_folder(loaded)
        self._friction, self._zero = friction, zero
        # always: events are few, and nobody knows beforehand which run will be asked about
        self.flight = FlightRecorder(state_folder(rig.name), rig, words, friction)
        self.recorder: Recorder | None = None
        telemetry.log = self.flight.status

    def begin(self, setup: Setup) -> None:
        """Before the first batch: tell clients what they would record, and record if asked to."""
        self._setup = setup.packed()
        self._telemetry.setup = self._message
        if self._table is not None:
            self.recorder = Recorder(self._folder, setup, Limits.of(self._table), wait=self.rig.virtual)
            self._telemetry.recording = self.recorder.status

    def keep(self, first_row: int, rows: np.ndarray) -> list[Event]:
        """Log events, record ticks, tell clients of commands; before the ticks themselves are published.

        `first_row` numbers the first tick among all the loop recorded. Returns the events of these ticks."""
        commands = self._trace.take(rows)
        self._telemetry.publish_commands(commands)
        events = self.flight.observe(rows)
        if self.recorder is not None:
            # a state of another row would start a replay wrong: then there is none
            state = self._shadow.state() if self._shadow.next_row == first_row else None
            self.recorder.observe(first_row, rows, events, commands, self._trace.lost, state)
        # after the recorder, which needed the state before these rows
        self._shadow.follow(first_row, rows, commands)
        if len(rows):
            if self._zero is not None:
                self._zero.follow(self._shadow.known)
            self._keep_for_next(int(rows["time_ns"][-1]))
        return events

    def _keep_for_next(self, now_ns: int | None = None) -> None:
        tasks = [
            None if self._zero is None else self._zero.to_keep(now_ns),
            None if self._friction is None else self._friction.to_keep(now_ns),
        ]
        for what, task in zip(STATE, tasks, strict=True):
            if task is not None:
                self.flight.later(what, task)

    def _message(self) -> dict[str, Any]:
        """For `rtctl/setup`: the setup, the command in force, and the law's state before the next tick."""
        state, newest = self._shadow.state(), self._trace.newest
        return {
            **self._setup,
            "command": tick_columns(veil_leases(newest, "target_lease")) if len(newest) else {},
            "state": {} if state is None else tick_columns(veil_leases(state, "lease")),
            "state_row": self._shadow.next_row,
        }

    def summary(self) -> dict[str, Any]:
        """For the closing summary: `log`, `recording` (None without one), and whether the law gave all of it
        again."""
        return {
            "log": self.flight.status(),
            "recording": None if self.recorder is None else self.recorder.status(),
            "replayable": self._shadow.why or "yes",
        }

    def broken(self) -> dict[str, str | None]:
        """Why the disk refuses the event log, what the next run is told, or the recording; None for each that
        it takes."""
        kept = {"event log": self.flight.broken, **self.flight.state_broken}
        if self.recorder is not None:
            kept["recording"] = self.recorder.broken
        return kept

    def finish(self) -> None:
        """After the last batch: let the disk take what is queued, so that the summary is final."""
        if self.recorder is not None:
            self.recorder.close("the run ended")

    def close(self, error: BaseException | None = None) -> None:
        """End everything. Idempotent."""
        if self.recorder is not None:
            self.recorder.close("" if error is None else f"{type(error).__name__}: {error}")
        # without a time: at the end nothing waits for its turn
        self._keep_for_next()
        self.flight.close(error)
