"""Parts of the documents that come from the code: between `<!-- name -->` and `<!-- end name -->`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from enum import IntEnum, IntFlag

from hw.fault_kinds import KINDS
from hw.interface import LinkFault
from rtctl.control import faults
from rtctl.control.environments import table as environments
from rtctl.control.states import TRANSITIONS
from rtctl.control.vocabulary import Display, Fault, GateFlag, Program, ProgramFlag, State
from rtctl.friction import kind_table as friction_kinds
from rtctl.friction.point_columns import COLUMNS
from rtctl.tick import FIELDS
from tests.documents import client_reference, rig_file_keys


def _table(head: str, rows: Iterable[tuple[object, ...]]) -> str:
    """A table with these names, which `|` parts, over its columns."""
    names = head.split("|")
    lines = [" | ".join(map(str, row)) for row in (names, *rows)]
    lines = [f"| {line} |" for line in lines]
    return "\n".join([lines[0], f"|{'---|' * len(names)}", *lines[1:]]) + "\n"


def _tick_fields() -> str:
    rows = ((f"`{one.name}`", f"{one.kind} {one.shape}", one.unit, one.writer, one.meaning) for one in FIELDS)
    return _table("field|shape|unit|written by|meaning", rows)


def _faults() -> str:
    rows = (
        (f"`{one.name}`", one.reaction.name, one.within_ticks, one.detection, one.clears, one.text)
        for one in faults.TABLE
    )
    return _table("fault|reaction|within|detected by|cleared by|what to do", rows)


def _transitions() -> str:
    rows = (
        (", ".join(state.name for state in one.states), one.event.name, one.to.name, one.who, one.meaning)
        for one in TRANSITIONS
    )
    return _table("in|on|goes to|brought about by|meaning", rows)


def scripted_faults() -> str:
    """Every kind of fault that a script may have."""
    rows = []
    for (channel, name), kind in KINDS.items():
        given = "required" if kind.default is None else f"default {kind.default:g}"
        value = f"{kind.unit}, {kind.low:g} to {kind.high:g}, {given}" if kind.unit else ""
        rows.append((f"`{channel}`", f"`{name}`", kind.meaning, value))
    return _table("channel|kind|what happens while it is due|value", rows)


def _point_columns() -> str:
    rows = (
        (
            f"`{one.name}`",
            one.unit,
            f"{one.low:g} to {one.high:g}",
            "required" if one.required else "",
            one.meaning,
        )
        for one in COLUMNS.values()
    )
    return _table("column|unit|bounds||meaning", rows)


def rungs() -> str:
    """Every rung of the ladder of friction models."""
    rows = [(f"`{name}`", kind.what) for name, kind in friction_kinds.FORMULAS.items()]
    for name, kernel in friction_kinds.KERNELS.items():
        machines = ", ".join(f"`{machine}-{name}`" for machine in friction_kinds.MACHINES)
        rows.append((machines, f"support-vector regression, {kernel.what}"))
    rows.append((f"`{friction_kinds.MEAN.name}`", friction_kinds.MEAN.what))
    return _table("rung|what it is", rows)


def _fault_bits() -> str:
    names = ", ".join(f"{fault.value.bit_length() - 1} `{fault.name}`" for fault in Fault)
    return f"Faults, as bit numbers: {names}.\n"


def _state_numbers() -> str:
    return "States: " + ", ".join(f"{state.value} `{state.name}`" for state in State) + ".\n"


def _tick_numbers() -> str:
    def numbers(kinds: type[IntEnum]) -> str:
        return ", ".join(f"{one.value} `{one.name}`" for one in kinds)

    def bits(flags: type[IntFlag]) -> str:
        return ", ".join(f"{one.value.bit_length() - 1} `{one.name}`" for one in flags)

    rows = (
        ("`state`", "number", numbers(State)),
        ("`faults`", "bits", bits(Fault)),
        ("`fault_first`", "number", "of one of these bits; -1: none"),
        ("`link_faults`", "bits", bits(LinkFault)),
        ("`gate_flags`", "bits", bits(GateFlag)),
        ("`display_kind`", "number", numbers(Display)),
        ("`environment_kind`", "number", ", ".join(f"{k} `{k.word}`" for k in environments.Environment)),
        ("`program_kind`", "number", numbers(Program)),
        ("`program_flags`", "bits", bits(ProgramFlag)),
    )
    return _table("field||what its numbers, or the numbers of its bits, are called", rows)


def _environment_numbers() -> str:
    kinds = environments.Environment
    return "Environments: " + ", ".join(f"{kind} `{kind.word}`" for kind in kinds) + ".\n"


def _environment_forces() -> str:
    rows = ((kind.word, kind.about.force, kind.about.solution) for kind in environments.Environment)
    return _table("kind|force on the proxy|solution", rows)


def _environment_keys() -> str:
    names = ", ".join(f"`{name}`" for name in environments.NAMES)
    rows = [
        "| key | type | unit | bounds | |",
        "|---|---|---|---|---|",
        "| `axis` | text or integer | | a name, or 0 to axes - 1 | required |",
        f"| `kind` | text | | {names} (`remote` while armed: targets are awaited for 100 ticks from here "
        "on) | required |",
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
    "tick fields": _tick_fields,
    "numbers in the tick": _tick_numbers,
    "faults": _faults,
    "kinds of scripted faults": scripted_faults,
    "columns of points": _point_columns,
    "rungs of the ladder": rungs,
    "transitions": _transitions,
    "fault bits": _fault_bits,
    "state numbers": _state_numbers,
    "environment numbers": _environment_numbers,
    "environment keys": _environment_keys,
    "environment forces": _environment_forces,
    "rig file keys": rig_file_keys.rig_file,
    "client reference": client_reference.reference,
    "device option keys": rig_file_keys.device_options,
}
"""What can stand between marks."""

_MARKED = re.compile(r"(<!-- (?P<name>[a-z ]+) -->\n).*?(<!-- end (?P=name) -->)", re.DOTALL)


def filled(text: str) -> str:
    """The document with every marked part written anew. Raises KeyError for a mark nobody writes."""
    return _MARKED.sub(lambda found: f"{found[1]}\n{PARTS[found['name']]()}\n{found[3]}", text)
