"""What made a tick late: the one cause that what was counted meanwhile explains by at least half, or `unknown`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from rtctl.host.telemetry.late_ticks import LateTick

EXPLAINS = 0.5
"""Least share of the lateness that a cause must explain."""

INTERRUPT_NS = 5_000.0
"""Taken by one soft or hard interrupt beyond the usual number: a network packet on loopback takes 2 to 20 us."""

MINOR_FAULT_NS, MAJOR_FAULT_NS = 2_000.0, 1_000_000.0
"""Taken by a page fault without and with a disk: .5 to 5 us, and a millisecond at least on a disk that spins."""

UNKNOWN = "unknown"

CAUSES = {
    "own cycle": "the loop's own cycle before it took longer than the period",
    "page fault": "memory of the loop was not there: it is locked when the service may (LimitMEMLOCK)",
    "stopped": "the loop was stopped by a signal (SIGSTOP, a debugger)",
    "quota": "the loop's control group, or all real-time tasks, had used up their time (CPUQuota, sched_rt_runtime_us)",
    "another task": "another task had the loop's core",
    "softirq": "the kernel did its deferred work on the loop's core (network, timers, block devices)",
    "interrupt": "a device interrupted the loop's core",
    "steal": "the hypervisor had taken the core away",
    "idle state": "the core came out of a deep idle state",
    "timer slack": "the kernel may wake a task without real-time rights that much late",
    UNKNOWN: "nothing that was counted explains it",
}
"""Every cause by its name in telemetry, and what it means."""


@dataclass(frozen=True)
class Rise:
    """What was counted between two readings, on the loop's core and of the loop; NaN: this kernel does not tell.

    `usual_*` are what the same counters rose by in as much time without a late tick.
    """

    run_delay_ns: float = float("nan")
    """How long the loop was ready to run and did not."""
    steal_ns: float = float("nan")
    throttled_ns: float = float("nan")
    minor_faults: float = float("nan")
    major_faults: float = float("nan")
    stopped: bool = False
    timer_slack_ns: float = float("nan")
    idle_exit_ns: float = float("nan")
    """Longest way out of an idle state that was entered."""
    softirqs: Mapping[str, float] | None = None
    """Beyond what is usual, by name; interrupts likewise."""
    interrupts: Mapping[str, float] | None = None
    other_task: str = ""
    """Name of the task that ran longest on the loop's core."""
    other_task_ns: float = float("nan")


@dataclass(frozen=True)
class Verdict:
    """Cause (of `CAUSES`), its name in particular (a task, a softirq, a part of the cycle), and the share explained, 0 to 1."""

    cause: str
    name: str
    share: float

    @property
    def text(self) -> str:
        """In a few words."""
        return f"{self.cause} ({self.name})" if self.name else self.cause


def judge(late: LateTick, rise: Rise, late_sum_ns: float) -> Verdict:
    """The cause of one late tick; `late_sum_ns` is the lateness of all late ticks between the two readings.

    Notes
    -----
    Looked at in this order, the first that explains half wins: what is exact before what is counted, what stops a
    process before what delays it. An own cycle that was long because its memory was not there, or another task ran in the
    middle of it, is theirs.
    """
    needed = max(late_sum_ns, 1.0)
    found = [
        ("stopped", "", needed if rise.stopped else 0.0),
        ("quota", "", rise.throttled_ns),
        *_own(late, rise, needed),
        ("softirq", *_held_by_softirq(rise)),
        ("another task", _culprit(rise), rise.run_delay_ns),
        ("steal", "", rise.steal_ns),
        ("page fault", late.phase, _fault_ns(rise)),
        ("softirq", *_counted(rise.softirqs)),
        ("interrupt", *_counted(rise.interrupts)),
        ("idle state", "", rise.idle_exit_ns * needed / max(late.late_ns, 1)),
        ("timer slack", "", rise.timer_slack_ns * needed / max(late.late_ns, 1)),
    ]
    for cause, name, explained_ns in found:
        share = explained_ns / needed
        if share >= EXPLAINS:  # a NaN does not
            return Verdict(cause, name, min(share, 1.0))
    return Verdict(UNKNOWN, "", 0.0)


def _own(late: LateTick, rise: Rise, needed: float) -> list[tuple[str, str, float]]:
    """The cycle before, unless something else explains why that one was long."""
    if late.own_ns < EXPLAINS * late.late_ns:
        return []
    if rise.major_faults > 0 or _fault_ns(rise) >= EXPLAINS * needed:
        return [("page fault", late.phase, needed)]
    if rise.run_delay_ns >= EXPLAINS * needed or rise.steal_ns >= EXPLAINS * needed:
        return []
    return [("own cycle", late.phase, late.own_ns / late.late_ns * needed)]


def _fault_ns(rise: Rise) -> float:
    return rise.minor_faults * MINOR_FAULT_NS + rise.major_faults * MAJOR_FAULT_NS


def _held_by_softirq(rise: Rise) -> tuple[str, float]:
    """Deferred work of the kernel while the loop was ready to run, and no task ran that may keep it from running."""
    name, taken_ns = _counted(rise.softirqs)
    if not taken_ns >= EXPLAINS * rise.run_delay_ns or rise.other_task_ns >= EXPLAINS * rise.run_delay_ns:
        return name, float("nan")
    return name, rise.run_delay_ns


def _culprit(rise: Rise) -> str:
    """The task, where it ran long enough to have done it. One that has ended is counted nowhere."""
    return rise.other_task if rise.other_task_ns >= EXPLAINS * rise.run_delay_ns else ""


def _counted(numbers: Mapping[str, float] | None) -> tuple[str, float]:
    """The most frequent by name, and the time that they may have taken, ns."""
    if not numbers:
        return "", float("nan")
    name = max(numbers, key=lambda one: numbers[one])
    return name, numbers[name] * INTERRUPT_NS
