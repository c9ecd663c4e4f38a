"""Whether a drive that is to drive its motor does so: that it comes up in time, and that it stays up.

A drive that leaves its enabled state has a reason of its own (a limit, its watchdog, somebody's stop), and to
walk it back into it would be torque that returns by itself. It stays down until the host has disarmed it."""

from __future__ import annotations

UNBOUNDED = 1 << 30
"""Cycles in which nothing is due: days of them."""


class Armed:
    """What the host wants of one drive, beside what the drive says of itself.

    Attributes
    ----------
    wanted : bool
        The host wants it enabled.
    ticks : int
        Cycles since that changed.
    reached : bool
        It has been enabled since then.
    dropped : bool
        It was enabled and is not any more, whatever it says since; ends when the host disarms it.
    said : bool or None
        Its last word since what the host wants has changed."""

    __slots__ = ("_limit", "dropped", "reached", "said", "ticks", "wanted")

    def __init__(self, limit_ticks: int) -> None:
        self._limit = limit_ticks
        self.wanted = self.reached = self.dropped = False
        self.ticks = 0
        self.said: bool | None = None

    def order(self, wanted: bool) -> bool:
        """One cycle in which the host wants this; returns whether the drive may be enabled."""
        # an edge, not a level: what the drive said before it is no answer to this order
        if wanted != self.wanted:
            self.wanted, self.ticks = wanted, 0
            self.reached = self.dropped = False
            self.said = None
        # counted here and not where it is heard: a drive that says nothing has no other clock
        self.ticks += 1
        return wanted and not self.dropped

    def saw(self, enabled: bool) -> None:
        """Take in one word of the drive about itself."""
        self.said = enabled
        # disarmed: being down is what it should be
        if not self.wanted:
            return
        if enabled:
            self.reached = True
        # a drive takes some ms to come up: only one that was up can drop
        elif self.reached:
            self.dropped = True

    @property
    def spare(self) -> int:
        """Cycles that may pass, the drive saying nothing new, before anything here changes."""
        # the one thing here that comes due by itself; all else waits for a word of the drive
        if self.wanted and not self.reached and not self.ill:
            return self._limit - self.ticks
        return UNBOUNDED

    @property
    def ill(self) -> bool:
        """True when it is down again, or has not come up in time."""
        return self.dropped or (self.wanted and not self.reached and self.ticks > self._limit)
