"""What a terminal, or the journal, gets to see: no control characters but those that rtctl itself sends.

Texts from files, devices and other machines end up in errors, tables and log lines. In each place they could
be made harmless by itself; here it is done once for all, where everything passes."""

from __future__ import annotations

import io
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum
from typing import TextIO

from hw.outside import harmless

_OWN = re.compile("(\x1b\\[(?:[0-9;]*m|H|J|[0-9]{1,3}F))")
"""Colours of click, and what `monitor` and `probe` draw with: nothing a terminal could be tricked with."""


class Grade(IntEnum):
    """How grave a line is, as the journal counts (sd-daemon(3))."""

    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    INFO = 6


def graded(text: str, grade: Grade, fd: int = 2) -> str:
    """The text for `fd`, with its grade before each line where that is the journal: `journalctl -p warning`
    finds it. Nothing is added for a person's terminal, or for a file."""
    if grade is Grade.INFO or not _is_journal(fd):  # what has no grade is information
        return text
    return "\n".join(f"<{int(grade)}>{line}" for line in text.split("\n"))


def _is_journal(fd: int) -> bool:
    """Whether systemd connected `fd` to its journal, and nobody led it elsewhere since (systemd.exec(5))."""
    try:
        found = os.fstat(fd)
    except OSError:
        return False
    return os.environ.get("JOURNAL_STREAM") == f"{found.st_dev}:{found.st_ino}"


def obeyed_by_none(text: str) -> str:
    """The text with every control character spelled out but layout and what rtctl itself draws with."""
    return "".join(part if _OWN.fullmatch(part) else harmless(part) for part in _OWN.split(text))


class NobodyReadsError(BrokenPipeError):
    """Whoever read standard output or standard error has ended, as `head` does once it has its lines.

    It has no `errno`: click makes 1 of a broken pipe, whosever it is."""


class Harmless(io.TextIOWrapper):
    """A text stream that spells out every control character but layout and colours."""

    def write(self, text: str) -> int:
        """Write; returns the number of characters given. Raises NobodyReadsError."""
        with _read_by_somebody():
            # of what was given, not of what came of it: who counts compares with its own text
            super().write(obeyed_by_none(text))
        return len(text)

    def flush(self) -> None:
        """Write what is kept. Raises NobodyReadsError."""
        with _read_by_somebody():
            super().flush()


@contextmanager
def _read_by_somebody() -> Iterator[None]:
    try:
        yield
    except BrokenPipeError as error:
        raise NobodyReadsError("nobody reads what is written") from error


def write_for_nobody() -> None:
    """What is still unwritten, and whatever comes, goes nowhere."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for number in (1, 2):
        os.dup2(nowhere, number)


def obey_nothing_foreign() -> None:
    """Have stdout and stderr write harmless texts from now on."""
    sys.stdout, sys.stderr = _wrapped(sys.stdout), _wrapped(sys.stderr)


def _wrapped(stream: TextIO) -> TextIO:
    if type(stream) is not io.TextIOWrapper:  # done already, or somebody else's, who would lose what it wraps
        return stream
    encoding, lines = stream.encoding, stream.line_buffering
    return Harmless(
        stream.detach(),
        encoding,
        "backslashreplace",
        line_buffering=lines,
        write_through=stream.write_through,
    )
