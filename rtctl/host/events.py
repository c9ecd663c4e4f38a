"""Events from ticks: one per change of state, one per fault that appears or goes."""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.control.vocabulary import State
from rtctl.host.description import RigDescription
from rtctl.host.faults import fault_entries


class EventDetector:
    """Compares every tick with the one before, over all calls. Starts from INIT without faults."""

    def __init__(self, rig: RigDescription) -> None:
        self._rig = rig
        self._state = int(State.INIT)
        self._faults = 0
        self._sequence = 0

    def detect(self, rows: np.ndarray) -> list[dict[str, Any]]:
        """Events of these ticks in order; faults come before the change of state they cause."""
        if len(rows) == 0:
            return []
        states, faults = rows["state"], rows["faults"]
        state_before = np.concatenate((np.array([self._state], states.dtype), states[:-1]))
        faults_before = np.concatenate((np.array([self._faults], faults.dtype), faults[:-1]))
        changed = np.flatnonzero((states != state_before) | (faults != faults_before))
        self._state, self._faults = int(states[-1]), int(faults[-1])
        events: list[dict[str, Any]] = []
        for i in changed:
            now, before = int(faults[i]), int(faults_before[i])
            first = int(rows["fault_first"][i])
            first_name = fault_entries(1 << first)[0]["name"] if first >= 0 else ""
            events += [
                self._event(rows[i], "fault", {**entry, "first_cause": entry["name"] == first_name})
                for entry in fault_entries(now & ~before)
            ]
            events += [self._event(rows[i], "fault_cleared", entry) for entry in fault_entries(before & ~now)]
            if states[i] != state_before[i]:
                names = {"from": State(int(state_before[i])).name, "to": State(int(states[i])).name}
                events.append(self._event(rows[i], "state", names))
        return events

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
        self._sequence += 1
        return event
