"""What made a tick late: the one cause that what was counted meanwhile explains by at least half, or
`unknown`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from rtctl.host.exchange.late_seen import Seen
from rtctl.host.exchange.late_tasks import Ran
from rtctl.host.exchange.late_ticks import LateTick

EXPLAINS = 0.5
"""Least share of the lateness that a cause must explain."""

INTERRUPT_NS = 5_000.0
"""Taken by one soft or hard interrupt, or packet, beyond the usual number: a packet on loopback takes 2 to 20
us."""

SMI_NS = 1_000_000.0
"""Taken by the machine's firmware at most, at each SMI: .1 to 1 ms."""

MINOR_FAULT_NS, MAJOR_FAULT_NS = 5_000.0, 1_000_000.0
"""Taken by a page fault without a disk at most (.5 to 3 us; more where a virtual machine's own memory is not
there yet), and with one: a millisecond at least on a disk that spins."""

SOFTIRQ_TASK = "ksoftirqd/"
"""Begin of the name of the kernel's task that does deferred work where there is much of it."""

UNKNOWN = "unknown"

CAUSES = {
    "own cycle": "the loop's own cycle before it took longer than the period",
    "page fault": "memory of the loop was not there: it is locked when the service may (LimitMEMLOCK)",
    "stopped": "the loop was stopped by a signal (SIGSTOP, a debugger)",
    "quota": "the loop's control group, or all real-time tasks, had used up their time (CPUQuota, "
    "sched_rt_runtime_us)",
    "another task": "another task had the loop's core",
    "kernel section": "a task of lower priority had the loop's core, in a section of the kernel that cannot "
    "be interrupted",
    "softirq": "the kernel did its deferred work on the loop's core (network, timers, block devices)",
    "interrupt": "a device interrupted the loop's core",
    "steal": "the hypervisor had taken the core away",
    "SMI": "the machine's firmware had taken the core away (system management interrupt)",
    "frequency change": "the core's clock was slowed down, or stood while it was changed",
    "idle state": "the core came out of a deep idle state",
    "late timer": "the loop's timer came late: interrupts were off in the kernel, or who is below the kernel "
    "(hypervisor, firmware) had the core",
    "timer slack": "the kernel may wake a task without real-time rights that much late",
    UNKNOWN: "nothing that was counted explains it",
}
"""Every cause by its name in telemetry, and what it means."""


@dataclass(frozen=True)
class Rise:
    """What was counted between two readings, on the loop's core and of the loop; NaN: this kernel does not
    tell.

    Those of soft and hard interrupts are beyond what is usual in as much time without a late tick."""

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
    tasks: Sequence[Ran] = ()
    """Other tasks that ran on the loop's core while the tick was waited for, the likeliest first."""
    smis: float = float("nan")
    """How often the machine's firmware took the core."""
    slower: float = float("nan")
    """Share of its frequency that the core's clock has lost, 0 to 1."""
    clock_change_ns: float = float("nan")
    """How long changes of the clock held the core up."""
    too_hot: bool = False
    """The core was slowed down because of its temperature."""
    guest: bool = False
    """There is a hypervisor below."""
    seen: Seen | None = None
    """What the scheduler told of the loop while this tick was waited for, or, of an own cycle that was long,
    meanwhile."""


@dataclass(frozen=True)
class Verdict:
    """Cause (of `CAUSES`), its name in particular (a task, a softirq, a part of the cycle), and the share
    explained, 0 to 1."""

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
    Looked at in this order, the first that explains half wins: what is exact before what is counted, what
    stops a process before what delays it. An own cycle that was long because its memory was not there, or
    another task ran in the middle of it, is theirs. Where the scheduler told what the loop did, that takes
    the place of what its core counted."""
    if rise.seen is not None:
        return _seen(late, rise, rise.seen, late_sum_ns)
    # all late ticks between two readings share what rose: one cause may have made several late
    needed = max(late_sum_ns, 1.0)
    each = needed / max(late.late_ns, 1)  # what happens once at each late tick counts as often as there were
    found = [
        ("stopped", "", needed if rise.stopped else 0.0),
        ("quota", "", rise.throttled_ns),
        *_own(late, rise, needed),
        *_kept_waiting(late, rise),
        ("steal", "", rise.steal_ns),
        ("page fault", late.phase, _fault_ns(rise)),
        ("softirq", *_counted(rise.softirqs)),
        ("interrupt", *_counted(rise.interrupts)),
        ("SMI", "", rise.smis * SMI_NS),
        ("frequency change", _of_clock(rise), rise.clock_change_ns),
        ("idle state", "", rise.idle_exit_ns * each),
        ("timer slack", "", rise.timer_slack_ns * each),
    ]
    for cause, name, explained_ns in found:
        share = explained_ns / needed
        if share >= EXPLAINS:  # a NaN does not
            return Verdict(cause, name, min(share, 1.0))
    return Verdict(UNKNOWN, "", 0.0)


def is_own(late: LateTick) -> bool:
    """Whether the cycle before explains it."""
    return late.own_ns >= EXPLAINS * late.late_ns


def _seen(late: LateTick, rise: Rise, its: Seen, late_sum_ns: float) -> Verdict:
    """The cause of a tick of which the scheduler told what the loop did."""
    half, own, (held, name, held_ns) = EXPLAINS * late.late_ns, is_own(late), its.held()
    rest = replace(rise, seen=None, run_delay_ns=0.0, softirqs=None, interrupts=None, tasks=())
    # by the counters: to the scheduler a loop that is stopped, or has used up its quota, merely sleeps
    exact = judge(late, Rise(stopped=rise.stopped, throttled_ns=rise.throttled_ns), late_sum_ns)
    if exact.cause in {"stopped", "quota"}:
        return exact
    if held_ns >= half:
        return Verdict(held, name, min(held_ns / late.late_ns, 1.0))
    if not own and its.slept >= half:
        slack_ns = max(its.slack, 0.0 if math.isnan(rise.timer_slack_ns) else rise.timer_slack_ns)
        # asleep, it touched no memory and waited for no task
        rest = replace(rest, minor_faults=0.0, major_faults=0.0, timer_slack_ns=slack_ns)
        by_count, else_it_is = judge(late, rest, late_sum_ns), "late timer"
        share = its.slept / late.late_ns
    elif own or its.ran >= half:
        rest = replace(rest, timer_slack_ns=0.0)
        # on a guest: who had the core and did not get on had it taken by somebody below
        by_count, else_it_is = judge(late, rest, late_sum_ns), "steal" if rise.guest else UNKNOWN
        share = its.ran / late.late_ns
    else:
        return Verdict(UNKNOWN, "", 0.0)
    if by_count.cause != UNKNOWN or else_it_is == UNKNOWN:
        return by_count
    return Verdict(else_it_is, "", min(share, 1.0))


def _own(late: LateTick, rise: Rise, needed: float) -> list[tuple[str, str, float]]:
    """The cycle before, unless something else explains why that one was long."""
    if not is_own(late):
        return []
    if rise.major_faults > 0 or _fault_ns(rise) >= EXPLAINS * needed:
        return [("page fault", late.phase, needed)]
    # at the clock of before it would have taken as much less
    if late.cycle_ns * rise.slower >= EXPLAINS * late.own_ns:
        return [("frequency change", _of_clock(rise), needed)]
    counted = (_counted(rise.softirqs)[1], _counted(rise.interrupts)[1])
    others = (rise.run_delay_ns, rise.steal_ns, rise.smis * SMI_NS, *counted)
    if any(explained >= EXPLAINS * needed for explained in others):
        return []
    return [("own cycle", late.phase, late.own_ns / late.late_ns * needed)]


def _fault_ns(rise: Rise) -> float:
    return rise.minor_faults * MINOR_FAULT_NS + rise.major_faults * MAJOR_FAULT_NS


def _of_clock(rise: Rise) -> str:
    return "heat" if rise.too_hot else ""


def _kept_waiting(late: LateTick, rise: Rise) -> list[tuple[str, str, float]]:
    """Who had the core while the loop was ready to run.

    Notes
    -----
    In this order: tasks that may preempt the loop, if they are likely to have run for long enough; deferred
    work of the kernel and interrupts; tasks that may preempt it and can have run for long enough; one that
    may and has ended, if there is one only; a task that may not, and was in a section of the kernel that
    cannot be preempted. A task that may not preempt the loop rules out no softirq: the kernel counts those as
    run time of whom they interrupt."""
    delay = rise.run_delay_ns
    if not delay > 0:  # not `<= 0`: NaN where the kernel does not count it
        return []
    held, long = EXPLAINS * delay, EXPLAINS * min(delay, late.late_ns)
    ours = [one for one in rise.tasks if one.may_preempt and not one.name.startswith(SOFTIRQ_TASK)]
    known = [one for one in ours if one.ran_ns >= 0]
    ended = [one for one in ours if not one.ran_ns >= 0]
    kernels = sum(one.ran_ns for one in rise.tasks if one.name.startswith(SOFTIRQ_TASK) and one.ran_ns >= 0)
    softirq, softirq_ns = _counted(rise.softirqs)
    interrupt, interrupt_ns = _counted(rise.interrupts)
    name = next((one.name for one in known if one.ran_ns >= EXPLAINS * long), "")
    task = [("another task", name, delay)]
    if sum(one.likely_ns for one in known) >= long:
        return task
    if kernels >= long or softirq_ns >= held:
        return [("softirq", softirq, delay)]
    if interrupt_ns >= held:
        return [("interrupt", interrupt, delay)]
    if sum(one.ran_ns for one in known) >= long:
        return task
    if len(ended) == 1:
        return [("another task", ended[0].name, delay)]
    name = next((one.name for one in rise.tasks if one.ran_ns >= long), "")
    return [("another task", name, delay)]


def _counted(numbers: Mapping[str, float] | None) -> tuple[str, float]:
    """The most frequent by name, and the time that they may have taken, ns."""
    if not numbers:
        return "", float("nan")
    name = max(numbers, key=lambda one: numbers[one])
    return name, numbers[name] * INTERRUPT_NS
