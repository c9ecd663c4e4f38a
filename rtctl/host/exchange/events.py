"""Events from ticks: one per change of state, one per fault or warning that appears or goes, and devices'
words."""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.control.vocabulary import State
from rtctl.host.exchange.device_words import DeviceWords, Voice
from rtctl.host.exchange.fault_book import FaultBook
from rtctl.host.exchange.friction_watch import FrictionNews, FrictionWatch
from rtctl.host.exchange.late_watch import LateNews
from rtctl.host.exchange.motor_temperature import TemperatureWatch
from rtctl.host.exchange.rig_description import RigDescription
from rtctl.host.exchange.timing_watch import EVENT, TimingWatch
from rtctl.wire.fault_names import cause_bit, fault_entries

_STOPPED = (State.STOPPING, State.FAULT, State.ESTOP, State.LOCKOUT)
_CAUSE: dict[tuple[State, State], str] = {
    (State.INIT, State.IDLE): "started",
    (State.IDLE, State.ARMING): "arm request",
    (State.ARMING, State.ACTIVE): "arming passed",
    (State.ACTIVE, State.HOLD): "targets too old",
    (State.HOLD, State.ACTIVE): "targets are back",
    (State.FAULT, State.IDLE): "reset request",
    (State.ESTOP, State.IDLE): "reset request",
    (State.STOPPING, State.IDLE): "ramp finished",
    (State.STOPPING, State.SHUTDOWN): "ramp finished",
}
# in ARMING, ACTIVE and HOLD alike: the table of states has one event for each of them
_REQUEST = {State.STOPPING: "stop or shutdown request", State.SHUTDOWN: "shutdown request"}


def _transition(row: np.void, before: State, after: State) -> dict[str, Any]:
    """From, to and cause of a change of state; `fault` names the fault behind it, None for none."""
    fault = _fault_behind(row) if after in _STOPPED else None
    cause = fault or _CAUSE.get((before, after)) or _REQUEST.get(after, "")
    return {
        "from": before.name,
        "to": after.name,
        "cause": cause,
        "fault": fault,
        "command_seq": int(row["command_seq"]),
    }


def _fault_behind(row: np.void) -> str | None:
    """The emergency stop in ESTOP; else the latched first cause, or the lowest fault present, or None."""
    bits = cause_bit(int(row["state"]), int(row["fault_first"])) or int(row["faults"])
    return fault_entries(bits)[0]["name"] if bits else None


class WordsWatch:
    """Tells when a device begins to complain, says something else of it, or is content again."""

    def __init__(self, words: DeviceWords) -> None:
        self._words = words
        self._heard = 0
        self._before: dict[tuple[str, str | None], Voice] = {}

    def changes(self) -> list[tuple[str, dict[str, Any]]]:
        """Kind (`device`) and content of what changed since the last call."""
        told: list[tuple[str, dict[str, Any]]] = []
        for one in self._words.since(self._heard):
            self._heard = one.number
            for voice in one.voices:
                before = self._before.get((voice.device, voice.axis))
                # kept whether told or not: the next word is compared with the last one, not with the last
                # told
                self._before[voice.device, voice.axis] = voice
                # also the word that follows a complaint: without it nothing would say that the device is
                # content again
                if voice != before and (voice.complains or (before is not None and before.complains)):
                    told.append(("device", voice.as_dict()))
        return told


class EventDetector:
    """Compares every tick with the one before, over all calls. Starts from INIT without faults.

    Attributes
    ----------
    book : FaultBook
        Where each fault came from.
    late : LateNews
        Of the watch over late ticks, once there is one.
    temperature : TemperatureWatch
        Over the motors."""

    def __init__(
        self, rig: RigDescription, words: DeviceWords | None = None, friction: FrictionWatch | None = None
    ) -> None:
        self._rig = rig
        self.book = FaultBook(rig, words)
        self._friction = FrictionNews(friction)
        self.late = LateNews()
        self._words = WordsWatch(self.book.words)
        self._state = int(State.INIT)
        self._faults = 0
        self._sequence = 0
        self.temperature = TemperatureWatch(rig)
        self._timing = TimingWatch(rig)

    def detect(self, rows: np.ndarray) -> list[dict[str, Any]]:
        """Events of these ticks in order; faults come before the change of state they cause.

        What a test pulse measured, devices' words and warnings come last: slow things, as of the newest tick.
        """
        if len(rows) == 0:
            return []
        self.book.follow(rows)
        states, faults = rows["state"], rows["faults"]
        # over the edge of two batches: a change between them is none of either alone
        state_before = np.concatenate((np.array([self._state], states.dtype), states[:-1]))
        faults_before = np.concatenate((np.array([self._faults], faults.dtype), faults[:-1]))
        changed = np.flatnonzero((states != state_before) | (faults != faults_before))
        self._state, self._faults = int(states[-1]), int(faults[-1])
        events: list[dict[str, Any]] = []
        for i in changed:
            now, before = int(faults[i]), int(faults_before[i])
            first = int(rows["fault_first"][i])
            # -1: nothing is latched
            first_name = fault_entries(1 << first)[0]["name"] if first >= 0 else ""
            events += [
                self._event(rows[i], "fault", {**entry, "first_cause": entry["name"] == first_name})
                for entry in self.book.entries(now & ~before)
            ]
            events += [
                self._event(rows[i], "fault_cleared", entry) for entry in self.book.entries(before & ~now)
            ]
            if states[i] != state_before[i]:
                before_after = State(int(state_before[i])), State(int(states[i]))
                events.append(self._event(rows[i], "state", _transition(rows[i], *before_after)))
        events += [self._event(rows[i], EVENT, more) for i, more in self._timing.changes(rows)]
        slow = [
            *self._words.changes(),
            *self.temperature.changes(rows[-1]),
            *self._friction.changes(),
            *self.late.changes(),
        ]
        return events + [self._event(rows[-1], kind, more) for kind, more in slow]

    def _event(self, row: np.void, kind: str, more: dict[str, Any]) -> dict[str, Any]:
        loop_ns = int(row["time_ns"])
        event = {
            "timestamp": (loop_ns + self._rig.start_wall_ns) * 1e-9,
            "monotonic_s": loop_ns * 1e-9,
            "session": self._rig.session,
            "sequence": self._sequence,
            "tick": int(row["tick"]),
            "epoch": int(row["epoch"]),
            "event": kind,
            **more,
        }
        # clients tell by it what they have missed
        self._sequence += 1
        return event
