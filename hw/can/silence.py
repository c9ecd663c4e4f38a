"""How long something that a device sends by a clock of its own has not come."""

from __future__ import annotations

from hw.can.armed import UNBOUNDED


class Silence:
    """A count of cycles since a frame came, and whether they are too many.

    Attributes
    ----------
    cycles : int
        Cycles since the last one."""

    __slots__ = ("_limit", "cycles")

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
