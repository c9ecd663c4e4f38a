"""Faults by name, for people and programs. The rows are `rtctl.control.faults.TABLE`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rtctl.control.faults import ROW
from rtctl.control.vocabulary import Fault, State
from rtctl.wire.fault_words import PLACE, Entry

FAULT_TEXT: dict[Fault, str] = {fault: row.text for fault, row in ROW.items()}


def fault_entries(bits: int) -> list[dict[str, str]]:
    """`name` and `text` of every fault in `bits`, lowest bit first; unknown bits are named by number."""
    entries = []
    # all bits, those of a later daemon, too: a fault that is not named is not left out
    for number in range(bits.bit_length()):
        if bits >> number & 1:
            fault = Fault(1 << number)
            known = fault in FAULT_TEXT
            name = fault.name if known and fault.name else f"BIT_{number}"
            entries.append(
                {"name": name, "text": FAULT_TEXT[fault] if known else "a fault this version does not name"}
            )
    return entries


def cause_bit(state: int, fault_first: int) -> int:
    """Bit of the fault that a rig stands still for: ESTOP in ESTOP, whatever was latched before; 0 for
    none."""
    if state == State.ESTOP:
        return int(Fault.ESTOP)
    return 1 << fault_first if fault_first >= 0 else 0


class FaultPlaces:
    """For who listens: where faults come from, as events and health have told it."""

    def __init__(self) -> None:
        self._told: dict[str, Mapping[str, Any]] = {}  # name -> what was told last

    def take_event(self, event: Mapping[str, Any]) -> None:
        """Take in one event; only faults count."""
        # `fault_cleared` bears its place as well, and is no news of it
        if event.get("event") == "fault":
            self._told[event["name"]] = event

    def take_health(self, health: Mapping[str, Any]) -> None:
        """Take in a health message: it tells of faults that were there before one listened."""
        cause = health.get("cause")
        for entry in [*health.get("faults", []), *([cause] if cause else [])]:
            self._told[entry["name"]] = entry

    def entries(self, bits: int) -> list[Entry]:
        """Every fault in `bits` with its place, as far as that has been told."""
        return [
            # name and text are this version's, the place is what the daemon told
            {**entry, **{key: self._told.get(entry["name"], {}).get(key) for key in PLACE}}
            for entry in fault_entries(bits)
        ]

    def cause(self, state: int, fault_first: int) -> Entry | None:
        """What the rig stands still for: the emergency stop in ESTOP, else the latched first cause."""
        bit = cause_bit(state, fault_first)
        # of one bit there is one entry
        return self.entries(bit)[0] if bit else None
