"""What comes from outside, a file or a text, bounded before it is built or shown.

A file may be a device without an end, a pipe nobody writes into, or a small one that unpacks to gigabytes; a
text may carry what a terminal obeys. Everything that reads what somebody else may have written goes through
here."""

from __future__ import annotations

import errno
import json
import os
import pwd
import re
import stat
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

MOST_TABLE_BYTES = 1 << 20
"""Largest file of settings: a rig of eight axes with every key written out needs a fiftieth of it."""

MOST_DEPTH = 32
"""Deepest nesting of tables and lists in one; ours need six."""

_MOST_WHOLE = 1 << 63
_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*"""
_DEEP_KEY = re.compile(rf"(?<![\w-])(?:{_PART}){{{MOST_DEPTH + 1}}}", re.ASCII)
"""A dotted key of so many parts: the parser takes a minute for one of 20,000."""

MOST_SHOWN = 200
"""Characters of one foreign value that are shown."""

_CONTROL = {code: f"\\x{code:02x}" for code in (*range(0x20), *range(0x7F, 0xA0))}
_CONTROL |= {0x09: "\\t", 0x0A: "\\n", 0x0D: "\\r"}
# turn the text around, or are not seen at all
_CONTROL |= {code: f"\\u{code:04x}" for code in (0x061C, *range(0x200B, 0x2010), *range(0x2028, 0x202F),
    *range(0x2060, 0x206A), 0xFEFF)}  # fmt: skip
_LAYOUT = (0x09, 0x0A, 0x0D)
_LEFT = {code: text for code, text in _CONTROL.items() if code not in _LAYOUT}


def opened(path: Path, *, follow: bool = True) -> BinaryIO:
    """A regular file, to be read; `follow` as in `read_bounded`. Raises OSError for anything else, and waits
    for nobody."""
    # opened first, then asked what it is: asked before, it may be another file by then
    flags = os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK  # else a pipe is waited for
    fd = os.open(path, flags if follow else flags | os.O_NOFOLLOW)
    if not stat.S_ISREG(os.fstat(fd).st_mode):
        os.close(fd)
        raise OSError(errno.EINVAL, "it is not a regular file", str(path))
    return os.fdopen(fd, "rb")


def real(path: Path | str) -> Path:
    """Where a path leads to. Unlike `Path.resolve` it raises nothing for a link to itself: who opens that is
    told."""
    return Path(os.path.realpath(path))


def home() -> Path:
    """The user's home folder: HOME, else what the password file says; `/`, as in most containers, of a user
    whom it does not know."""
    told = Path(os.environ.get("HOME", ""))
    if told.is_absolute():
        return told
    try:
        return Path(pwd.getpwuid(os.getuid()).pw_dir)
    except KeyError:
        return Path("/")


def user_folder(variable: str, *below: str) -> Path:
    """The folder that a variable of the user's session names, else this one below the home.

    A relative one counts for nothing, as the XDG base directories have it: in every working directory it
    would be another one, and a daemon find neither the lock nor the zero of the force of the one before."""
    told = Path(os.environ.get(variable, ""))
    return told if told.is_absolute() else home().joinpath(*below)


def read_bounded(path: Path, most: int, *, follow: bool = True) -> bytes:
    """The whole of a regular file of at most `most` bytes.

    Parameters
    ----------
    follow
        Whether the path may be a link.

    Raises
    ------
    OSError
        It cannot be read, is no regular file, or is longer; `strerror` says so."""
    with opened(path, follow=follow) as file:
        return whole_of(file, most)


def whole_of(file: BinaryIO, most: int) -> bytes:
    """What stands in a file of at most `most` bytes. Raises OSError as `read_bounded`."""
    # one more than may be: told apart from a file of just that size; by reading, not by the size that is
    # told: files below /proc say 0
    data = file.read(most + 1)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"it is larger than {most} bytes", file.name)
    return data


def text_of(raw: bytes) -> str:
    """Text in UTF-8, without the mark that editors of Windows put before it. Raises ValueError, with the
    line, for any other encoding."""
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        msg = f"line {line} is not UTF-8: save the file in that encoding"
        raise ValueError(msg) from error


def toml_of(raw: bytes) -> dict[str, Any]:
    """A table of settings. Raises ValueError for anything that is none, or is nested too deeply."""
    text = text_of(raw)
    if _DEEP_KEY.search(text):
        _too_deep()
    try:
        table = tomllib.loads(text)
    except RecursionError:
        _too_deep()
    except (AttributeError, KeyError, TypeError, OverflowError) as error:
        msg = f"cannot be understood ({type(error).__name__})"
        raise ValueError(msg) from error
    require_sane(table)
    return table


def read_toml(path: Path) -> dict[str, Any]:
    """A file of settings. Raises OSError as `read_bounded`, ValueError as `toml_of`."""
    return toml_of(read_bounded(path, MOST_TABLE_BYTES))


def json_of(raw: bytes | str) -> Any:  # noqa: ANN401
    """A JSON text. Raises ValueError for anything that is none, or is nested too deeply."""
    try:
        value = json.loads(raw)
    except RecursionError:
        _too_deep()
    require_sane(value)
    return value


def require_sane(value: object) -> None:
    # level by level: a call in a call would end in a RecursionError of its own
    """Raise ValueError where tables and lists stand deeper in each other than `MOST_DEPTH`, or a whole number
    has over 64 bits."""
    level = [value]
    for _ in range(MOST_DEPTH + 1):
        inner: list[object] = []
        for one in level:
            if isinstance(one, Mapping):
                inner += one.values()
            elif isinstance(one, list):
                inner += one
        if any(isinstance(one, int) and not -_MOST_WHOLE <= one < _MOST_WHOLE for one in inner):
            raise ValueError("a whole number of more than 64 bits")
        level = [one for one in inner if isinstance(one, Mapping | list)]
        if not level:
            return
    _too_deep()


def whole(value: object) -> object:
    """For a choice among whole numbers. Raises ValueError for `true` and 1.0, which are equal to 1 and mean
    something else."""
    # True == 1 and 1.0 == 1 in Python: a choice among 1 and -1 would take both
    if isinstance(value, bool | float):
        msg = f"a whole number is needed, not {value!r}".replace("True", "true").replace("False", "false")
        raise ValueError(msg)
    return value


def shown(text: object, most: int = MOST_SHOWN) -> str:
    """A foreign text on one line: control characters spelled out, cut to `most` characters."""
    whole = str(text)
    plain = whole[: most + 1].translate(_CONTROL)
    return plain if len(whole) <= most and len(plain) <= 2 * most else plain[:most] + "..."


def harmless(text: str) -> str:
    """A text of several lines that no terminal obeys: all control characters but its layout spelled out."""
    return text.translate(_LEFT)


def _too_deep() -> NoReturn:
    raise ValueError(f"tables or lists are nested deeper than {MOST_DEPTH}")
