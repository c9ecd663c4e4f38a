"""How long something that a device sends by a clock of its own has not come."""

from __future__ import annotations

from hw.can.armed import UNBOUNDED

# 20: a drive that lets go says so in its heartbeat, and torque that lags for as long is a fault by itself
SILENT_TICKS, SILENT_PERIODS = 20, 5
"""What comes by a clock of its own counts as lost after the longer of so many cycles and so many of its
periods."""


def longest_s(every_s: float, period_s: float) -> float:
    """How long something that comes every `every_s` may be silent in a loop of this period, s."""
    # in cycles, too: something quicker than the loop may well miss a few of them
    return max(SILENT_TICKS * period_s, SILENT_PERIODS * every_s)


class Silence:
    """A count of cycles since a frame came, and whether they are too many.

    Attributes
    ----------
    cycles : int
        Cycles since the last one."""

    __slots__ = ("_limit", "cycles")

    @classmethod
    def of(cls, every_s: float, period_s: float) -> Silence:
        """The silence of something that comes every `every_s`, in a loop of this period."""
        return cls(round(longest_s(every_s, period_s) / period_s))

    def __init__(self, limit_cycles: int) -> None:
        self._limit = limit_cycles
        self.cycles = 0

    @property
    def is_over_long(self) -> bool:
        """True once more cycles than the limit have passed."""
        return self.cycles > self._limit

    @property
    def spare(self) -> int:
        """Cycles that may pass before that changes."""
        # once it has, only a frame can change it: no cycle does
        return UNBOUNDED if self.is_over_long else self._limit - self.cycles
