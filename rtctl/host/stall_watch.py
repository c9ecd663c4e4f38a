"""Notices a loop that no longer advances, and does not take the host's own standstill for the loop's."""

from __future__ import annotations

import math
from enum import IntEnum

LOOK_S = 0.002
"""Time between two looks of the host at the loop of a rig with a motor. Of a longer gap between two looks
only this much counts as silence of the loop: the rest is the host's own standstill."""

IDLE_LOOK_S = 0.05
"""Time between two looks at the loop of a simulated rig, which has no torque to take away."""

# beside 3 periods, which are .15 ms at 20 kHz: the kernel may hold a core for longer than that
STALL_S = 0.010
STALL_PERIODS = 3
SLACK_S = 0.25
"""What the system may keep a process waiting that has no rights, and how long a late loop may take to go
on."""


class Verdict(IntEnum):
    """What to do about the loop."""

    FINE = 0
    LATE = 1
    """Stop the devices. A loop that goes on judges its own lateness: STALLED from 10 periods on, else late
    ticks."""
    STALLED = 2
    """End it."""


class StallWatch:
    """Adds up how long the loop has been silent while the host was looking.

    A host that was itself stopped (a suspended machine, SIGSTOP, a page fault) cannot know what the loop did
    meanwhile: of each gap between two looks no more counts than there should have been.

    Parameters
    ----------
    period_s
        Loop period, s.
    motor
        Whether there is a motor to stop.
    punctual
        Whether the loop runs by right: after 3 periods + 10 ms of silence it is LATE, `SLACK_S` later
        STALLED. Any other loop is never LATE.

    Attributes
    ----------
    look_s : float
        Longest time the host should let pass between two looks, s."""

    def __init__(self, period_s: float, *, motor: bool, punctual: bool) -> None:
        self.look_s = LOOK_S if motor else IDLE_LOOK_S
        late_s = STALL_PERIODS * period_s + STALL_S
        # less one look, by which a silence is seen late
        self.late_s = late_s - LOOK_S if punctual else math.inf
        self.stalled_s = late_s + SLACK_S
        self._most_s = LOOK_S if punctual else IDLE_LOOK_S
        self._head, self._looked_s, self._silent_s = 0, 0.0, 0.0

    @property
    def is_silent(self) -> bool:
        """Whether no tick came between the last two looks."""
        return self._silent_s > 0.0

    def look(self, head: int, now_s: float, *, excused: bool) -> Verdict:
        """Judge the loop.

        Parameters
        ----------
        head
            Ticks the loop has made.
        now_s
            Monotonic time, taken after `head` was read, s.
        excused
            The loop has a reason to make no ticks (it opens a device, it has ended)."""
        gap_s, self._looked_s = now_s - self._looked_s, now_s
        if head != self._head or head == 0 or excused:  # head 0: it has not begun
            self._head, self._silent_s = head, 0.0
        else:
            self._silent_s += min(gap_s, self._most_s)
        if self._silent_s > self.stalled_s:
            return Verdict.STALLED
        return Verdict.LATE if self._silent_s > self.late_s else Verdict.FINE
