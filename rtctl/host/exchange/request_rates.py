"""How often a client may ask: a token bucket for each, of which there are a bounded number."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable

MOST_CLIENTS = 64
"""Buckets kept; the one unused for longest is forgotten first."""


class RateLimit:
    """Allows each client `rate_hz` messages a second on average, and `burst` at once.

    Parameters
    ----------
    rate_hz
        Lasting rate, 1/s, above 0.
    burst
        Messages allowed at once after a pause."""

    def __init__(self, rate_hz: float, burst: float, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._rate_hz = rate_hz
        self._burst = burst
        self._clock_s = clock_s
        self._buckets: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def allows(self, client: str) -> bool:
        """Whether `client` may send one more message now; takes a token if so."""
        now = self._clock_s()
        # taken out and put back: the order of the dict is then that of their last use
        tokens, seen = self._buckets.pop(client, (self._burst, now))
        tokens = min(self._burst, tokens + (now - seen) * self._rate_hz)
        allowed = tokens >= 1.0
        self._buckets[client] = (tokens - 1.0 if allowed else tokens, now)
        # a forgotten client begins with a whole burst again, which is bounded too
        if len(self._buckets) > MOST_CLIENTS:
            self._buckets.popitem(last=False)
        return allowed
