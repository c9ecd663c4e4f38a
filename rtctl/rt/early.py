"""Sleep until a little before the deadline, then look at the clock until it comes.

The kernel wakes a sleeper some tens of microseconds late: a timer interrupt, a core that comes out of an idle
state, a switch of tasks. Who is awake by then starts within a tenth of a microsecond of the deadline, and
reads a sample that is younger by as much. It costs the core of the loop the time between wake-up and
deadline.

`auto` follows the wake-ups that were measured, so that all but one of two hundred come in time:

    m <- m + .995 step   after a wake-up later than m,   m - .005 step   after any other,   0 <= m <= most

which settles where one of two hundred is later (the stochastic approximation of a quantile). `step` is two
thousandths of the period: what was is forgotten within seconds at any rate.

A margin m costs not m but what is left of it after the wake-up, max(m - L, 0) of a wake-up L late. Of that
`auto` may spend `INCOME_US` in each period, and save what it has not spent, for `SAVED_S` at most; the margin
is the smaller of m and what is saved, s:

    margin = min(m, s),   s <- min(s + income - max(margin - L, 0), income SAVED_S / period)

So over SAVED_S and more it takes `INCOME_US` of a period on average at most, and is never held below
`INCOME_US`: where nothing is saved, s is income + L. A machine that is quiet for most of the time covers
later wake-ups while it is not.

The margin is never more than `MOST_US`, nor `MOST_SHARE` of the period, nor half of what the kernel leaves to
real-time processes (`sched_rt_runtime_us`): one that takes all of that is held up for the rest of the second.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rtctl.rt.realtime import Grant

INCOME_US = 78.0
"""`auto` looks so long on average at most: with what the kernel does meanwhile, at 1 kHz 8 % of a core."""

MOST_US = 200.0
"""`auto` begins to look no earlier than this: at 1 kHz, a fifth of a core, for as long as there is something
saved."""

SAVED_S = 10.0
"""What is saved is the income of so long at most."""

MOST_SHARE = 0.4
"""Nor is it ever more than this share of the period."""

LATE_SHARE = 0.005
"""Share of the wake-ups that may be later than `auto` waits for."""

STEP_SHARE = 0.002
"""One step of what follows the wake-ups, as a share of the period."""

MARGIN, MOST, STEP, FOLLOWED, INCOME, SAVED, MOST_SAVED, LOOKED = range(8)
"""Places in the array that `choose` fills, ns: the margin now; the most that `auto` takes, 0 for a fixed one;
its step; what it follows the wake-ups with; what it may spend in a period, has saved, and may save; how long
it has looked since the start."""

PLACES = 8

_KERNEL = Path("/proc/sys/kernel")


# sched_rt_runtime_us 950000 of sched_rt_period_us 1000000 (sched(7))
DEFAULT_SHARE = 0.95
"""What the kernel leaves to real-time processes unless it is told otherwise."""


def realtime_share(root: Path = _KERNEL) -> float:
    """Share of a core that the kernel leaves to real-time processes, 0 to 1; 1 where it says that it does not
    limit them.

    Where it says nothing, as in a service that does not see all of /proc, its default counts."""
    try:
        runtime_us, period_us = (
            int((root / f"sched_rt_{name}_us").read_text()) for name in ("runtime", "period")
        )
    except (OSError, ValueError):
        return DEFAULT_SHARE
    # -1 says that nothing is limited
    return min(max(runtime_us / period_us, 0.0), 1.0) if runtime_us >= 0 and period_us > 0 else 1.0


def most_us(period_s: float, share: float) -> float:
    """Longest look before each deadline, us, whoever asks for it; `share`: see `realtime_share`."""
    # half: the law and the devices need the rest of what the kernel leaves, or the loop is throttled
    return min(MOST_SHARE, share / 2) * period_s * 1e6


def choose(
    early_ns: np.ndarray,
    asked: float | str,
    period_s: float,
    cores: int,
    *,
    granted: bool,
    share: float | None = None,
) -> Grant:
    """Fill in what `WallClock` goes by, and say what was chosen.

    Parameters
    ----------
    early_ns : array, shape (PLACES,), int64
        See `MARGIN`; written.
    asked
        `loop.early_us`: microseconds, or "auto".
    period_s
        Of the loop.
    cores
        Cores that the daemon may use; with one alone `auto` leaves the time to the host.
    granted
        The process has real-time rights. Without them others run in the time that it would look, and `auto`
        does not.
    share
        What of a core the kernel leaves to real-time processes; None asks it."""
    bound_us = most_us(period_s, realtime_share() if share is None else share)
    auto = asked == "auto"
    # a number of microseconds is somebody's own choice, and is kept to
    useful = not auto or (granted and cores > 1)
    first_us = min(INCOME_US if auto else float(asked), bound_us) if useful else 0.0
    most = min(MOST_US, bound_us) if useful else 0.0
    # a loop that was started anew learns anew: its core may be another one
    early_ns[:] = 0
    # saved from the start: the first tick is as early as any
    early_ns[[MARGIN, FOLLOWED, INCOME, SAVED]] = round(first_us * 1e3)
    early_ns[MOST] = round(most * 1e3) if auto else 0
    early_ns[STEP] = max(round(STEP_SHARE * period_s * 1e9), 1)
    early_ns[MOST_SAVED] = max(round(SAVED_S / period_s), 1) * early_ns[INCOME]
    text = f"{first_us:g} us before each deadline, {1e-6 * first_us / period_s:.1%} of its core"
    if auto:
        text = (
            f"up to {most:g} us before each deadline, on average {1e-6 * first_us / period_s:.1%} of its "
            "core at most"
        )
    if not useful:
        text = f"auto: none {'without real-time rights' if cores > 1 else 'on the only core'}"
    elif not auto and first_us < float(asked):
        text += f"; {float(asked):g} us were asked (loop.early_us), which is more than may be"
    return Grant("early-look", granted=useful, required=False, detail=text)


class Look:
    """How the loop looks at the clock, as the host sees it in the array that `choose` filled."""

    def __init__(self, early_ns: np.ndarray) -> None:
        self._early_ns = early_ns
        self._before_ns, self._looked_ns = 0, 0

    def told(self, now_ns: int) -> dict[str, float]:
        """The margin now, us, and the share of its core that looking took since this was last asked."""
        looked_ns, passed_ns = int(self._early_ns[LOOKED]), now_ns - self._before_ns
        share = (looked_ns - self._looked_ns) / max(passed_ns, 1)
        self._before_ns, self._looked_ns = now_ns, looked_ns
        return {"early_us": round(int(self._early_ns[MARGIN]) / 1e3, 1), "early_share": round(share, 4)}
