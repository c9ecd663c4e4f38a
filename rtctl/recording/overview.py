"""What stands in a recording, counted in one pass."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hw.outside import json_of
from rtctl.control.vocabulary import State
from rtctl.errors import DataError
from rtctl.recording.facts import texts
from rtctl.recording.reader import Batch, RecordingReader


@dataclass
class _Counts:
    """Sums over the batches of a recording, in their order."""

    ticks: int = 0
    lost: int = 0
    missed: int = 0
    before: int = 0
    """Ticks of the loop before the recording began."""
    first: int = 0
    last: int = 0
    states: Counter[str] = field(default_factory=Counter)
    faults: int = 0
    waiver: bool = False
    commands: int = 0
    events: Counter[str] = field(default_factory=Counter)
    _next_number: int | None = None
    _next_slot: int = 0

    def add(self, batch: Batch) -> None:
        """Take a batch in."""
        # before the ticks: a chunk may have none, and events of its own
        self.commands += len(batch.commands)
        self.events.update(event["event"] for event in batch.events)
        rows, numbers = batch.rows, batch.numbers
        if len(rows) == 0:
            return
        if self._next_number is None:
            self._next_number, self._next_slot = int(numbers[0]), int(rows["tick"][0])
            # ticks are numbered from 0 in a run: what lies before the first was not recorded
            self.first, self.before = self._next_slot, self._next_number
        # within the batch and before it: numbers rise by one for each tick the loop made
        self.lost += int(numbers[-1]) - self._next_number + 1 - len(rows)
        # slots that passed, less the ticks that the loop numbered in them
        self.missed += int(rows["tick"][-1]) - self._next_slot - (int(numbers[-1]) - self._next_number)
        self.last = int(rows["tick"][-1])
        self._next_number, self._next_slot = int(numbers[-1]) + 1, self.last + 1
        self.ticks += len(rows)
        for state, count in zip(*np.unique(rows["state"], return_counts=True), strict=True):
            self.states[_state(int(state))] += int(count)
        # all that were present in any tick, latched or not
        self.faults |= int(np.bitwise_or.reduce(rows["faults"]))
        self.waiver = self.waiver or bool(rows["waiver"].any())


def overview(reader: RecordingReader) -> dict[str, Any]:
    """Counts and extremes of a recording, ready for JSON.

    `lost` counts ticks that the loop recorded and the file does not have; `missed` slots of the time grid
    in which the loop did not run."""
    seen = _Counts()
    for batch in reader.batches():
        seen.add(batch)
    # what the loop keeps to, in whole ns: 1 over a rate of 3 kHz is not quite that
    period_s = int(reader.about["period_ns"]) * 1e-9
    return {
        "files": [str(part) for part in reader.parts],
        "left_out": {str(part): why for part, why in reader.left_out.items()},
        "damaged": reader.notes,
        "not_recorded": reader.missing_fields(),
        "bytes": sum(part.stat().st_size for part in reader.parts),
        "about": {k: v for k, v in reader.about.items() if k not in ("realtime", "axes", "realtime_waivers")},
        "axes": reader.axes,
        "realtime": _realtime(reader.about.get("realtime", "[]")),
        "realtime_waivers": texts(reader.about, "realtime_waivers"),
        "waiver": seen.waiver,
        "ticks": seen.ticks,
        # of what is there: losses and missed slots are told by themselves
        "duration_s": seen.ticks * period_s,
        "first_tick": seen.first,
        "last_tick": seen.last,
        "before_recording": seen.before,
        "lost": seen.lost,
        "missed": seen.missed,
        "states_s": {name: count * period_s for name, count in seen.states.items()},
        "faults": names_of_faults(seen.faults),
        "events": dict(seen.events),
        "commands": seen.commands,
        "attachments": {name: len(data) for name, data in reader.attachments.items()},
        "cut_off": [str(part) for part in reader.cut],
        "whole_chunks": reader.whole_chunks,
        "bad_chunks": reader.bad_chunks,
        "ends": {part.name: end for part, end in reader.ends.items()},
        # from its begin or from a state that is told: else nobody knows what the law was doing
        "replayable": reader.from_start or _has_state(reader),
    }


def _state(number: int) -> str:
    try:
        return State(number).name
    except ValueError:
        # a state of a later version: counted all the same
        return f"STATE_{number}"


def _realtime(text: str) -> list[Any]:
    try:
        found = json_of(text)
    except ValueError:
        return []
    return found if isinstance(found, list) else []


def _has_state(reader: RecordingReader) -> bool:
    try:
        return "law.npz" in reader.attachments and reader.law().state is not None
    except DataError:
        return False


def names_of_faults(bits: int) -> list[str]:
    """Names of the faults in the field `faults`; `BIT_k` of one that this version does not know."""
    from rtctl.control.vocabulary import Fault

    known = {int(fault): str(fault.name) for fault in Fault}
    return [known.get(1 << k, f"BIT_{k}") for k in range(bits.bit_length()) if bits >> k & 1]
