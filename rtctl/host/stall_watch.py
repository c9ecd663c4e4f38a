"""Notices a loop that no longer advances, and does not take the host's own standstill for the loop's."""

from __future__ import annotations

LOOK_S = 0.002
"""Longest time between two looks that counts as silence of the loop; how often a host that must be quick looks."""

STALL_S = 0.010
STALL_PERIODS = 3
SLACK_S = 0.25
"""Added where the loop may be kept waiting by the system: simulated rigs, and rigs that run without real-time rights."""


class StallWatch:
    """Adds up how long the loop has been silent while the host was looking.

    A host that was itself stopped (a suspended machine, SIGSTOP, a page fault) cannot know what the loop did meanwhile:
    of each gap between two looks at most `LOOK_S` counts, or `SLACK_S` / 5 where there is slack.

    Parameters
    ----------
    period_s
        Loop period, s.
    strict
        Whether the loop is punctual by right: silence counts as a stall within 3 periods + 10 ms of it.
    """

    def __init__(self, period_s: float, *, strict: bool) -> None:
        self.look_s = LOOK_S if strict else SLACK_S / 5
        self.limit_s = STALL_PERIODS * period_s + STALL_S + (-LOOK_S if strict else SLACK_S)
        self._head, self._looked_s, self._silent_s = 0, 0.0, 0.0

    def look(self, head: int, now_s: float, *, excused: bool) -> bool:
        """Whether the loop has stalled.

        Parameters
        ----------
        head
            Ticks the loop has made.
        now_s
            Monotonic time, taken after `head` was read, s.
        excused
            The loop has a reason to make no ticks (it opens a device, it has ended).
        """
        gap_s, self._looked_s = now_s - self._looked_s, now_s
        if head != self._head or head == 0 or excused:
            self._head, self._silent_s = head, 0.0
        else:
            self._silent_s += min(gap_s, self.look_s)
        return self._silent_s > self.limit_s
