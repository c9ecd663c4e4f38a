"""Parts of the documents that come from the code: between `<!-- name -->` and `<!-- end name -->`."""

from __future__ import annotations

import re
from collections.abc import Callable

from hw import fault_kinds
from rtctl import api_document, config_document, tick
from rtctl.control import faults, states
from rtctl.control.vocabulary import Fault, State
from rtctl.friction.kinds import table as friction_kinds
from rtctl.friction.points import columns as point_columns


def _fault_bits() -> str:
    names = ", ".join(f"{fault.value.bit_length() - 1} `{fault.name}`" for fault in Fault)
    return f"Faults, as bit numbers: {names}.\n"


def _state_numbers() -> str:
    return "States: " + ", ".join(f"{state.value} `{state.name}`" for state in State) + ".\n"


PARTS: dict[str, Callable[[], str]] = {
    "tick fields": tick.markdown_table,
    "faults": faults.markdown_table,
    "kinds of scripted faults": fault_kinds.markdown_table,
    "columns of points": point_columns.markdown_table,
    "rungs of the ladder": friction_kinds.markdown_table,
    "transitions": states.markdown_table,
    "fault bits": _fault_bits,
    "state numbers": _state_numbers,
    "rig file keys": config_document.rig_file,
    "client reference": api_document.reference,
    "device option keys": config_document.device_options,
}
"""What can stand between marks."""

_MARKED = re.compile(r"(<!-- (?P<name>[a-z ]+) -->\n).*?(<!-- end (?P=name) -->)", re.DOTALL)


def filled(text: str) -> str:
    """The document with every marked part written anew. Raises KeyError for a mark nobody writes."""
    return _MARKED.sub(lambda found: f"{found[1]}\n{PARTS[found['name']]()}\n{found[3]}", text)
