"""Parts of the documents that come from the code: between `<!-- name -->` and `<!-- end name -->`."""

from __future__ import annotations

import re
from collections.abc import Callable

from hw import fault_kinds
from rtctl import tick
from rtctl.control import faults, states
from rtctl.control.environments import table as environments
from rtctl.control.vocabulary import Fault, State
from rtctl.friction import point_columns
from rtctl.friction.kinds import table as friction_kinds
from tests.documents import client_reference, rig_file_keys


def _fault_bits() -> str:
    names = ", ".join(f"{fault.value.bit_length() - 1} `{fault.name}`" for fault in Fault)
    return f"Faults, as bit numbers: {names}.\n"


def _state_numbers() -> str:
    return "States: " + ", ".join(f"{state.value} `{state.name}`" for state in State) + ".\n"


def _environment_keys() -> str:
    names = ", ".join(f"`{name}`" for name in environments.NAMES)
    rows = [
        "| key | type | unit | bounds | |",
        "|---|---|---|---|---|",
        "| `axis` | text or integer | | a name, or 0 to axes - 1 | required |",
        f"| `kind` | text | | {names} (`remote` while armed: targets are awaited for 100 ticks from here on) | required |",
        *(
            f"| `{one.name}` | integer | | 1 or -1 | {environments.meaning(one)} |"
            if one.sign
            else f"| `{one.name}` | number | {one.unit} | `hello` | {environments.meaning(one)} |"
            for one in environments.PARAMETERS
        ),
        "| `lease` | text | | 16 hexadecimal digits | required of a renderer |",
    ]
    return "\n".join(rows) + "\n"


PARTS: dict[str, Callable[[], str]] = {
    "tick fields": tick.markdown_table,
    "faults": faults.markdown_table,
    "kinds of scripted faults": fault_kinds.markdown_table,
    "columns of points": point_columns.markdown_table,
    "rungs of the ladder": friction_kinds.markdown_table,
    "transitions": states.markdown_table,
    "fault bits": _fault_bits,
    "state numbers": _state_numbers,
    "environment numbers": environments.numbers,
    "environment keys": _environment_keys,
    "environment forces": environments.forces,
    "rig file keys": rig_file_keys.rig_file,
    "client reference": client_reference.reference,
    "device option keys": rig_file_keys.device_options,
}
"""What can stand between marks."""

_MARKED = re.compile(r"(<!-- (?P<name>[a-z ]+) -->\n).*?(<!-- end (?P=name) -->)", re.DOTALL)


def filled(text: str) -> str:
    """The document with every marked part written anew. Raises KeyError for a mark nobody writes."""
    return _MARKED.sub(lambda found: f"{found[1]}\n{PARTS[found['name']]()}\n{found[3]}", text)
