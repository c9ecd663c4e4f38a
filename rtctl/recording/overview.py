"""What stands in a recording, counted in one pass."""

from __future__ import annotations

from typing import Any

import numpy as np

from hw.outside import json_of
from rtctl.control.vocabulary import State
from rtctl.errors import DataError
from rtctl.recording.facts import texts
from rtctl.recording.reader import RecordingReader


def overview(reader: RecordingReader) -> dict[str, Any]:
    """Counts and extremes of a recording, ready for JSON.

    `lost` counts ticks that the loop recorded and the file does not have; `missed` slots of the time grid
    in which the loop did not run.
    """
    ticks = lost = missed = late = 0
    first = last = 0
    states: dict[str, int] = {}
    faults, waiver, expected, slot = 0, False, None, None
    commands = 0
    events: dict[str, int] = {}
    for batch in reader.batches():
        commands += len(batch.commands)
        for event in batch.events:
            events[event["event"]] = events.get(event["event"], 0) + 1
        rows, numbers = batch.rows, batch.numbers
        if len(rows) == 0:
            continue
        if expected is None:
            expected, slot, first = int(numbers[0]), int(rows["tick"][0]), int(rows["tick"][0])
            late = expected
        lost += int(numbers[-1]) - expected + 1 - len(rows)
        missed += int(rows["tick"][-1]) - int(slot or 0) - (int(numbers[-1]) - expected)
        expected, slot, last = int(numbers[-1]) + 1, int(rows["tick"][-1]) + 1, int(rows["tick"][-1])
        ticks += len(rows)
        for state, count in zip(*np.unique(rows["state"], return_counts=True), strict=True):
            name = _state(int(state))
            states[name] = states.get(name, 0) + int(count)
        faults |= int(np.bitwise_or.reduce(rows["faults"]))
        waiver = waiver or bool(rows["waiver"].any())
    period_s = int(reader.about["period_ns"]) * 1e-9
    return {
        "files": [str(part) for part in reader.parts],
        "left_out": {str(part): why for part, why in reader.left_out.items()},
        "damaged": reader.notes,
        "bytes": sum(part.stat().st_size for part in reader.parts),
        "about": {k: v for k, v in reader.about.items() if k not in ("realtime", "axes", "realtime_waivers")},
        "axes": reader.axes,
        "realtime": _realtime(reader.about.get("realtime", "[]")),
        "realtime_waivers": texts(reader.about, "realtime_waivers"),
        "waiver": waiver,
        "ticks": ticks,
        "duration_s": ticks * period_s,
        "first_tick": first,
        "last_tick": last,
        "before_recording": late,
        "lost": lost,
        "missed": missed,
        "states_s": {name: count * period_s for name, count in states.items()},
        "faults": _names(faults),
        "events": events,
        "commands": commands,
        "attachments": {name: len(data) for name, data in reader.attachments.items()},
        "cut_off": [str(part) for part in reader.cut],
        "whole_chunks": reader.whole_chunks,
        "bad_chunks": reader.bad_chunks,
        "ends": {part.name: end for part, end in reader.ends.items()},
        "replayable": reader.from_start or _has_state(reader),
    }


def _state(number: int) -> str:
    try:
        return State(number).name
    except ValueError:
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


def _names(bits: int) -> list[str]:
    from rtctl.control.vocabulary import Fault

    known = {int(fault): str(fault.name) for fault in Fault}
    return [known.get(1 << k, f"BIT_{k}") for k in range(bits.bit_length()) if bits >> k & 1]
