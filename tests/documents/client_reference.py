"""The reference part of docs/api.md, from the signatures and docstrings of the client."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Callable, Iterator
from typing import Any

_SECTION = re.compile(r"^(Parameters|Attributes|Returns|Raises|Notes)\n-+$", re.MULTILINE)


def reference() -> str:
    """Every class of `rtctl.client` that a program uses, with its public methods, as Markdown."""
    from rtctl.client import Lease, RigClient, RigState, Stream

    lines: list[str] = []
    for one, made in ((RigClient, True), (RigState, False), (Stream, False), (Lease, False)):
        lines += _class(one, made=made)
    return "\n".join(lines)


def public(one: type) -> dict[str, Any]:
    """Public methods and properties of a class and its parents, in the order of the source, parents last."""
    found: dict[str, Any] = {}
    for owner in inspect.getmro(one):
        if owner.__module__.startswith("rtctl."):
            for name, value in vars(owner).items():
                if not name.startswith("_") and (inspect.isfunction(value) or isinstance(value, property)):
                    found.setdefault(name, value)
    return found


def signature(name: str, call: Callable[..., object], *, method: bool = True) -> str:
    """`name(parameters) -> result` as the source has it."""
    found = inspect.signature(call)
    parameters = list(found.parameters.values())[1 if method else 0 :]
    parts: list[str] = []
    for parameter in parameters:
        if parameter.kind == parameter.KEYWORD_ONLY and "*" not in parts:
            parts.append("*")
        stars = "**" if parameter.kind == parameter.VAR_KEYWORD else ""
        text = f"{stars}{parameter.name}: {parameter.annotation}"
        parts.append(
            text if parameter.default is parameter.empty else f"{text} = {_default(parameter.default)}"
        )
    result = "" if found.return_annotation in (found.empty, "None") else f" -> {found.return_annotation}"
    return f"{name}({', '.join(parts)}){result}"


def _default(value: object) -> str:
    return "lambda: None" if inspect.isfunction(value) else repr(value)


def _class(one: type, *, made: bool) -> Iterator[str]:
    yield from (f"### `{one.__name__}`", "")
    if made:
        yield from (f"    {signature(one.__name__, one.__init__)}", "")  # type: ignore[misc]
    yield from _text(one)
    if dataclasses.is_dataclass(one):
        names = ", ".join(f"`{field.name}`" for field in dataclasses.fields(one))
        yield from (f"Fields: {names}.", "")
    for name, value in public(one).items():
        yield from (f"#### `{one.__name__}.{name}`", "")
        if isinstance(value, property):
            yield from _text(value)
            continue
        yield from (f"    {signature(name, value)}", "")
        yield from _text(value)


def _text(documented: object) -> Iterator[str]:
    """A docstring as Markdown: paragraphs, and its sections as lists."""
    first, *rest = _SECTION.split(inspect.getdoc(documented) or "")
    yield from (first.strip(), "")
    for title, body in zip(rest[::2], rest[1::2], strict=True):
        yield from (f"{title}:", "")
        for entry in re.split(r"\n(?=\S)", body.strip("\n")):
            head, *more = entry.splitlines()
            yield f"- `{head}`: {' '.join(line.strip() for line in more)}"
        yield ""
