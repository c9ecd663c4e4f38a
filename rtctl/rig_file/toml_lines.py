"""In which line of a TOML file a key stands, which the standard library's reader does not tell."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from hw.outside import MOST_TABLE_BYTES, read_bounded, shown, text_of, toml_of
from hw.plain_words import MOST_MESSAGE, Key
from rtctl.errors import ConfigError

_HEADER = re.compile(r"\s*(\[\[?)([^\[\]]+)\]\]?\s*(#.*)?$")
_ASSIGNMENT = re.compile(
    r"""\s*((?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*'))*)\s*=(.*)"""
)
_QUOTED = re.compile(r""""(?:\\.?|[^"\\])*+"?|'[^']*+'?|#.*""")  # what is never closed ends with the line


def _names(text: str) -> list[str]:
    return [part.strip().strip("\"'") for part in text.split(".")]


def _statements(text: str) -> Iterator[tuple[int, str]]:
    """Numbers and texts of the lines on which something begins: not those inside of lists and long
    strings."""
    depth, ends = 0, ""
    for number, line in enumerate(text.split("\n"), 1):
        if ends:
            ends = "" if ends in line else ends
            continue
        # before it is counted: the line that opens a list is a statement itself
        if depth == 0:
            yield number, line
        for quotes in ('"""', "'''"):
            if line.count(quotes) == 1:  # opened, and not closed on its line
                ends = quotes
        if ends or (depth == 0 and _HEADER.match(line)):
            continue
        bare = _QUOTED.sub("", line)
        # max: this counts brackets and is no parser, and a line too many must not lose all that follow
        depth = max(0, depth + sum(map(bare.count, "[{")) - sum(map(bare.count, "]}")))


class TomlLines:
    """Lines of the keys of one file, counted from 1. For a file that the standard library can read."""

    def __init__(self, text: str) -> None:
        self._lines: dict[Key, int] = {}
        self._counts: dict[Key, int] = {}
        table: Key = ()
        for number, line in _statements(text):
            if header := _HEADER.match(line):
                table = self._open(_names(header[2]), several=header[1] == "[[")
                self._lines.setdefault(table, number)  # the first: a table may be opened again by its parts
            elif found := _ASSIGNMENT.match(line):
                self._lines.setdefault((*table, *_names(found[1])), number)

    def of(self, key: Key) -> int | None:
        """Line of a key; where it has none of its own, that of the table it belongs in."""
        # from the whole key upwards: a default that is refused stands nowhere, its table does
        for length in range(len(key), 0, -1):
            part = tuple(key[:length])
            inside = (line for other, line in self._lines.items() if other[:length] == part)
            if line := self._lines.get(part) or min(inside, default=0):
                return line
        return None

    def _open(self, names: list[str], *, several: bool) -> Key:
        """The table that a header opens: the newest of each list on the way."""
        at: Key = ()
        for i, name in enumerate(names):
            at = (*at, name)
            if several and i == len(names) - 1:
                self._counts[at] = self._counts.get(at, -1) + 1
            if at in self._counts:
                at = (*at, self._counts[at])
        return at


def _not_toml(path: Path, text: str, error: tomllib.TOMLDecodeError) -> ConfigError:
    """Where the file stops being TOML, with the line itself."""
    found = re.search(r"(.*) \(at line (\d+), column \d+\)", str(error))
    if found is None:  # at the end of the file
        end = f"{str(error)[:1].lower()}{str(error)[1:]}"
        return ConfigError(f"{path}: not a TOML file: {shown(end, MOST_MESSAGE)}")
    number = int(found[2])
    line = "".join(text.split("\n")[number - 1 : number]).strip()
    why = {
        "Cannot overwrite a value": "this was given before",
        "Invalid value": "no value; text needs quotes",
    }
    told = shown(why.get(found[1], found[1]), MOST_MESSAGE)
    return ConfigError(f"{path}:{number}: not a TOML file: {told}: {shown(line)}")


def read_toml(
    path: Path, what: str = "rig file", if_missing: str = " (`rtctl init` lists those that can be copied)"
) -> tuple[bytes, dict[str, Any], Callable[[Key], str]]:
    """The file, its tables, and what tells file and line of a key.

    Raises ConfigError, which calls the file `what` and adds `if_missing` where there is none."""
    try:
        raw = read_bounded(path, MOST_TABLE_BYTES)
        data = toml_of(raw)
    except FileNotFoundError as error:
        raise ConfigError(f"{path}: cannot read the {what}: there is no such file{if_missing}") from error
    except OSError as error:
        raise ConfigError(f"{path}: cannot read the {what}: {error.strerror}") from error
    except tomllib.TOMLDecodeError as error:
        raise _not_toml(path, text_of(raw), error) from error
    except ValueError as error:
        raise ConfigError(f"{path}: not a TOML file: {shown(error, MOST_MESSAGE)}") from error
    lines = TomlLines(text_of(raw))

    def where(key: Key) -> str:
        number = lines.of(key)
        return f"{path}:{number}" if number else str(path)

    return raw, data, where
