"""Faults by name, for people and programs. The rows are `rtctl.control.faults.TABLE`."""

from __future__ import annotations

from rtctl.control.faults import ROW
from rtctl.control.vocabulary import Fault

FAULT_TEXT: dict[Fault, str] = {fault: row.text for fault, row in ROW.items()}


def fault_entries(bits: int) -> list[dict[str, str]]:
    """`name` and `text` of every fault in `bits`, lowest bit first; unknown bits are named by number."""
    entries = []
    for number in range(bits.bit_length()):
        if bits >> number & 1:
            fault = Fault(1 << number)
            known = fault in FAULT_TEXT
            name = fault.name if known and fault.name else f"BIT_{number}"
            entries.append(
                {"name": name, "text": FAULT_TEXT[fault] if known else "a fault this version does not name"}
            )
    return entries
