"""Which ticks came late, by how much, and how much of it the loop's own cycle before took."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

PHASES = ("read", "law", "write", "record")
"""Parts of a cycle, in their order."""

EARLY_BOUND_NS, EARLY_SHARE = 50_000, 0.25
"""Late, where the loop looks at the clock before its deadline: more than this, or than this share of the
period."""

SLEPT_BOUND_NS, SLEPT_SHARE = 200_000, 0.5
"""Late, where it sleeps until the deadline: the kernel wakes it up to 100 us late as a matter of course."""


HARMLESS_SHARE = 0.02
"""Share of the period that is never late: a loop of 100 Hz that starts 100 us late on a machine that wakes up
slowly has lost nothing, and an event about it four times a second hides those that matter."""


def bound_ns(period_ns: int, early_ns: int) -> int:
    """Lateness above which a tick is late, ns: a fixed one, or what is harmless where that is more; at most a
    share of the period."""
    fixed, share = (EARLY_BOUND_NS, EARLY_SHARE) if early_ns > 0 else (SLEPT_BOUND_NS, SLEPT_SHARE)
    # the share last: at 20 kHz 200 us would be four periods
    return int(min(max(fixed, HARMLESS_SHARE * period_ns), share * period_ns))


@dataclass(frozen=True)
class LateTick:
    """One late tick.

    Attributes
    ----------
    tick, woke_ns
        Its number, and when it began, ns, CLOCK_MONOTONIC.
    late_ns
        From its deadline, or that of the first slot that was skipped before it, until it began.
    own_ns
        What of that the cycle before took beyond the period, 0 at least.
    phase
        The longest part of that cycle, of `PHASES`.
    cycle_ns
        How long all parts of that cycle took."""

    tick: int
    woke_ns: int
    late_ns: int
    own_ns: int
    phase: str
    cycle_ns: int = 0


def late_ticks(rows: np.ndarray, above_ns: int) -> list[LateTick]:
    """Late ticks among `rows[1:]`, in order; `rows` are ticks one after the other, the first one known
    before.

    Notes
    -----
    The deadline is that of the slot after the row before: slots that were skipped are lateness too, which
    `wakeup_ns` does not hold. The cycle before is what it read, decided and wrote, and `record_ns` of the row
    after it."""
    if len(rows) < 2:
        return []
    before, after = rows[:-1], rows[1:]
    period = _period_ns(before, after)
    late = after["time_ns"] - before["time_ns"] - period + after["wakeup_ns"]
    parts = np.stack([before["read_ns"], before["law_ns"], before["write_ns"], after["record_ns"]])
    cycle = parts.sum(axis=0)
    # its wake-up counts: a cycle that began late and took its usual time ends late as well
    own = np.maximum(before["wakeup_ns"] + cycle - period, 0)
    return [
        LateTick(
            tick=int(after["tick"][i]),
            woke_ns=int(after["time_ns"][i] + after["wakeup_ns"][i]),
            late_ns=int(late[i]),
            own_ns=int(min(own[i], late[i])),
            phase=PHASES[int(np.argmax(parts[:, i]))],
            cycle_ns=int(cycle[i]),
        )
        for i in np.flatnonzero(late > above_ns)
    ]


def _period_ns(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Period of each step, ns: slots lie on a grid, and their numbers say how many were skipped."""
    slots = np.maximum(after["tick"] - before["tick"], 1)
    period: np.ndarray = (after["time_ns"] - before["time_ns"]) // slots
    return period
