"""The lease: who may move the proxy. At most one client, until it is stopped, releases it, or falls silent.

The loop enforces it a second time: it takes a target only with the epoch and the number of the lease it
knows. Here it is bound to the client's authenticated user id, so a number that leaked is of no use."""

from __future__ import annotations

import math
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass

from rtctl.host.exchange.messages import Refusal
from rtctl.host.exchange.veiled_leases import NUMBER_BITS

SILENCE_S = 1.0
"""A holder that neither renews nor sends targets for this long loses the lease."""

SILENCE_TICKS = 200
"""Ticks of silence after which the lease is lost on slow rigs: the loop lets go of a silent holder after half
as many."""


@dataclass(frozen=True)
class Lease:
    """A lease that was given: its number (1 to 2^62), to whom, and the epoch it belongs to."""

    number: int
    user_id: str
    holder: str
    epoch: int

    @property
    def text(self) -> str:
        """The number as the client gets it: every language can hold it."""
        return f"{self.number:016x}"


class LeaseDesk:
    """Gives the lease, renews it, takes it back.

    Parameters
    ----------
    rate_hz
        Rate of the loop.
    clock_s
        A clock that never goes back, s.

    Attributes
    ----------
    ended : str
        Why the last lease ended, for the refusal its holder meets."""

    def __init__(self, rate_hz: float, clock_s: Callable[[], float] = time.monotonic) -> None:
        self.silence_s = max(SILENCE_S, SILENCE_TICKS / rate_hz)
        self.ended = "none was given"
        self._clock_s = clock_s
        self._lease: Lease | None = None
        self._until_s = -math.inf

    def present(self, epoch: int) -> Lease | None:
        """The lease in force in this epoch, or None."""
        if self._lease is not None and self._lease.epoch != epoch:
            self.end("a stop or a fault ended it")
        # looked at when somebody asks: no timer runs
        elif self._lease is not None and self._clock_s() > self._until_s:
            self.end(f"its holder was silent for {self.silence_s:g} s")
        return self._lease

    def claim(self, user_id: str, holder: str, epoch: int, *, loop_holds: bool) -> Lease | Refusal:
        """Give the lease, or say who has it.

        Parameters
        ----------
        user_id, holder
            Who asks: as authenticated, and as people call it.
        epoch
            The present one.
        loop_holds
            The loop still holds a lease: of the present holder, or of the one before."""
        lease = self.present(epoch)
        if lease is not None:
            return Refusal(
                "lease_taken",
                f"{lease.holder} holds the lease: wait until it releases it or is silent for "
                f"{self.silence_s:g} s, or stop the rig, which ends it",
            )
        # the loop first lets go: two renderers must not have one proxy between them
        if loop_holds:
            return Refusal("lease_taken", "the loop still follows the last holder: ask again in 0.1 s")
        number = secrets.randbits(NUMBER_BITS) or 1  # 0 is no lease in the loop's records
        # a random number: who had the lease before cannot guess it
        self._lease = Lease(number, user_id, holder, epoch)
        self._until_s = self._clock_s() + self.silence_s
        return self._lease

    def renew(self, user_id: str, text: str, epoch: int) -> Lease | Refusal:
        """Prolong the lease of its holder; every target does so too."""
        lease = self.present(epoch)
        if lease is None:
            return Refusal("lease_lost", f"this lease is over: {self.ended}; ask for a new one")
        # both: a text that leaked is of no use to another user
        if lease.text != text or lease.user_id != user_id:
            return Refusal("lease_lost", f"{lease.holder} holds the lease now")
        self._until_s = self._clock_s() + self.silence_s
        return lease

    def end(self, why: str) -> None:
        """Take the lease back."""
        if self._lease is not None:
            # the reason stays: whoever held it asks only afterwards
            self._lease, self.ended = None, why
