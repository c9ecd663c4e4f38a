"""One device of a rig at work: its own tick, how fresh that is, and its name in whatever it raises."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hw.interface import (
    CHANNEL_FIELDS,
    OPTIONAL_FIELDS,
    Backend,
    BackendError,
    CompiledBackend,
    LinkFault,
    LinkLost,
    SpeakingBackend,
    Words,
)
from hw.member import Member
from hw.refusals import mistake_of, raised_by, words_of
from hw.rig_words import Exchange, device_dtype

REST_TICKS = 2
"""Most cycles a device rests after it overran its budget: one more and a lone hiccup would be a stale
sample."""

# one and two may be the machine: three in a row are the device
SLOW_READS = 3
SLOW_REST_TICKS = 10
"""After this many overruns in a row a device rests so long: its sample goes stale."""

_LOST = int(LinkFault.LOST)
# older than any sample may be, and far from the end of 64 bits however long it ages
_NEVER = 1 << 40


@dataclass(frozen=True)
class Said:
    """What one device of a rig says: its words, bits of `LinkFault` it shows, and whether its sample is too
    old."""

    label: str
    axes: tuple[int, ...]
    faults: int
    stale: bool
    words: tuple[Words, ...] = ()


def words_of_device(backend: Backend) -> tuple[Words, ...]:
    """What it says of itself; nothing where it has no words, the mistake where there is one."""
    if not isinstance(backend, SpeakingBackend):
        return ()
    told: list[Words] = []
    error = raised_by(lambda: told.extend(backend.words()))
    return (Words(f"words: {words_of(error)}"),) if error else tuple(told)


class Device:
    """One member at work: its backend, its own tick, its freshness."""

    def __init__(self, member: Member, backend: Backend) -> None:
        self.member, self.backend = member, backend
        self.budget_ns, self.max_age_ticks = member.budget_ns, member.max_age_ticks
        self._read: Callable[..., None] = backend.read
        self._write: Callable[..., None] = backend.write
        self.provides = frozenset(member.channels) & backend.provides
        self.consumes = frozenset(member.channels) & backend.consumes
        # nothing has come: it must not look like a sample of this cycle
        self.age = _NEVER
        self.rest = self.overruns = self.overruns_in_a_row = 0
        self.tick: np.ndarray | None = None

    def bind(self, tick: np.ndarray) -> None:
        """Prepare the exchange with `tick`; the device's own tick stays the same one."""
        if self.tick is None:
            self.tick = np.zeros(1, device_dtype(tick.dtype, len(self.member.axes)))
            for name in OPTIONAL_FIELDS:
                self.tick[name] = np.nan
        fields = [CHANNEL_FIELDS[channel] for channel in sorted(self.provides)]
        exchange = Exchange(tick, self.tick, self.member.axes, fields, commanded=bool(self.consumes))
        self.deliver, self._lead_in, self._command = exchange.deliver, exchange.lead_in, exchange.command
        self._words, self._sample_count = exchange.words, exchange.sample_count
        self._link_faults, self._estop = exchange.link_faults, exchange.estop

    def read(self, elapsed: int) -> int:
        """Read the device and see whether there is a new sample. Returns bits of `LinkFault`.

        Raises
        ------
        BackendError, DeviceMistakeError
            Naming the device."""
        words, count = self._words, self._sample_count
        # its own tick keeps the count: a device that is opened anew may begin at any number
        before = words[count]
        self._lead_in()
        try:
            self._read(self.tick)
        except Exception as error:  # of code from anywhere: a loss or a mistake, told with the device's name
            raise self._named(error, "read") from error
        # more, not other: a count that falls is a device that was powered anew, and no new sample
        self.age = 0 if words[count] > before else self.age + elapsed
        return int(words[self._link_faults])

    def over(self, spent_ns: int) -> bool:
        """True when the reading took longer than its budget; the device then rests."""
        if spent_ns <= self.budget_ns:
            self.overruns_in_a_row = 0
            return False
        self.overruns += 1
        self.overruns_in_a_row += 1
        slow = self.overruns_in_a_row >= SLOW_READS
        # as long as the overrun lasted, at most two cycles: the others get back what it took
        self.rest = SLOW_REST_TICKS if slow else min(spent_ns // self.budget_ns, REST_TICKS)
        return True

    def write(self) -> None:
        """Send the device its part of the command. Raises BackendError naming it."""
        self._command()
        try:
            self._write(self.tick)
        except Exception as error:  # of code from anywhere: a loss or a mistake, told with the device's name
            raise self._named(error, "write") from error

    def open(self) -> None:
        """Acquire the device; nothing from before is fresh any more. Raises BackendError naming it."""
        self.age, self.rest, self.overruns_in_a_row = _NEVER, 0, 0
        try:
            self.backend.open()
        except Exception as error:  # of code from anywhere: a loss or a mistake, told with the device's name
            raise self._named(error, "open") from error

    def warm_up(self) -> None:
        """Have it compile what it calls. Raises DeviceMistakeError naming it."""
        if isinstance(self.backend, CompiledBackend) and self.tick is not None:
            try:
                self.backend.warm_up(self.tick)
            except Exception as error:  # likewise
                raise self._named(error, "warm_up") from error

    def _named(self, error: Exception, doing: str) -> Exception:
        """A mistake of the device's code, or its loss, with its name."""
        if not isinstance(error, BackendError | OSError):
            return mistake_of(self.member.place, doing, error)
        if self.tick is not None:
            self._words[self._link_faults] = _LOST  # until it is read again: `said` then names it
        # OSError: of a driver that has no words of its own
        kind = type(error) if isinstance(error, BackendError) else LinkLost
        return kind(f"{self.member.label}: {error}")

    def said(self) -> Said:
        """What it says after this cycle."""
        faults = 0 if self.tick is None else int(self._words[self._link_faults])
        stale = bool(self.provides) and self.age > max(self.max_age_ticks, REST_TICKS)
        return Said(self.member.label, self.member.axes, faults, stale, words_of_device(self.backend))

    @property
    def stopped(self) -> bool:
        """Whether its emergency stop input is pressed."""
        return bool(self._words[self._estop])
