"""A torque that is not of the time of the position: late or early by one delay, or of a device whose clock
runs at another rate."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from rtctl.friction.logs.balance import ROWS_ALIKE, Balance, Fit
from rtctl.friction.logs.regressors import Regressors
from rtctl.friction.logs.two_clocks import put_right

LATE_MOST_S, LATE_STEP_S, LATE_TOLD_S = 0.1, 0.002, 0.004
"""Delays of the torque that are tried, and the least that is told."""

CLOCK_MOST_S, CLOCK_STEPS_S = 0.3, (0.03, 0.006, 0.001)
"""Delays at the first and the last row that are tried of two clocks, with one step and then with finer ones
about the best."""

CLOCKS_LEAVE = 0.01
"""Share of the torque that one delay must leave over for two clocks to be looked for."""

# as `balance_faults.TOLD_RATIO`: two clocks are one cause more (decision 0070)
CLOCKS_BETTER = 0.75
"""What two clocks leave over, RMS, share of what one delay does, from which on they are told."""


ECHOES_S = np.arange(0.004, 0.1501, 0.004)
"""Times later at which an echo of the torque is tried."""

ECHO_LEAST, ECHO_ROUNDS = 0.08, 6
"""Least share of an echo that is told, and times that the torque that acted is made anew with it."""

ECHO_BETTER = 0.5
"""Share of what one delay leaves over, RMS, from which down an echo is told in its place."""


def late(balance: Balance, first_s: float, last_s: float, every: int = 1) -> np.ndarray:
    """The torque as it was recorded so much later, at the first row of each log and at its last, on the
    sliding rows (every so many of them)."""
    signals = balance.signals
    rows = np.flatnonzero(signals.sliding)[::every]
    found = np.empty(len(rows))
    for k in range(len(signals.sources)):
        of_log, mine = signals.log == k, signals.log[rows] == k
        time_s, at_s = signals.time_s[of_log], signals.time_s[rows[mine]]
        along = (at_s - time_s[0]) / max(float(time_s[-1] - time_s[0]), 1e-12)
        found[mine] = np.interp(
            at_s + first_s + (last_s - first_s) * along, time_s, signals.torque_nm[of_log]
        )
    return found


def delayed(balance: Balance, plain: Fit) -> tuple[str, Fit] | None:
    """The delay of the torque that leaves least over; two clocks where these leave far less."""
    # one decomposition serves all delays: the motion is the same, the torque alone is read elsewhere
    # every fifth row: rows so near to each other say the same, and there are hundreds of delays to try
    # (decision 0070)
    basis = np.linalg.qr(np.hstack([balance.motion, balance.nuisance])[::ROWS_ALIKE])[0]

    def left(first_s: float, last_s: float) -> float:
        torque = late(balance, first_s, last_s, ROWS_ALIKE)
        return float(np.sqrt(np.mean((torque - basis @ (basis.T @ torque)) ** 2)))

    delays = np.arange(-LATE_MOST_S, LATE_MOST_S + LATE_STEP_S / 2, LATE_STEP_S)
    tried = [left(float(each), float(each)) for each in delays]
    best = int(np.argmin(tried))
    finer = delays[best] + np.array([0.0, -CLOCK_STEPS_S[-1], CLOCK_STEPS_S[-1]])
    delay = float(min(finer, key=lambda each: left(each, each)))  # as fine as two clocks are looked for
    # a balance that one delay mends is not searched for two, which could only leave less
    if tried[best] > CLOCKS_LEAVE * balance.spread:
        # two numbers more always leave less over: they must leave far less (`CLOCKS_BETTER`)
        first_s, last_s = _clocks(left)
        two = balance.fit(torque=late(balance, first_s, last_s))
        if left(first_s, last_s) < CLOCKS_BETTER * left(delay, delay) and _sound(two):
            return _two_clocks(balance, plain, two, first_s, last_s), two
    # an end of what is tried is no minimum
    if best in (0, len(delays) - 1):
        # no time explains it best: friction that builds up over a travel looks the later the more
        return None
    one = balance.fit(torque=late(balance, delay, delay))
    if abs(delay) < LATE_TOLD_S or not _sound(one):
        return None
    if delay > 0 and (again := _echo(balance, plain, one)):
        return again
    return (
        f"the torque looks {1e3 * abs(delay):.0f} ms {_word(delay)} against the position "
        f"({_instead(delay)}): with that, {_left(balance, one)} of it is left over instead of "
        f"{_left(balance, plain)}; record both at one time, or put the column right by it (--torque-delay "
        f"does, of the motor torque: {delay:+.3f} s besides what it is now)",
        one,
    )


def _clocks(left: Callable[[float, float], float]) -> tuple[float, float]:
    """Delays at the first and the last row that leave least over, s."""
    first_s = last_s = 0.0
    # each finer grid reaches as far as the step before: 441 + 121 + 169 pairs in place of 360,000
    for reach_s, step_s in pairwise((CLOCK_MOST_S, *CLOCK_STEPS_S)):
        steps = np.arange(-reach_s, reach_s + step_s / 2, step_s)
        tried = [(left(first_s + a, last_s + b), first_s + a, last_s + b) for a in steps for b in steps]
        _, first_s, last_s = min(tried)
    return float(first_s), float(last_s)


def _two_clocks(balance: Balance, plain: Fit, two: Fit, first_s: float, last_s: float) -> str:
    return (
        "torque and position look as if they were stamped by two clocks: the torque is "
        f"{1e3 * abs(first_s):.0f} ms {_word(first_s)} against the position at the first row and "
        f"{1e3 * abs(last_s):.0f} ms {_word(last_s)} at the last; with that, {_left(balance, two)} of it is "
        f"left over instead of {_left(balance, plain)}; {put_right(balance.signals, first_s, last_s)}"
    )


def _echo(balance: Balance, plain: Fit, one: Fit) -> tuple[str, Fit] | None:
    """A torque of which a share comes once more some time later, where that leaves far less over than the one
    delay that was found.

    With u the torque that acted the column is u + e u(t - d); u is what the balance wants, so that the noise
    of the record does not explain itself."""
    signals = balance.signals
    motion = np.column_stack([signals.acceleration_rad_s2, signals.velocity_rad_s, signals.direction])
    best, best_s = None, 0.0
    for later_s in ECHOES_S:
        before, fit = _shifted(motion, signals, -later_s)[signals.sliding], one
        for _ in range(ECHO_ROUNDS):
            wanted = before @ np.array([fit.inertia, fit.viscous, fit.coulomb])
            fit = balance.fit(added=wanted[:, None])
        if best is None or fit.rest < best.rest:
            best, best_s = fit, float(later_s)
    assert best is not None, "some are tried"
    share = float(best.added[0])
    if not (ECHO_LEAST < share < 1 and best.rest < ECHO_BETTER * one.rest and _sound(best)):
        return None
    return (
        f"the torque looks as if {share:.2g} of it came once more {1e3 * best_s:.0f} ms later (an echo on a "
        f"line, a command that is mixed with the measured torque): with that, {_left(balance, best)} of it "
        f"is left over instead of {_left(balance, plain)}, as one that is late it leaves "
        f"{_left(balance, one)}; map the torque that the motor made",
        best,
    )


def _shifted(columns: np.ndarray, signals: Regressors, by_s: float) -> np.ndarray:
    """Columns (n, k) of all rows as they are so much later, log by log."""
    found = np.empty_like(columns)
    for k in range(len(signals.sources)):
        mine = signals.log == k
        at_s = signals.time_s[mine]
        for one in range(columns.shape[1]):
            found[mine, one] = np.interp(at_s + by_s, at_s, columns[mine, one])
    return found


def _sound(fit: Fit) -> bool:
    return fit.inertia > 0 and fit.coulomb > 0


def _left(balance: Balance, fit: Fit) -> str:
    return f"{100 * fit.rest / balance.spread:.2g} %"


def _instead(delay_s: float) -> str:
    """What of the position looks like that delay of the torque."""
    return (
        "or it is the drive's echo of a command that has acted before, or the position is a set point, which "
        "runs ahead of the joint"
        if delay_s > 0
        else "or the position was filtered"
    )


def _word(delay_s: float) -> str:
    return "late" if delay_s > 0 else "early"
