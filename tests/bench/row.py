"""One line of a benchmark."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any


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


def table(rows: list[Row]) -> list[str]:
    """Aligned text of rows."""
    cells = [("name", "value", "unit", "target", "ok", "measured against")]
    for row in rows:
        target = "" if row.target is None else f"{row.sense} {row.target:g}"
        ok = {None: "", True: "ok", False: "NO"}[row.ok]
        cells.append((row.name, f"{row.value:.4g}", row.unit, target, ok, row.against))
    widths = [max(len(line[i]) for line in cells) for i in range(6)]
    return [
        "  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)).rstrip()
        for line in cells
    ]
