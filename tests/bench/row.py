"""One line of a benchmark."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

from rtctl.errors import RtctlError

WIDTHS = (64, 9, 11, 9, 2, 0)
"""Of the columns of a table, whose rows nobody knows yet when it begins."""


@dataclass(frozen=True)
class Row:
    """One figure: `ok` compares `value` with `target` by `sense` (`<=` or `>=`); without target it informs.

    `against` says what it was measured beside, and that reference's own figure.
    """

    name: str
    value: float
    unit: str
    against: str
    target: float | None = None
    sense: str = "<="

    @property
    def ok(self) -> bool | None:
        """Whether the target is met; None without one. A figure that is not a number never meets one."""
        if self.target is None:
            return None
        if math.isnan(self.value):
            return False
        return bool(self.value <= self.target if self.sense == "<=" else self.value >= self.target)

    def as_dict(self) -> dict[str, Any]:
        """For `--json`."""
        return {**asdict(self), "ok": self.ok}


def table(rows: Iterable[Row]) -> Iterator[str]:
    """Text of rows below a head, line by line: each as soon as its row is there."""
    yield _line(("name", "value", "unit", "target", "ok", "measured against"))
    for row in rows:
        target = "" if row.target is None else f"{row.sense} {row.target:g}"
        ok = {None: "", True: "ok", False: "NO"}[row.ok]
        yield _line((row.name, f"{row.value:.4g}", row.unit, target, ok, row.against))


def _line(cells: tuple[str, ...]) -> str:
    return "  ".join(text.ljust(width) for text, width in zip(cells, WIDTHS, strict=True)).rstrip()


def in_turns(turns: Iterable[object], rows: Callable[[], Iterable[Row]]) -> Iterator[Row]:
    """Rows of what `turns` measures, one whole turn at each of its steps. Ctrl-C, or a turn that cannot be
    measured, ends the turns: what was measured by then is told, and the exception goes on behind it.
    """
    done, ended = 0, None
    try:
        for _ in turns:
            done += 1
    except (KeyboardInterrupt, RtctlError) as error:
        ended = error
    if done:
        yield from rows()
    if ended is not None:
        raise ended
