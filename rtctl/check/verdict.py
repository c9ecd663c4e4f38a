"""One row of the table that `rtctl check` ends with, and what a test is given."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Any

from hw.interface import Shown
from hw.motion import HANDLE_M, words

if TYPE_CHECKING:
    from hw.interface import Joint
    from rtctl.check.axis_report import AxisFigures
    from rtctl.rig_file.axis_tables import AxisTable
    from rtctl.rig_file.rig_tables import PassivityTable


class Outcome(IntEnum):
    """What a test found, from the best to the worst."""

    PASS = 0
    WARN = 1
    NOT_PROVED = 2
    FAIL = 3  # refuses the file; the others do not

    @property
    def label(self) -> str:
        """As it is printed."""
        # NOT_PROVED as two words, on the terminal and in JSON alike
        return self.name.replace("_", " ")


@dataclass(frozen=True)
class Verdict:
    """One row: what was tested, what came out, what it is held against, and what that means for a hand.

    `use` is how much of the bound is used, 1 where the verdict turns: rows of one outcome are sorted by it.
    `refusal` is the line that refuses the file (file, key, value, bound, remedy), where the test fails; or
    warns of it."""

    axis: str
    name: str
    figure: str
    bound: str
    outcome: Outcome
    meaning: str
    use: float = 0.0
    refusal: str = ""

    def spoken(self, motion: str) -> Verdict:
        """The row in the units of its axis; it is written in those of a rotary one."""
        return replace(  # all that a person reads; figures for programs stay
            self,
            name=words(self.name, motion),
            figure=words(self.figure, motion),
            bound=words(self.bound, motion),
            meaning=words(self.meaning, motion),
            refusal=words(self.refusal, motion),
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "axis": self.axis,
            "name": self.name,
            "figure": self.figure,
            "bound": self.bound,
            "verdict": self.outcome.label,
            "meaning": self.meaning,
            # JSON has no infinity
            "use": self.use if math.isfinite(self.use) else None,
            "refusal": self.refusal,
        }


def hand_factor(table: AxisTable) -> float:
    """Factor on stiffness, damping and inertia of the hands that tests try, which are those of a joint with
    its handle `HANDLE_M` away.

    In N/m, N s/m and kg they are the same hands at every handle. Where moments are measured the lever is the
    sensor's, and the handle may be beyond it."""
    # of a carriage `lever_m` are shares of the force
    lever_m = 1.0 if table.motion == "linear" else math.hypot(*table.lever_m)
    # stiffness at a joint goes with the square of the arm, and damping and inertia alike
    factor = (lever_m / HANDLE_M) ** 2
    return max(factor, 1.0) if any(table.axis_direction) else factor


@dataclass(frozen=True)
class Subject:
    """What a test is given: an axis with every figure, its table of the rig file, and where that stands."""

    axis: AxisFigures
    table: AxisTable
    period_s: float
    where: str
    """`file: axis[i]`, to begin a refusal with."""
    joint: Joint
    """As the rig file has it or, where that is worse, the devices."""
    simulated: bool = False
    """Nobody holds it."""
    cut_a: float = math.inf
    """What the device of its motor cuts larger currents to, without a word; inf: not known."""
    moment_step_nm: float = 0.0
    """Step of the force sensor's moments, N m; 0: it gives none."""
    shown: Shown = field(default_factory=Shown)
    """What the numbers of its devices can show; `step_rad` is of this axis alone."""
    passivity: PassivityTable | None = None
    """Accounts of the rig; None: nobody asks."""

    @property
    def hand(self) -> float:
        """Factor on stiffness, damping and inertia of the hands that tests try, which are those of a
        joint."""
        return hand_factor(self.table)  # one place for rows and for the plan of the observer

    def row(
        self,
        name: str,
        figure: str,
        bound: str,
        outcome: Outcome,
        meaning: str,
        use: float = 0.0,
        refusal: str = "",
    ) -> Verdict:
        """A row of this axis."""
        return Verdict(self.axis.name, name, figure, bound, outcome, meaning, use, refusal)


def ranked(rows: Iterable[Verdict]) -> list[Verdict]:
    """The worst row last: by outcome, then by how much of the bound is used; a use that is no number is the
    worst."""
    # NaN is neither more nor less than any number: sorted by it, rows would stand as they came
    return sorted(rows, key=lambda row: (row.outcome, math.inf if math.isnan(row.use) else row.use))


def named(rows: Iterable[Verdict], outcome: Outcome) -> list[str]:
    """Every row of this outcome as "axis: name", in the order of `rows`."""
    return [f"{row.axis}: {row.name}" for row in rows if row.outcome == outcome]
