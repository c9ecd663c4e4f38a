"""What held one late tick up, by what the scheduler told of the loop: how much of its lateness it slept on,
waited for the core and behind whom, and had the core and did not get on."""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from rtctl.host.exchange.late_trace import DONE, GAP, IN, OTHER, OUT, SLACK, SOFTIRQ, WOKEN, Mark, last_in

ORDINARY = 100
"""Priorities from here on are those of tasks without real-time rights."""


@dataclass
class Seen:
    """Shares of a lateness, ns.

    Attributes
    ----------
    slept
        Its timer had not come yet.
    slack
        Its timer might come so late, ns; 0 of a loop with real-time rights.
    ran
        It had the core, or nobody else had it.
    waited
        It was ready, and this had the core: cause and name.
    """

    slept: float = 0.0
    slack: float = 0.0
    ran: float = 0.0
    waited: Counter[tuple[str, str]] = field(default_factory=Counter)

    def held(self) -> tuple[str, str, float]:
        """The cause that it waited for longest, the longest of its names, and how long in all."""
        causes: Counter[str] = Counter()
        for (cause, _), spent in self.waited.items():
            causes[cause] += spent
        if not causes:
            return "", "", 0.0
        # by cause first: two tasks that share a wait are one cause, and the longer one names it
        cause, spent = causes.most_common(1)[0]
        name = next(name for (of, name), _ in self.waited.most_common() if of == cause)
        return cause, name, spent


_SLEEPS, _WOKEN, _TAKEN, _RUNS = "sleeps", "woken", "taken", "runs"


class _Story:
    """Where a loop is in what is told of it."""

    def __init__(self) -> None:
        self.found = Seen()
        self.state, self._own = "", 0
        self._core, self._softirq = Mark(0, ""), ""
        self._behind = 0  # ns, of who has the core now
        self._idle = 0  # ns, of a core that nobody was told to have

    def spend(self, ns: int) -> None:
        """So much time goes by."""
        if self.state == _SLEEPS:
            self.found.slept += ns
        elif self._softirq:
            self.found.waited["softirq", self._softirq] += ns
        elif self.state == _RUNS:
            self.found.ran += ns
        elif not self._core.name:
            self._idle += ns
        else:
            self._behind += ns

    def take(self, mark: Mark) -> None:
        """Go on with what is told next. A switch ends a softirq: a fully preemptible kernel may interrupt
        one."""
        if mark.what in {IN, OUT, OTHER}:  # only at a switch is known who had it: time is kept until then
            # an idle core is given up at once; to whom, not every kernel tells
            if self._idle and mark.leaver:
                self.found.waited[_whose(mark.left, self._own, self.state), mark.leaver] += self._idle
            else:
                self.found.ran += self._idle
            self._idle = 0
            if self._behind:
                self.found.waited[_whose(mark.left, self._own, self.state), self._core.name] += self._behind
            self._behind = 0
            self._core, self._softirq = mark, ""
        if mark.what == GAP:
            self.state = ""  # what was lost may have been a switch: begin anew at the next one
        elif mark.what == IN:
            self.state, self._own = _RUNS, mark.priority
        elif mark.what == OUT:
            self.state = _TAKEN if mark.ready else _SLEEPS
        elif mark.what == SLACK:
            self.found.slack = mark.slack_ns
        elif mark.what == WOKEN and self.state == _SLEEPS:
            self.state = _WOKEN
        elif mark.what in {SOFTIRQ, DONE}:
            self._softirq = mark.name if mark.what == SOFTIRQ else ""


def seen(marks: Sequence[Mark], since_ns: int, until_ns: int) -> Seen | None:
    """What the loop did between two times, at the second of which it runs; None where that was not told.

    Notes
    -----
    Such a loop was on another core at one of them, or a timer of another core woke it."""
    # from the switch to the loop on, which may lie before `since_ns`
    story, at_ns, end = _Story(), since_ns, bisect_left(marks, until_ns, key=lambda mark: mark.at_ns)
    for mark in (*marks[last_in(marks, since_ns) : end], Mark(until_ns, "")):
        if mark.at_ns > at_ns:
            if not story.state or (mark.what == IN and story.state == _SLEEPS):
                return None
            story.spend(mark.at_ns - at_ns)
            at_ns = mark.at_ns
        story.take(mark)
    return story.found if story.state == _RUNS else None


def _whose(priority: int, own: int, state: str) -> str:
    """The cause, where a loop of priority `own` waits behind the task that has its core.

    An ordinary task keeps a real-time one waiting until it leaves the kernel; it is given the core in that
    one's place only when that has used up what the kernel leaves it."""
    if priority <= own or own >= ORDINARY:
        return "another task"
    return "kernel section" if state == _WOKEN or priority < ORDINARY else "quota"
