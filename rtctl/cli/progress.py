"""The progress of a long command on stderr."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import click

from hw.motion import words


class Bar:
    """Bar, what is being done, time left by the pace so far; line by line where stderr is no terminal."""

    def __init__(self, *, quiet: bool, motion: str = "rotary", between_s: float = 5.0) -> None:
        self._quiet, self._live, self._motion = quiet, sys.stderr.isatty(), motion
        # a terminal's line is drawn anew, a log's stays
        self._between_s = 0.1 if self._live else between_s
        # -10: longer ago than any pause, so that the first share is shown
        self._began, self._shown, self._total = time.monotonic(), -10.0, 0.0

    def __call__(self, share: float, text: str) -> None:
        """Say that this share, 0 to 1, is done, and what is done now; not more often than one can read."""
        now = time.monotonic()
        # the last word is always shown
        if self._quiet or (now - self._shown < self._between_s and text != "done"):
            return
        self._shown = now
        spent = now - self._began
        # the pace of less than a hundredth foretells nothing
        left = f"{spent * (1 - share) / share:5.0f} s left" if share > 0.01 else ""
        line = f"[{'#' * round(30 * share):<30}] {100 * share:3.0f} % {left:<13} {words(text, self._motion)}"
        # filled up: it covers the line before; cut: one that wraps stays behind
        click.echo(f"\r{line:<110.110}" if self._live else line, err=True, nl=not self._live)

    def of(self, done: float, total: float, text: str) -> None:
        """Say how much of a total is done; where the total changes, the time left is reckoned anew."""
        # another step, with another pace
        if total != self._total:
            self._began, self._total, self._shown = time.monotonic(), total, -10.0
        self(min(done / total, 1.0), text)

    def notice(self, text: str) -> None:
        """Say something to the person at the rig."""
        if text:
            self.end()
            click.echo(f"rtctl: {words(text, self._motion)}", err=True)

    def end(self) -> None:
        """Leave the line of the bar."""
        if self._live and not self._quiet:
            click.echo("", err=True)


@contextmanager
def on_a_terminal(*, quiet: bool, motion: str = "rotary") -> Iterator[Bar]:
    """A bar of a command that is over in seconds as a rule: on a terminal alone, and gone at the end."""
    live = not quiet and sys.stderr.isatty()
    try:
        yield Bar(quiet=not live, motion=motion)
    finally:
        if live:
            click.echo(f"\r{'':110}\r", err=True, nl=False)
