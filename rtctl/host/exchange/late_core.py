"""What a core's clock did, and how often its firmware took it: counters of /sys, and one of
perf_event_open(2)."""

from __future__ import annotations

import ctypes
import os
import struct
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

NAN = float("nan")

# syscall numbers of the kernel's tables: glibc has no wrapper for it
_PERF_EVENT_OPEN = {"x86_64": 298, "aarch64": 241}
"""Number of the system call by processor."""

# 128 bytes, PERF_ATTR_SIZE_VER7: an older kernel takes them while what it does not know is zero
_ATTRIBUTES = struct.Struct("<IIQ112x")
"""Begin of struct perf_event_attr: type, size and event; zeros are what the rest is for a counter that is
only read."""

_CLOEXEC = 8  # PERF_FLAG_FD_CLOEXEC

_ETERNAL_NS = 4_294_967_295
"""What a driver says that does not know how long a change takes."""


class CoreClock(NamedTuple):
    """One look. Counters only rise; NaN where this machine does not tell.

    Attributes
    ----------
    khz
        Frequency of the core's clock.
    changes, change_ns
        How often the frequency was changed, and for how long a change holds the core up, ns.
    throttled
        How often the core was slowed down because it was too hot."""

    khz: float = NAN
    changes: float = NAN
    change_ns: float = NAN
    throttled: float = NAN


def core_clock(read: Callable[[str], str], core: int) -> CoreClock:
    """The core's clock, by a function that returns a file's text, or nothing (names without the leading
    /)."""
    folder = f"sys/devices/system/cpu/cpu{core}"
    # files of /sys that a driver does not have read as nothing, and that is NaN: no verdict goes by them
    latency = number(read(f"{folder}/cpufreq/cpuinfo_transition_latency"))
    return CoreClock(
        khz=number(read(f"{folder}/cpufreq/scaling_cur_freq")),
        changes=number(read(f"{folder}/cpufreq/stats/total_trans")),
        change_ns=latency if latency < _ETERNAL_NS else NAN,
        throttled=number(read(f"{folder}/thermal_throttle/core_throttle_count")),
    )


def perf_event(attributes: bytes, core: int) -> int:
    """Descriptor of an event of one core, for all tasks, by a struct perf_event_attr. Raises OSError where it
    is refused."""
    call = _PERF_EVENT_OPEN.get(os.uname().machine)
    if call is None:
        raise OSError("the number of perf_event_open(2) is not known for this processor")
    libc = ctypes.CDLL(None, use_errno=True)
    given = ctypes.create_string_buffer(attributes, len(attributes))
    # -1: every task, on that core; the second -1: no group
    found = int(libc.syscall(call, given, -1, core, -1, _CLOEXEC))
    if found < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return found


class Interruptions:
    """Counts the system management interrupts (SMI) of one core, where processor, kernel and rights
    (CAP_PERFMON) let it."""

    def __init__(
        self, core: int, root: Path = Path("/"), opened: Callable[[bytes, int], int] = perf_event
    ) -> None:
        self._file = -1
        folder = root / "sys/bus/event_source/devices/msr"
        with suppress(OSError, ValueError):
            kind = int((folder / "type").read_text())
            # by name: which register counts SMIs is the kernel's to know
            event = int((folder / "events/smi").read_text().strip().removeprefix("event="), 16)
            self._file = opened(_ATTRIBUTES.pack(kind, _ATTRIBUTES.size, event), core)

    def count(self) -> float:
        """Since the machine was started, or since this was made; NaN where nobody counts."""
        if self._file < 0:
            return NAN
        try:
            return float(struct.unpack("<Q", os.read(self._file, 8))[0])
        except (OSError, struct.error):
            return NAN

    def close(self) -> None:
        """Count no more."""
        if self._file >= 0:
            os.close(self._file)
        self._file = -1


def number(text: str) -> float:
    """NaN for a text that is no number."""
    try:
        return float(text)
    except ValueError:
        return NAN
