"""Lines for the journal that never wait and never pile up.

A line is written only where there is room for it at once (`rtctl.host.outlet`), and each kind of line once a
second; what was left out is counted in the next line of its kind."""

from __future__ import annotations

import time
from collections.abc import Callable

from hw.outside import harmless
from rtctl.host.outlet import Outlet
from rtctl.terminal import Grade, graded

PERIOD_S = 1.0
MOST_BYTES = 512
"""Longest line."""

# twice what `Speaker` makes: 16 of two kinds each
_MOST_KINDS = 64


class Notices:
    """Writes lines to a descriptor, at most one of a kind per `PERIOD_S`.

    Attributes
    ----------
    left_out : int
        Lines not written: too many of a kind, or nobody read them."""

    def __init__(self, fd: int = 2, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._fd, self._outlet = fd, Outlet(fd)
        self._clock_s = clock_s
        self._kinds: dict[str, tuple[float, int]] = {}
        self.left_out = 0

    def __call__(self, kind: str, text: str, grade: Grade = Grade.INFO) -> None:
        """Write `text` as one line of this `grade`, unless one of this `kind` was written just now."""
        # a caller that makes kinds up cannot make the table grow
        if kind not in self._kinds and len(self._kinds) >= _MOST_KINDS:
            self.left_out += 1
            return
        now = self._clock_s()
        # a period ago: the first of a kind is written
        last, held_back = self._kinds.get(kind, (-PERIOD_S, 0))
        if now - last < PERIOD_S:
            written = False
        else:
            more = f" ({held_back} more of this kind)" if held_back else ""
            written = self._write(f"rtctl: {text}{more}", grade)
            last = now
        self._kinds[kind] = (last, 0 if written else held_back + 1)
        self.left_out += not written

    def _write(self, text: str, grade: Grade) -> bool:
        one_line = graded(harmless(" ".join(text.split())), grade, self._fd)
        line = one_line.encode("utf-8", "replace")[: MOST_BYTES - 1]
        # cut by bytes: below PIPE_BUF (pipe(7)), so that a pipe takes the whole line or nothing
        return self._outlet.write(line + b"\n")
