"""Which core the loop takes where its rig file names none: a quiet one, and the same one at each start.

An interrupt of a device takes some microseconds of its core, and what the kernel puts off until after it (a
disk's finished blocks) hundreds. So the loop leaves the last core, which is the usual one, where devices
interrupt that core often and another one hardly.

The counts are those of /sys/kernel/irq, which a service that is shown nothing else of /proc sees as well.

It also leaves a core that another real-time process keeps to, as another rig's loop does: on one core each
would be late by what the other takes (decision 0141)."""

from __future__ import annotations

import fcntl
import os
import re
import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

BUSY_HZ = 1.0
"""A core or device with more interrupts than that, on average since the machine was started, is busy."""

FEWER = 4.0
"""The last core is left for one that devices interrupt so many times less often: what a day does to the
counts does not change the choice."""

TURN_S = 1.0
"""Longest wait for another loop that looks for its core: anybody who may read this file could hold it up."""

_KERNEL_THREAD = 0x0020_0000
"""PF_KTHREAD of a task's flags: the kernel keeps some real-time threads to each core."""

_CPU = Path("sys/devices/system/cpu")

_OF_A_CORE = re.compile(r"timer|^IPI|pmu", re.IGNORECASE)
"""Interrupts that bear a number on some processors (ARM, RISC-V) and yet are each core's own: they follow
the loop wherever it runs."""


class Interrupts(NamedTuple):
    """What came by one line since the machine was started."""

    devices: str
    """Who uses the line."""
    counts: tuple[int, ...]
    """By core."""

    def on(self, core: int) -> int:
        """How often it came to this core."""
        return self.counts[core] if core < len(self.counts) else 0


class Choice(NamedTuple):
    """A core, and why that one, in words."""

    core: int
    why: str


def since_start_s() -> float:
    """How long the machine has run, asleep or not."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


def interrupts(root: Path) -> dict[int, Interrupts]:
    """Those of devices, by number of the line; empty where the kernel does not tell."""
    found: dict[int, Interrupts] = {}
    # by number: the folder has nothing else, and a name that is none would end the start
    for folder in (root / "sys/kernel/irq").glob("[0-9]*"):
        devices, counts = _text(folder / "actions"), _text(folder / "per_cpu_count").split(",")
        # a line without a device is the kernel's own or unused: what it counts is no interrupt of ours
        if devices and not _OF_A_CORE.search(devices) and all(count.isdecimal() for count in counts):
            found[int(folder.name)] = Interrupts(devices, tuple(map(int, counts)))
    return dict(sorted(found.items()))


@contextmanager
def turn() -> Iterator[None]:
    """One loop at a time looks for its core and takes it: those of a machine that starts look together."""
    # of the very code: the one file that all rigs of a machine see, also under a hardened unit (0141)
    file = os.open(__file__, os.O_RDONLY | os.O_CLOEXEC)
    try:
        end = time.monotonic() + TURN_S
        while time.monotonic() < end:
            with suppress(OSError):  # another's turn, or a disk that knows no locks
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            time.sleep(0.005)
        # without the lock, too: who holds it for longer than TURN_S would keep every rig from starting
        yield
    finally:
        os.close(file)


def held(proc: Path = Path("/proc")) -> dict[int, int]:
    """Cores that other real-time processes keep to, and which process does, as far as this user sees them."""
    found: dict[int, int] = {}
    for pid in sorted(int(at.name) for at in proc.iterdir() if at.name.isdecimal()):
        with suppress(OSError, ValueError, IndexError):  # one that has ended meanwhile
            cores = os.sched_getaffinity(pid)
            # the flag is told with the policy, and says nothing of how this process runs
            policy = os.sched_getscheduler(pid) & ~os.SCHED_RESET_ON_FORK
            # one core alone: who may run on several leaves the loop's when the loop runs
            if len(cores) == 1 and policy in (os.SCHED_FIFO, os.SCHED_RR) and pid != os.getpid():
                # behind the last bracket: a process may have brackets and blanks in its name (proc(5))
                flags = int((proc / str(pid) / "stat").read_text().rpartition(")")[2].split()[6])
                if not flags & _KERNEL_THREAD:
                    found[cores.pop()] = pid
    return found


def choose(
    asked: int,
    allowed: set[int],
    root: Path = Path("/"),
    since_s: float | None = None,
    taken: Collection[int] = (),
) -> Choice:
    """The core that the loop takes.

    Parameters
    ----------
    asked
        `loop.cpu`: taken whatever else is so, unless it is -1.
    allowed
        Cores that this process may use; isolated ones come first.
    root
        Where /sys is, for tests.
    since_s
        How long the interrupts have been counted; None: since the machine was started.
    taken
        Cores that others keep to: left while there is another."""
    if asked >= 0:
        return Choice(asked, "loop.cpu")
    # better late by another loop than on no core: what that costs is told (`affinity`)
    allowed = allowed.difference(taken) or allowed
    kept = {
        name: cores_of(_text(root / _CPU / name)) & allowed
        for name in ("isolated", "nohz_full")  # the second without the first: no scheduler's tick there
    }
    those, kind = next(((cores, f", {name}") for name, cores in kept.items() if cores), (allowed, ""))
    lines = interrupts(root).values()
    counts = {core: sum(line.on(core) for line in lines) for core in those}
    # of equally quiet ones the last: the same choice at each start
    last, quiet = max(those), min(those, key=lambda core: (counts[core], -core))
    busy = BUSY_HZ * max(since_start_s() if since_s is None else since_s, 1.0)
    # both: few interrupts are no reason to move, and a disk with a queue for each core gives no better place
    if counts[last] < busy or counts[last] < FEWER * counts[quiet]:
        return Choice(last, f"the last one{kind}")
    most = max(lines, key=lambda line: line.on(last)).devices
    return Choice(
        quiet,
        f"devices interrupted it {counts[quiet]} times since the start of the machine, core {last} "
        f"{counts[last]} times (most by {most}){kind}",
    )


def cores_of(listed: str) -> set[int]:
    """Cores of a kernel's list such as `0-3,8`. Empty for an empty or unreadable one."""
    out: set[int] = set()
    for part in listed.split(","):
        first, _, last = part.strip().partition("-")
        if first.isdecimal() and (not last or last.isdecimal()):
            out |= set(range(int(first), int(last or first) + 1))
    return out


def _text(path: Path) -> str:
    try:
        return path.read_text(errors="replace").strip()
    except OSError:
        return ""
