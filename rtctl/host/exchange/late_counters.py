"""What the kernel counts on the loop's core and of the loop, read from /proc by an ordinary service; all of
it optional."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rtctl.host.exchange.late_core import NAN, CoreClock, Interruptions, core_clock, number
from rtctl.host.exchange.late_verdict import Rise

_STATE, _MINOR, _MAJOR, _CORE, _PRIORITY = 0, 7, 9, 36, 37
"""Places in /proc/PID/stat behind the name of the task (proc(5): fields 3, 10, 12, 39 and 40)."""

_THROTTLED = {"throttled_usec": 1e3, "throttled_time": 1.0}
"""How a control group of version 2 and 1 calls the time for which it was held, and its unit, ns."""

FEW = 20
"""Interrupts between two readings that say nothing."""

_STEAL = 8
"""Place in a line of /proc/stat, in clock ticks."""

_PACKETS, _PACKETS_CORE = 0, 12
"""Places in a line of /proc/net/softnet_stat, hexadecimal: packets received, and the core (not in old
kernels: lines are in order)."""

NET_RX = "NET_RX"

SELDOM_NS = 5_000_000_000
"""From one look at clock and SMIs to the next while no tick is late: some kernels ask the core itself, a
microsecond of its time."""


@dataclass(frozen=True)
class Reading:
    """One look at everything. Counters only rise; NaN or empty where this machine does not tell."""

    at_ns: int
    run_delay_ns: float = NAN
    minor_faults: float = NAN
    major_faults: float = NAN
    steal_ns: float = NAN
    throttled_ns: float = NAN
    group: str = ""
    """File with `throttled_ns`: that of another control group says nothing of this one."""
    stopped: bool = False
    timer_slack_ns: float = NAN
    priority: int = 0
    """Real-time priority of the loop; 0: none."""
    softirqs: Mapping[str, int] = field(default_factory=dict)
    interrupts: Mapping[str, int] = field(default_factory=dict)
    idle: Mapping[str, tuple[int, float]] = field(default_factory=dict)
    """Idle states: how often entered, and how long the way out takes, ns."""
    clock: CoreClock = field(default_factory=CoreClock)
    smis: float = NAN
    guest: bool = False
    """The processor says that there is a hypervisor."""


class Counters:
    """Reads them. Files stay open: each look is one read of each, some tens of microseconds in all.

    Parameters
    ----------
    pid
        The loop's process, whose only thread is the loop.
    core
        The core that it runs on; None: ask where it last ran, look by look.
    root
        Where /proc and /sys are, for tests."""

    def __init__(self, pid: int, core: int | None = None, root: Path = Path("/")) -> None:
        self._root, self._core, self._pid = root, core, pid
        self._files: dict[str, int] = {}
        self._stat, self._sched = f"proc/{pid}/stat", f"proc/{pid}/schedstat"
        self._slack = f"proc/{pid}/timerslack_ns"
        self._tick_ns = 1e9 / os.sysconf("SC_CLK_TCK")
        self._group = f"proc/{pid}/cgroup"
        self._smis: Interruptions | None = None
        self._asked_ns, self._asked_core = 0, -1
        self._clock, self._smi_count = CoreClock(), NAN
        self._guest = " hypervisor" in self._read("proc/cpuinfo")

    @property
    def core(self) -> int:
        """Core that is looked at."""
        return 0 if self._core is None else self._core

    def look(self, at_ns: int, *, late: bool = True) -> Reading:
        """Everything now. Clock and SMIs are those of before, unless a tick was `late` or `SELDOM_NS` have
        passed."""
        # behind the last bracket: a task's name may hold brackets and spaces (proc(5))
        own = self._read(self._stat).rpartition(")")[2].split()
        if len(own) > _CORE:
            self._core = int(own[_CORE])
        known = len(own) > _MAJOR
        delay = self._read(self._sched).split()
        if late or at_ns - self._asked_ns >= SELDOM_NS or self._asked_core != self.core:
            self._ask_core(at_ns)
        # the blank: cpu1 is the beginning of cpu10
        core = next((line for line in self._lines("proc/stat") if line.startswith(f"cpu{self.core} ")), "")
        steal, group = core.split(), self._quota_file()
        return Reading(
            at_ns=at_ns,
            run_delay_ns=float(delay[1]) if len(delay) > 1 else NAN,
            minor_faults=float(own[_MINOR]) if known else NAN,
            major_faults=float(own[_MAJOR]) if known else NAN,
            steal_ns=float(steal[_STEAL]) * self._tick_ns if len(steal) > _STEAL else NAN,
            throttled_ns=self._throttled_ns(group),
            group=group,
            stopped=known and own[_STATE] in "Tt",
            # slack is for ordinary tasks only (prctl(2)); a look costs an open file
            timer_slack_ns=NAN if _priority(own) else number(self._read(self._slack)),
            priority=_priority(own),
            softirqs=self._softirqs(),
            interrupts=self._by_core("proc/interrupts"),
            idle=self._idle(),
            clock=self._clock,
            smis=self._smi_count,
            guest=self._guest,
        )

    def stopped(self) -> bool:
        """Whether the loop is stopped by a signal now, or was and goes on since this was last asked.

        The second is told to the loop's parent only, which the host is."""
        with suppress(ChildProcessError):  # without WEXITED: its end is for subprocess to reap
            if os.waitid(os.P_PID, self._pid, os.WSTOPPED | os.WCONTINUED | os.WNOHANG) is not None:
                return True
        return self._read(self._stat).rpartition(")")[2].split()[:1] in (["T"], ["t"])

    def close(self) -> None:
        """Close the files."""
        for descriptor in self._files.values():
            os.close(descriptor)
        self._files.clear()
        if self._smis is not None:
            self._smis.close()

    def _read(self, name: str) -> str:
        """Text of a file, from its begin; empty when it cannot be read."""
        if name in self._files:
            try:
                # offset 0 makes the kernel write the file anew: no open and close for each look
                return os.pread(self._files[name], 1 << 16, 0).decode("ascii", "replace")
            except OSError:  # of a control group that is gone; there may be another of its name
                os.close(self._files.pop(name))
        try:
            self._files[name] = os.open(self._root / name, os.O_RDONLY | os.O_CLOEXEC)
            return os.pread(self._files[name], 1 << 16, 0).decode("ascii", "replace")
        except OSError:
            return ""

    def _lines(self, name: str) -> list[str]:
        return self._read(name).splitlines()

    def _by_core(self, name: str) -> dict[str, int]:
        """Counts of a table with a column per core, by what stands last in the row, or first where that is
        all."""
        head, *rows = self._lines(name) or [""]
        cores = head.split()
        wanted = f"CPU{self.core}"
        if wanted not in cores:
            return {}
        found = {}
        for row in rows:
            label, _, rest = row.partition(":")
            words = rest.split()
            with suppress(ValueError, IndexError):
                device = " ".join(words[len(cores) :][-1:])
                found[f"{label.strip()} {device}".strip()] = int(words[cores.index(wanted)])
        return found

    def _softirqs(self) -> dict[str, int]:
        """By name; packets count besides, as one softirq receives up to some hundred."""
        found = self._by_core("proc/softirqs")
        for index, line in enumerate(self._lines("proc/net/softnet_stat") if NET_RX in found else []):
            words = line.split()
            core = int(words[_PACKETS_CORE], 16) if len(words) > _PACKETS_CORE else index
            if core == self.core:
                found[NET_RX] += int(words[_PACKETS], 16)
        return found

    def _ask_core(self, at_ns: int) -> None:
        if self._smis is None or self._asked_core != self.core:
            if self._smis is not None:
                self._smis.close()
            self._smis = Interruptions(self.core, self._root)
        self._asked_ns, self._asked_core = at_ns, self.core
        self._clock, self._smi_count = core_clock(self._read, self.core), self._smis.count()

    def _idle(self) -> dict[str, tuple[int, float]]:
        found = {}
        folder = f"sys/devices/system/cpu/cpu{self.core}/cpuidle"
        for state in range(10):  # ten: cpuidle knows no more states (CPUIDLE_STATE_MAX)
            usage = number(self._read(f"{folder}/state{state}/usage"))
            if not math.isfinite(usage):
                break
            name = self._read(f"{folder}/state{state}/name").strip()
            found[name] = (int(usage), 1e3 * number(self._read(f"{folder}/state{state}/latency")))
        return found

    def _quota_file(self) -> str:
        """Where the loop's control group counts how long it was held, of version 2 or 1; empty where there is
        none."""
        found = ""
        for line in self._lines(self._group):
            # hierarchy:controllers:path; the path may hold colons (cgroups(7))
            _, controllers, path = line.split(":", 2)
            # version 1 wins: a hybrid machine has both, and there version 2 holds no controllers
            if "cpu" in controllers.split(","):
                return f"sys/fs/cgroup/{controllers}{path.rstrip('/')}/cpu.stat"
            if not controllers:
                found = f"sys/fs/cgroup{path.rstrip('/')}/cpu.stat"
        return found

    def _throttled_ns(self, group: str) -> float:
        for line in self._lines(group) if group else []:
            name, _, value = line.partition(" ")
            if name in _THROTTLED:
                return _THROTTLED[name] * number(value)
        return NAN


def _priority(own: list[str]) -> int:
    return int(own[_PRIORITY]) if len(own) > _PRIORITY else 0


def rise(before: Reading, after: Reading, usual: Mapping[str, float]) -> Rise:
    """What rose from one reading to the next; `usual` is what each soft and hard interrupt usually does in a
    second."""
    seconds = (after.at_ns - before.at_ns) / 1e9
    entered = [
        exit_ns
        for name, (count, exit_ns) in after.idle.items()
        # before.get(..., count): a state or a name that is new has no rise
        if count > before.idle.get(name, (count, 0))[0]
    ]
    return Rise(
        run_delay_ns=after.run_delay_ns - before.run_delay_ns,
        steal_ns=after.steal_ns - before.steal_ns,
        throttled_ns=after.throttled_ns - before.throttled_ns if after.group == before.group else NAN,
        minor_faults=after.minor_faults - before.minor_faults,
        major_faults=after.major_faults - before.major_faults,
        stopped=before.stopped or after.stopped,
        # fmax: known at one end is enough
        timer_slack_ns=float(np.fmax(before.timer_slack_ns, after.timer_slack_ns)),
        idle_exit_ns=max(entered, default=NAN),
        smis=after.smis - before.smis,
        slower=1.0 - after.clock.khz / before.clock.khz if before.clock.khz > 0 else NAN,
        clock_change_ns=(after.clock.changes - before.clock.changes) * after.clock.change_ns,
        too_hot=after.clock.throttled > before.clock.throttled,
        softirqs=_beyond(before.softirqs, after.softirqs, usual, seconds),
        interrupts=_beyond(_devices(before), _devices(after), usual, seconds),
        guest=after.guest,
    )


def _devices(reading: Reading) -> dict[str, int]:
    """Interrupts of devices, which bear a number: those of the kernel's own (timers, calls from core to core)
    come with each task that ran."""
    return {name: count for name, count in reading.interrupts.items() if name[:1].isdigit()}


def rates(before: Reading, after: Reading) -> dict[str, float]:
    """Soft and hard interrupts a second, by name."""
    seconds = max((after.at_ns - before.at_ns) / 1e9, 1e-9)
    risen = {**_risen(before.softirqs, after.softirqs), **_risen(before.interrupts, after.interrupts)}
    return {name: count / seconds for name, count in risen.items()}


def _risen(before: Mapping[str, int], after: Mapping[str, int]) -> dict[str, int]:
    return {name: count - before.get(name, count) for name, count in after.items()}


def _beyond(
    before: Mapping[str, int], after: Mapping[str, int], usual: Mapping[str, float], seconds: float
) -> dict[str, float]:
    """Rises beyond three times what is usual in as much time, and a few: less is chance."""
    found = {
        name: count - 3 * usual.get(name, 0.0) * seconds - FEW
        for name, count in _risen(before, after).items()
    }
    return {name: beyond for name, beyond in found.items() if beyond > 0}
