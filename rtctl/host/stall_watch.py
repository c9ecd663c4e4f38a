"""Notices a loop that no longer advances, and does not take the host's own standstill for the loop's."""

from __future__ import annotations

LOOK_S = 0.002
"""How often the host of a rig with a motor looks; of longer gaps only this much counts as silence of the loop."""

IDLE_LOOK_S = 0.05
"""The same of a simulated rig, which has no torque to take away."""

STALL_S = 0.010
STALL_PERIODS = 3
SLACK_S = 0.25
"""Added where the loop may be kept waiting by the system: simulated rigs, and rigs that run without real-time rights."""


class StallWatch:
    """Adds up how long the loop has been silent while the host was looking.

    A host that was itself stopped (a suspended machine, SIGSTOP, a page fault) cannot know what the loop did meanwhile:
    of each gap between two looks no more counts than there should have been.

    Parameters
    ----------
    period_s
        Loop period, s.
    motor
        Whether there is a motor to stop.
    punctual
        Whether the loop runs by right: silence counts as a stall within 3 periods + 10 ms of it.

    Attributes
    ----------
    look_s : float
        Longest time the host should let pass between two looks, s.
    """

    def __init__(self, period_s: float, *, motor: bool, punctual: bool) -> None:
        self.look_s = LOOK_S if motor else IDLE_LOOK_S
        self.limit_s = STALL_PERIODS * period_s + STALL_S + (-LOOK_S if punctual else SLACK_S)
        self._most_s = LOOK_S if punctual else IDLE_LOOK_S
        self._head, self._looked_s, self._silent_s = 0, 0.0, 0.0

    @property
    def is_silent(self) -> bool:
        """Whether no tick came between the last two looks."""
        return self._silent_s > 0.0

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
            self._silent_s += min(gap_s, self._most_s)
        return self._silent_s > self.limit_s
