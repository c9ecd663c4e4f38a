"""Looks at the devices of a rig without moving anything: decoded values, rate, age, what the links have seen.

Nothing is armed and no torque is written. A backend whose devices answer only when asked asks them
(`AskedBackend`), without torque and disabled; `write` is called only on request, disabled and zero, for other
devices that answer nothing but commands."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from hw import registry
from hw.channels import READING
from hw.claims import Claims
from hw.interface import (
    CHANNEL_FIELDS,
    WHOLE_RIG_CHANNELS,
    AskedBackend,
    Backend,
    CompiledBackend,
    CountingBackend,
    LinkFault,
    SpeakingBackend,
)
from hw.member import Member
from hw.motion import unit
from hw.refusals import raised_by, words_of
from hw.rig_words import subset
from rtctl.errors import ConfigError
from rtctl.host.probe_force_zero import Tare
from rtctl.rig_file.axis_tables import AxisTable
from rtctl.rig_file.config import LoadedConfig
from rtctl.tick import FIELD, new_ticks

# a device whose words hold a counter says something else each time
MOST_COMPLAINTS = 16
"""Different words of one device in its faults that are kept."""

# four seconds at 1 kHz: whoever looks at a device sees it as it is now, and memory stays what it is
READ_TIMES = 4096
"""Durations of reading, and times between samples, that are kept: the latest ones."""


class DeviceProbe:
    """One device under observation.

    Attributes
    ----------
    member
        What the rig file says of it.
    error : str
        Why it cannot be read (any more); empty while it can."""

    def __init__(
        self, member: Member, backend: Backend, axes: Sequence[AxisTable], poll: bool, tare_samples: int = 0
    ) -> None:
        self.member, self.backend, self.error = member, backend, ""
        self._claims = Claims()
        self._axis_names, self._poll = [axis.name for axis in axes], poll and bool(backend.consumes)
        self._motions = [axis.motion for axis in axes]
        self._tare = Tare(tare_samples)
        self.tick = new_ticks(1, len(member.axes))
        self._fresh = self._cycles = 0
        self._began_ns = self._fresh_ns = 0
        self._age_max_ns = 0
        self._periods: deque[int] = deque(maxlen=READ_TIMES)
        self._faults = dict.fromkeys(LinkFault, 0)
        self._read_ns: deque[int] = deque(maxlen=READ_TIMES)
        self._sums: dict[str, np.ndarray] = {}
        self._complaints: dict[tuple[int, str], int] = {}

    def open(self) -> None:
        """Acquire the device; a failure is kept in `error`. To open a drive is to disarm it: never one that
        is driven."""
        self._works(self._acquire)
        self._began_ns = self._fresh_ns = time.monotonic_ns()

    def _acquire(self) -> None:
        self._claims.take(self.member.label, self.member.claims)
        self.backend.open()
        if isinstance(self.backend, CompiledBackend):
            # now: compiled in the first cycle it would count as one slow reading
            self.backend.warm_up(self.tick)

    def _works(self, action: Callable[[], object]) -> bool:
        """Do it; what the device, or a mistake in its code, raises is kept."""
        error = raised_by(action)
        if error is not None:
            self.error = words_of(error)
        return error is None

    def close(self) -> None:
        """Release the device."""
        self.backend.close()
        self._claims.release()

    def read(self, slot: int) -> None:
        """One cycle."""
        if self.error:
            return
        self.tick["tick"] = slot
        # the tick is kept from cycle to cycle: what a device does not send anew stays as it was read last
        before, began = int(self.tick["sample_count"][0]), time.monotonic_ns()
        if not self._works(lambda: self.backend.read(self.tick)):
            return
        ended = time.monotonic_ns()
        if self._works(self._send):
            self._note(fresh=int(self.tick["sample_count"][0]) > before, began=began, ended=ended)

    def _send(self) -> None:
        if self._poll:
            self.backend.write(self.tick)
        elif isinstance(self.backend, AskedBackend):
            self.backend.ask()

    def _note(self, *, fresh: bool, began: int, ended: int) -> None:
        self._cycles += 1
        self._read_ns.append(ended - began)
        faults = int(self.tick["link_faults"][0])
        if faults and isinstance(self.backend, SpeakingBackend):
            self._hear(self.backend)
        for fault in LinkFault:
            if faults & fault:
                self._faults[fault] += 1
        # before `_fresh_ns` moves: the age at its oldest is that just before the next sample
        self._age_max_ns = max(self._age_max_ns, ended - self._fresh_ns)
        if not fresh:
            return
        if self._fresh:  # the time from opening to the first sample is no period
            self._periods.append(ended - self._fresh_ns)
        self._fresh += 1
        self._fresh_ns = ended
        for channel in self.backend.provides:
            self._gather(channel)

    def _hear(self, backend: SpeakingBackend) -> None:
        """Keep what it says of its faults: a drive may clear them before anybody looks."""
        words = backend.words()
        whole = len(words) == 1
        for i, word in enumerate(words):
            if word.text and (whole or word.faults):
                said = (i, word.text)
                if said in self._complaints or len(self._complaints) < MOST_COMPLAINTS:
                    self._complaints[said] = self._complaints.get(said, 0) + 1

    def _words(self) -> list[dict[str, Any]]:
        """What the device says now, and what it said while it showed a fault; `cycles` counts the latter."""
        if not isinstance(self.backend, SpeakingBackend) or self.error:
            now = []
        else:
            now = [(i, word.text) for i, word in enumerate(self.backend.words()) if word.text]
        told = dict.fromkeys(now, 0) | self._complaints
        single = len({i for i, _ in told}) <= 1 and len(self._axis_names) > 1
        return [
            {
                "axis": None if single else self._axis_names[i],
                "text": text,
                "now": (i, text) in now,
                "fault_cycles": n,
            }
            for (i, text), n in told.items()
        ]

    def _gather(self, channel: str) -> None:
        value = np.atleast_1d(np.asarray(self.tick[CHANNEL_FIELDS[channel]][0], dtype=float))
        if channel == "force":
            self._tare.take(value)
        if channel not in self._sums:
            self._sums[channel] = np.stack([np.zeros_like(value), np.zeros_like(value), value, value, value])
        sums = self._sums[channel]
        off = value - sums[4]  # from the first sample: no cancellation in the variance
        sums[0] += off
        sums[1] += off * off
        sums[2], sums[3] = np.minimum(sums[2], value), np.maximum(sums[3], value)

    def report(self) -> dict[str, Any]:
        """Everything seen so far, as plain values."""
        now = time.monotonic_ns()
        seconds = max((now - self._began_ns) * 1e-9, 1e-9) if self._began_ns else 0.0
        read = np.array(self._read_ns or [0]) * 1e-3
        periods = np.array(self._periods) * 1e-6
        return {
            "device": self.member.label,
            "kind": self.member.kind,
            "error": self.error,
            "seconds": round(seconds, 3),
            "cycles": self._cycles,
            "samples": self._fresh,
            "rate_hz": round(self._fresh / seconds, 2) if seconds else 0.0,
            "age_ms": round((now - self._fresh_ns) * 1e-6, 3) if self._fresh else None,
            "age_max_ms": round(self._age_max_ns * 1e-6, 3),
            "period_ms": {
                "mean": round(float(periods.mean()), 4),
                "jitter": round(float(periods.std()), 4),
                "max": round(float(periods.max()), 4),
            }
            if len(periods)
            else None,
            "declared": f"one counts for {self.member.max_age_ticks} cycles"
            if self.member.max_age_ticks
            else "a new one in every cycle",
            "read_us": {"p50": round(float(np.median(read)), 2), "max": round(float(read.max()), 2)},
            "values": [value for channel in sorted(self.backend.provides) for value in self._values(channel)],
            "faults": {str(fault.name): count for fault, count in self._faults.items()},
            "words": self._words(),
            "counts": self.backend.counts() if isinstance(self.backend, CountingBackend) else {},
        }

    def _values(self, channel: str) -> Iterator[dict[str, Any]]:
        if channel not in self._sums:
            return
        field = CHANNEL_FIELDS[channel]
        latest = np.atleast_1d(np.asarray(self.tick[field][0], dtype=float))
        total, squares, low, high, _first = self._sums[channel]
        mean = total / self._fresh
        # max: of a constant value rounding leaves a variance just below 0
        spread = np.sqrt(np.maximum(squares / self._fresh - mean * mean, 0.0))
        force, whole_rig = channel == "force", channel in WHOLE_RIG_CHANNELS
        if force:
            latest, low, high = (self._tare.applied(values) for values in (latest, low, high))
        for i, value in enumerate(latest):
            yield {
                "channel": channel,
                "of": self._of(channel, i),
                "unit": unit(FIELD[field].unit, "rotary" if whole_rig else self._motions[i]),
                "value": float(value),
                "min": float(low[i]),
                "max": float(high[i]),
                "std": float(spread[i]),
                **(self._tare.note(i) if force else {}),
            }

    def _of(self, channel: str, i: int) -> str:
        if channel not in WHOLE_RIG_CHANNELS:
            return self._axis_names[i]
        return "xyz"[i] if READING[channel].shape == "xyz" else ""


def devices(loaded: LoadedConfig, only: str | None = None, *, poll: bool = False) -> list[DeviceProbe]:
    """The devices of a rig file, closed yet; `only` picks one by number or name.

    Raises
    ------
    ConfigError
        There is no device of that number or name."""
    config, found = loaded.config, []
    # the longest of all axes: one sensor serves them, and the daemon waits for all
    tare_samples = round(max(axis.force.tare_s for axis in config.axis) / config.period_s)
    for i, (table, member) in enumerate(zip(config.device, loaded.members(), strict=True)):
        if only is not None and only not in (str(i), table.name or table.kind):
            continue
        backend = registry.create(member.kind, member.options, subset(config.hardware(), member.axes))
        axes = [config.axis[axis] for axis in member.axes]
        found.append(DeviceProbe(member, backend, axes, poll, tare_samples))
    if not found:
        known = ", ".join(f"{i} ({table.name or table.kind})" for i, table in enumerate(config.device))
        raise ConfigError(f"{loaded.path}: no device {only!r}; there are {known}")
    return found


def watch(
    found: Sequence[DeviceProbe],
    period_s: float,
    seconds: float | None,
    show: Callable[[], None],
    every_s: float = 0.5,
) -> None:
    """Read all devices every period until `seconds` have passed, all are lost, or Ctrl-C; then close them.

    Raises
    ------
    KeyboardInterrupt
        Ctrl-C, after the devices were closed."""
    try:
        for device in found:
            # opened here, where `finally` closes all: the second one may refuse
            device.open()
        began = shown = time.monotonic()
        slot = 0
        while not all(device.error for device in found):
            now = time.monotonic()
            if seconds is not None and now - began >= seconds:
                return
            for device in found:
                device.read(slot)
            if now - shown >= every_s:
                shown = now
                show()
            # cycles that were missed are left out, not caught up
            slot = max(slot + 1, int((time.monotonic() - began) / period_s))
            time.sleep(max(began + slot * period_s - time.monotonic(), 0.0))
    finally:
        for device in found:
            device.close()
