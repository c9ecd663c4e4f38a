"""What is wrong with a table that was read, in plain words: key, value, bound, and what was probably meant.

The validating library's own sentences speak of its types; a person who edits a rig file should not meet them.
"""

from __future__ import annotations

import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from hw.outside import shown as on_one_line

Key = tuple[str | int, ...]

NAME_PATTERN = r"^[A-Za-z][A-Za-z0-9_-]{0,31}$"
NAME_WORDS = "a letter, then at most 31 letters, digits, - or _"
MOST_SHOWN = 60

MOST_FAULTS = 50
"""Faults of one table that are told one by one."""

MOST_MESSAGE = 2000
"""Characters of one fault's text: that of a schedule of faults tells all of its own."""


@dataclass(frozen=True)
class Told:
    """One fault: where in the data, and what is wrong there."""

    key: Key
    text: str

    @property
    def where(self) -> str:
        """The key as people write it: `axis[0].name`; empty for the whole."""
        return written(self.key)


def written(key: Key) -> str:
    """A key as people write it, on one line and without control characters: `axis[0].name`."""
    parts = (f"[{part}]" if isinstance(part, int) else f".{on_one_line(part)}" for part in key)
    return "".join(parts).removeprefix(".")


def explain(error: ValidationError, model: type[BaseModel], data: object) -> list[Told]:
    """The faults of `data` as a `model`, in the order of the model; the last one counts those beyond
    `MOST_FAULTS`.

    No text holds a control character, whatever the data do."""
    every = [(_key(fault["loc"], data), dict(fault)) for fault in error.errors(include_url=False)]
    holding = {key[:length] for key, _ in every for length in range(len(key))}
    # a list is too short as well where only the entries below it were refused
    found = [(key, fault) for key, fault in every if fault["type"] != "too_short" or key not in holding]
    out: list[Told] = []
    for i, (key, fault) in enumerate(found):
        if len(out) == MOST_FAULTS:
            return [*out, Told((), f"and {len(found) - i} more of the kind")]
        told = Told(key, on_one_line(_text(key, fault, model), MOST_MESSAGE))
        if told not in out:
            out.append(told)
    return out


def shown(value: object) -> str:
    """A value as a rig file would have it, cut where it is long."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping | BaseModel):
        return "a table"
    if isinstance(value, list | tuple) and any(isinstance(one, Mapping) for one in value):
        return "a list of tables"
    text = repr(value)
    return text if len(text) <= MOST_SHOWN else text[:MOST_SHOWN] + " ..."


def did_you_mean(word: str, known: Iterator[str] | list[str]) -> str:
    """`; did you mean NAME?`, or nothing where no name is near."""
    near = get_close_matches(word.lower(), list(known), 1, 0.6)
    return f"; did you mean {near[0]}?" if near else ""


def _key(loc: tuple[str | int, ...], data: object) -> Key:
    """The place in the data: without the names of alternatives that the library puts between the keys."""
    out: list[str | int] = []
    for i, part in enumerate(loc):
        last = i == len(loc) - 1
        if isinstance(data, Mapping):
            if part not in data and not last:
                continue
            data = data.get(part)
        elif isinstance(data, list | tuple) and isinstance(part, int) and part < len(data):
            data = data[part]
        elif not last or out:
            continue
        out.append(part)
    return tuple(out)


def _models(annotation: object) -> Iterator[type[BaseModel]]:
    """Every table that a value of this type may be, or hold."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    elif get_origin(annotation) is Annotated:
        yield from _models(get_args(annotation)[0])
    elif get_origin(annotation) in (Union, types.UnionType, tuple, list):
        for inner in get_args(annotation):
            yield from _models(inner)


def _fields(model: type[BaseModel]) -> dict[str, FieldInfo]:
    return {info.alias or name: info for name, info in model.model_fields.items()}


def _find(key: Key, model: type[BaseModel]) -> tuple[FieldInfo | None, list[type[BaseModel]]]:
    """The field at `key`, and the tables that its own key stands in."""
    tables, info = [model], None
    holders = tables
    for part in key:
        if isinstance(part, int):
            continue
        holders = tables
        info = next((_fields(table)[part] for table in tables if part in _fields(table)), None)
        tables = [] if info is None else list(_models(info.annotation))
    return info, holders


def _constraints(annotation: object, metadata: Sequence[Any] = ()) -> Iterator[Any]:
    """What is said of a value of this type, and of the alternatives in it."""
    for item in metadata:
        yield from item.metadata if isinstance(item, FieldInfo) else (item,)
    for i, inner in enumerate(get_args(annotation)):
        if get_origin(annotation) is not Annotated:
            yield from _constraints(inner)
        elif i == 0:
            yield from _constraints(inner, get_args(annotation)[1:])


def _is_whole(annotation: object) -> bool:
    return annotation is int or any(_is_whole(inner) for inner in get_args(annotation))


def bounds(info: FieldInfo | None) -> str:
    """` from LOW to HIGH`, as far as the field has bounds."""
    if info is None:
        return ""
    words = {"ge": "from", "gt": "above", "le": "to", "lt": "below"}
    parts = [
        f" {word} {getattr(item, name):.15g}"
        for name, word in words.items()
        for item in _constraints(info.annotation, info.metadata)
        if isinstance(getattr(item, name, None), int | float)
    ]
    return "".join(parts).replace(" to ", " up to ") if len(parts) == 1 else "".join(parts)


def _wanted(fault: Mapping[str, Any], info: FieldInfo | None) -> str:
    """What stands there in a file that is right, for the faults of single values."""
    kind, ctx = fault["type"], fault.get("ctx", {})
    whole = info is not None and _is_whole(info.annotation)
    if kind.startswith("int") or (whole and kind.startswith(("greater", "less"))):
        return f"a whole number{bounds(info)}"
    if kind.startswith("bool"):
        return "true or false"
    if kind in ("literal_error", "enum"):
        return f"{ctx['expected']}"
    if kind == "string_pattern_mismatch":
        return NAME_WORDS if ctx["pattern"] == NAME_PATTERN else f"text of the form {ctx['pattern']}"
    if kind == "string_too_long":
        return f"at most {ctx['max_length']} characters"
    if kind == "string_too_short":
        return f"at least {ctx['min_length']} characters"
    if kind.startswith(("float", "finite", "greater", "less")):
        return f"a {'finite ' if kind.startswith('finite') else ''}number{bounds(info)}"
    return "text in quotes" if kind.startswith("string") else ""


def _missing(key: Key, fault: Mapping[str, Any], info: FieldInfo | None, _holders: list[Any]) -> str:
    if isinstance(fault["loc"][-1], int):  # an entry of a list of fixed length
        has, wants = len(fault["input"]), len(get_args(getattr(info, "annotation", None)))
        return f"must have {wants or fault['loc'][-1] + 1} entries, has {has}"
    text = f": {info.description}" if info is not None and info.description else ""
    number = bounds(info)
    return f"{key[-1]} is missing{text}" + (f" (a number{number})" if number else "")


def _unknown(key: Key, _fault: Mapping[str, Any], _info: FieldInfo | None, holders: list[Any]) -> str:
    known = sorted({name for table in holders for name in _fields(table)})
    near = did_you_mean(str(key[-1]), known)
    return (
        f"unknown key{near or '; there are ' + ', '.join(known)}{' Otherwise' if near else '; or'} remove it"
    )


def _table(key: Key, fault: Mapping[str, Any], _info: FieldInfo | None, _holders: list[Any]) -> str:
    name = ".".join(str(part) for part in key if isinstance(part, str))
    if isinstance(fault.get("input"), list):
        return f"[[{name}]] must be [{name}], with one bracket: there is one only"
    return f"must be a table, [{name}], not {shown(fault.get('input'))}"


def _list(key: Key, fault: Mapping[str, Any], info: FieldInfo | None, _holders: list[Any]) -> str:
    name = ".".join(str(part) for part in key if isinstance(part, str))
    if info is not None and any(_models(info.annotation)):
        given = "[" + name + "]" if isinstance(fault.get("input"), Mapping) else shown(fault.get("input"))
        return f"{given} must be [[{name}]], with two brackets: there may be several"
    return f"must be a list in square brackets, not {shown(fault.get('input'))}"


def _length(_key: Key, fault: Mapping[str, Any], _info: FieldInfo | None, _holders: list[Any]) -> str:
    ctx = fault.get("ctx", {})
    most, least = ctx.get("max_length"), ctx.get("min_length")
    wanted = f"at least {least}" if fault["type"] == "too_short" else f"at most {most}"
    return f"must have {wanted} entries, has {ctx.get('actual_length')}"


def _own_words(_key: Key, fault: Mapping[str, Any], _info: FieldInfo | None, _holders: list[Any]) -> str:
    text = str(fault.get("ctx", {}).get("error") or fault["msg"].removeprefix("Value error, "))
    given = fault.get("input")
    # None: nothing was given
    told = (
        given is None
        or isinstance(given, Mapping | list | tuple | BaseModel)
        or shown(given) in text
        or str(given) in text
    )
    return text if told else f"{text} (got {shown(given)})"


_Words = Callable[[Key, Mapping[str, Any], FieldInfo | None, list[Any]], str]

_BY_KIND: dict[str, _Words] = {
    "missing": _missing,
    "extra_forbidden": _unknown,
    **dict.fromkeys(("model_type", "dict_type", "model_attributes_type", "dataclass_type"), _table),
    **dict.fromkeys(("tuple_type", "list_type"), _list),
    **dict.fromkeys(("too_short", "too_long"), _length),
    **dict.fromkeys(("value_error", "assertion_error"), _own_words),
}


def _text(key: Key, fault: Mapping[str, Any], model: type[BaseModel]) -> str:
    info, holders = _find(key, model)
    if words := _BY_KIND.get(fault["type"]):
        return words(key, fault, info, holders)
    given, wanted = fault.get("input"), _wanted(fault, info)
    if not wanted:  # a kind that none of our tables has had so far
        msg = str(fault["msg"]).replace("Input should be", "must be").replace("a valid ", "a ")
        return f"{msg}, not {shown(given)}"
    near = ""
    if fault["type"] == "literal_error" and isinstance(given, str):
        near = did_you_mean(given, [word.strip("' ") for word in wanted.replace(" or ", ", ").split(",")])
    return f"must be {wanted}, not {shown(given)}{near}"
