"""Real-time rights: ask for each, report what was granted, name the remedy for what was refused."""

from __future__ import annotations

import ctypes
import gc
import os
from dataclasses import asdict, dataclass
from pathlib import Path

from rtctl.rt import core

_MCL_CURRENT, _MCL_FUTURE = 1, 2
_PR_SET_TIMERSLACK = 29
_DMA_LATENCY = Path("/dev/cpu_dma_latency")


@dataclass(frozen=True)
class Grant:
    """One right asked for: was it granted, and if not, why and what to do."""

    right: str
    granted: bool
    required: bool
    detail: str

    def as_dict(self) -> dict[str, object]:
        """Plain values for JSON."""
        return asdict(self)


def acquire(priority: int, cpu: int) -> tuple[list[Grant], list[int]]:
    """Ask for SCHED_FIFO, locked memory, a core, and quick wake-ups; freeze the garbage collector.

    Parameters
    ----------
    priority
        SCHED_FIFO priority, 1 to 98.
    cpu
        Core to stay on; -1: a quiet one of those this process may use (`rtctl.rt.core`).

    Returns
    -------
    grants
        One per right, in the order asked.
    held
        File descriptors that must stay open while the rights are to last."""
    held: list[int] = []
    # memory first: its pages are fetched while others may still run
    grants = [_lock_memory()]
    with core.turn():  # until others see it as one that keeps to its core
        grants += [_affinity(cpu), _fifo(priority)]
    grants += [_dma_latency(held), _timer_slack()]
    gc.collect()
    gc.freeze()
    # a collection in a cycle would be a late tick
    gc.disable()
    grants.append(
        Grant("gc-freeze", granted=True, required=False, detail="garbage collector off, objects frozen")
    )
    return grants, held


def complete(grants: list[Grant]) -> bool:
    """True when every required right was granted."""
    return all(grant.granted for grant in grants if grant.required)


def _fifo(priority: int) -> Grant:
    try:
        # not SCHED_DEADLINE: the same timer wakes it, as late, and a look spends its budget (decision 0024)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError as error:
        remedy = (
            f"{error.strerror}; in the unit: LimitRTPRIO={priority}; in a shell: ulimit -r {priority} "
            "(limits.conf rtprio)"
        )
        return Grant("sched-fifo", granted=False, required=True, detail=remedy)
    return Grant("sched-fifo", granted=True, required=True, detail=f"priority {priority}")


def _lock_memory() -> Grant:
    # future pages, too: a page that is fetched in a cycle makes the tick late by a disk
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE) != 0:
        reason = os.strerror(ctypes.get_errno())
        remedy = (
            f"{reason}; in the unit: LimitMEMLOCK=infinity; in a shell: ulimit -l unlimited (limits.conf "
            "memlock)"
        )
        return Grant("mlockall", granted=False, required=True, detail=remedy)
    return Grant("mlockall", granted=True, required=True, detail="all pages, present and future")


def _affinity(cpu: int) -> Grant:
    allowed = os.sched_getaffinity(0)
    taken = core.held()
    wanted, why = core.choose(cpu, allowed, taken=taken)
    others = "".join(f"; process {taken[n]} keeps to core {n}" for n in sorted(allowed & taken.keys()))
    try:
        os.sched_setaffinity(0, {wanted})
    except OSError as error:
        remedy = (
            f"core {wanted}: {error.strerror}; this process may use {sorted(allowed)}: set loop.cpu to one "
            "of them or -1"
        )
        return Grant("affinity", granted=False, required=False, detail=remedy)
    remedy = (
        ", in real time too: each makes the other late; set loop.cpu of one of them to another core"
        if wanted in taken
        else ""
    )
    return Grant(
        "affinity", granted=not remedy, required=False, detail=f"core {wanted}: {why}{others}{remedy}"
    )


def _dma_latency(held: list[int]) -> Grant:
    try:
        fd = os.open(_DMA_LATENCY, os.O_WRONLY | os.O_CLOEXEC)
        held.append(fd)
        # a signed 32-bit number of us, wanted for as long as the file is open (pm_qos)
        os.write(fd, (0).to_bytes(4, "little"))
    except OSError as error:
        remedy = (
            f"{_DMA_LATENCY}: {error.strerror}; give the group write access by a udev rule, or ignore on a "
            "desktop"
        )
        return Grant("cpu-dma-latency", granted=False, required=False, detail=remedy)
    return Grant("cpu-dma-latency", granted=True, required=False, detail="0 us")


def _timer_slack() -> Grant:
    # 1 ns; 0 would be the usual slack (prctl(2))
    ok = ctypes.CDLL(None).prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0) == 0
    return Grant(
        "timer-slack",
        granted=ok,
        required=False,
        detail="1 ns" if ok else "prctl refused it; harmless under SCHED_FIFO",
    )
