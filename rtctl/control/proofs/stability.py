"""Passivity margins of the two-port with virtual coupling, computed from the config before anything moves.

Pure functions of numbers; no friction here (see `friction_passivity`), no file, no clock.

Symbols (docs/theory.md 2), all at the link:

======  =============  ==================================================================
b       N m s/rad      damping the device surely has, friction compensation taken off
k_c     N m/rad        stiffness of the virtual coupling
b_c     N m s/rad      damping of the virtual coupling
T       s              control period
d       ticks          from a sample to its torque at the motor, whole or not
K       N m s/rad      k_c T / 2
B       N m s/rad      b_c + K
theta   rad            w T / 2, in (0, pi/2]
======  =============  ==================================================================

Every margin is a surplus of device damping: `b` minus the least `b` that passes, N m s/rad. Zero or more
means passive with every passive hand and every passive virtual environment; NaN in `b` gives NaN, which
passes no `>= 0`."""
# longer than 300 lines: one condition after the other, each with its source and what it leaves out

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rtctl.control.proofs import held_samples
from rtctl.control.proofs.sampled_loop import peaks, varying_peaks

_FASTER = (1.0, 1.5, 2.2, 3.3, 5.0, 10.0)
"""Bandwidths of the current loop that are tried, as multiples of the declared one."""
_FASTER_RINGING = tuple(1.08**k for k in range(31))
"""Those of a loop that overshoots: where such a loop rings near a frequency that sampling folds, up to 10 %
more is asked between two steps of the row above, .4 % between two of this one (decision 0180)."""
_OF_A_TICK = (0.25, 0.32, 0.4, 0.5, 0.62, 0.78, 1.0)
"""Lags that are tried besides, as shares of what the delay falls short of a whole tick: a delay and a lag
that come near to one may need up to .4 % more than with more or less of the lag (decision 0140)."""


@dataclass(frozen=True)
class Between:
    """What lies between the law and the joint, at its worst: everything faster is covered, too."""

    delay: float = 0.0
    """Delay between a sample and its torque at the motor, ticks."""
    lag_hz: float = 0.0
    """Bandwidth of the current loop, Hz; 0: ideal."""
    sample_ticks: int = 1
    """Ticks between two fresh samples."""
    jitter: float = 0.0
    """How much shorter the delay may be in one tick than in another, ticks."""
    overshoot: float = 0.0
    """How far the current exceeds a step, share of it; 0: a loop of first order."""


IDEAL = Between()


def require_coupling(k_c: float, b_c: float, T: float, d: float = 0.0, lag_hz: float = 0.0) -> None:
    """Raise ValueError unless every number is finite and not negative, and the period `T` above 0."""
    for name, value in (("k_c", k_c), ("b_c", b_c), ("d", d), ("lag_hz", lag_hz)):
        if not (math.isfinite(value) and value >= 0):
            raise ValueError(f"{name} must be finite and not negative, not {value}")
    if not (math.isfinite(T) and T > 0):
        raise ValueError(f"T must be finite and positive, not {T}")


def lag_ticks(lag_hz: float, T: float) -> float:
    """Time constant of the current loop in periods; 0 for an ideal one."""
    return 1 / (2 * math.pi * lag_hz * T) if lag_hz > 0 else 0.0


def damping_needed_sampled_data(
    k_c: float,
    b_c: float,
    T: float,
    d: float = 0.0,
    lag_hz: float = 0.0,
    *,
    any_world: bool = False,
    overshoot: float = 0.0,
) -> float:
    """Least device damping for which the sampled loop is passive, N m s/rad, with this very delay and lag.

    Parameters
    ----------
    d : float
        Delay between a sample and its torque at the motor, ticks, whole or not.
    lag_hz : float
        Bandwidth of the current loop, a first-order lag; 0 is ideal.
    any_world : bool
        With a lag: for virtual environments that are not linear, too. Without one both are the same.
    overshoot : float
        Of the current loop, share of a step, 0 to below 1: then of second order, with the lag of `lag_hz` at
        low frequencies.

    Raises
    ------
    ValueError
        For a negative or non-finite argument, or a `T` that is not positive.

    Notes
    -----
    docs/theory.md 2.4; derivation and bound between the points of the sweep in
    `sampled_loop`. Whole ticks without a lag are (SD-1) of docs/theory.md 2.3, ``sin^2((1+d) theta) (B^2 +
    K^2 cot^2 theta)/B``, with the closed forms ``b_c + k_c T/2`` for d = 0 (Colgate and Brown's wall) and a
    parabola in cos^2 theta for d = 1. Swept values are up to some 1e-5 too large, never too small."""
    require_coupling(k_c, b_c, T, d, lag_hz)
    K = k_c * T / 2
    B = b_c + K
    if B == 0:
        return 0.0
    spread = b_c * (B + K)  # B^2 - K^2 without cancellation
    if lag_hz == 0 and d == 0:
        return B
    if lag_hz == 0 and d == 1:
        q = 1.0 if 2 * spread <= B * B else B * B / (2 * spread)
        return 4 * (B * B * q - spread * q * q) / B
    return _largest(peaks(float(d), lag_ticks(lag_hz, T), any_world=any_world, overshoot=overshoot), K, b_c)


def _largest(pairs: tuple[np.ndarray, np.ndarray], K: float, b_c: float) -> float:
    """The largest damping that any of the pairs of `sampled_loop` asks for."""
    W, U = pairs
    return float(np.max(W * (b_c * (b_c + 2 * K)) + U * (K * K))) / (2 * (b_c + K))


def late_ticks(between: Between, T: float) -> float:
    """Ticks from a position to most of the torque that answers it: delay, age and lag at their worst."""
    return between.delay + between.sample_ticks - 1 + lag_ticks(between.lag_hz, T)


def _cases(T: float, between: Between) -> list[tuple[float, float, float]]:
    """Delay, bandwidth and overshoot of all that is no slower than declared: whole ticks below the delay,
    lags down to none, with the overshoot and without.

    Between whole ticks the damping needed is convex in the delay at every frequency, so its ends suffice; the
    lags between are some steps, as it changes little from one to the next, but where one fills up a tick; of
    a loop that overshoots many."""
    # a little delay may need less than none: nothing may rest on that (2.4)
    delays = [float(k) for k in range(math.ceil(between.delay))] + [between.delay]
    lags = [0.0] if between.lag_hz == 0 else [0.0, *(between.lag_hz * share for share in _FASTER)]
    cases = [(d, lag) for d in delays for lag in lags]
    short = math.ceil(between.delay) - between.delay
    if between.lag_hz > 0 and short > 0:
        filling = [1 / (2 * math.pi * share * short * T) for share in _OF_A_TICK]
        cases += [(between.delay, lag) for lag in filling if lag > between.lag_hz]
    found = [(d, lag, 0.0) for d, lag in cases]
    if between.overshoot > 0 and between.lag_hz > 0:
        cases += [(d, between.lag_hz * share) for d in delays for share in _FASTER_RINGING]
        # half of it may ask for .3 % more than all
        found += [(d, lag, share * between.overshoot) for d, lag in cases if lag > 0 for share in (0.5, 1.0)]
    return found


def _held_lags(T: float, between: Between) -> set[tuple[float, float]]:
    """Lag in ticks and overshoot of what is tried with old samples, where quicker loops ask for less."""
    lag, over = lag_ticks(between.lag_hz, T), between.overshoot
    some = {(share * lag, part * over) for share in (0.4, 1.0) for part in (0.5, 1.0)} if over > 0 else set()
    return {(0.0, 0.0), (lag, 0.0), *some}


def damping_needed_between(
    k_c: float, b_c: float, T: float, between: Between = IDEAL, *, any_world: bool = False
) -> float:
    """Least device damping for which the sampled loop is passive, N m s/rad, whatever the delay, lag and age
    of samples up to those declared. Raises ValueError as `damping_needed_sampled_data`."""
    cases = _cases(T, between)
    needed = [
        damping_needed_sampled_data(k_c, b_c, T, d, lag, any_world=any_world, overshoot=over)
        for d, lag, over in cases
    ]
    if between.jitter > 0 and k_c + b_c > 0:
        low = max(between.delay - between.jitter, 0.0)
        lags = {(lag_ticks(hz, T), over) for _, hz, over in cases}
        needed += [_largest(varying_peaks(low, between.delay, *lag), k_c * T / 2, b_c) for lag in lags]
    if between.sample_ticks > 1:
        needed += [
            held_samples.damping_needed(k_c, b_c, T, n, d, lag, min(between.jitter, d), over)
            for n in range(2, between.sample_ticks + 1)
            for d in {0.0, between.delay}
            for lag, over in _held_lags(T, between)
        ]
    return max(needed)


def margin_sampled_data(b: float, k_c: float, b_c: float, T: float, d: float = 0.0) -> float:
    """Surplus of device damping over what the exact sampled-data two-port needs, N m s/rad.

    Raises ValueError as `damping_needed_sampled_data`."""
    return b - damping_needed_sampled_data(k_c, b_c, T, d)


def damping_needed_adams_hannaford(k_c: float, b_c: float, T: float) -> float:
    """Least device damping by the papers' Llewellyn test, N m s/rad. Optimistic for an encoder.

    Notes
    -----
    docs/theory.md 2.2: ``2 b B >= max over c in [0,1] of B^2 c (1-c) + K^2 c^3/(1+c)``. The maximum lies
    at c = 1 if ``K^2 >= 0.8 B^2``, else at the root of ``2 c^3 + 3 c^2 = B^2/(B^2 - K^2)``."""
    require_coupling(k_c, b_c, T)
    K = k_c * T / 2
    B = b_c + K
    if B == 0:
        return 0.0
    if K * K >= 0.8 * B * B:
        return K * K / (4 * B)
    rho = B * B / (b_c * (B + K))
    c = math.cosh(math.acosh(2 * rho - 1) / 3) - 0.5
    return (B * B * c * (1 - c) + K * K * c**3 / (1 + c)) / (2 * B)


def margin_adams_hannaford(b: float, k_c: float, b_c: float, T: float) -> float:
    """Surplus of device damping by the papers' Llewellyn test, N m s/rad. Reported, never a gate.

    It treats the velocity as sampled directly; a loop that samples position needs four times the damping
    at b_c = 0 and more as b_c grows (docs/theory.md 2.2)."""
    return b - damping_needed_adams_hannaford(k_c, b_c, T)


def _largest_stiffness(
    needed: Callable[[float], float], b: float, high: float, tolerance: float = 0.0
) -> float:
    """Largest k_c up to `high` with needed(k_c) <= b; `needed` rises with k_c. 0 without any."""
    if not needed(0.0) <= b:  # NaN passes nothing
        return 0.0
    if needed(high) <= b:
        return high
    low = 0.0
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high or high - low <= tolerance * high:
            return low
        if needed(middle) <= b:
            low = middle
        else:
            high = middle


def k_max_sampled_data(
    b: float, b_c: float, T: float, d: float = 0.0, lag_hz: float = 0.0, overshoot: float = 0.0
) -> float:
    """Largest coupling stiffness the exact sampled-data test passes at this b_c, N m/rad, with this delay,
    lag and overshoot.

    0 where none passes (b below b_c, or NaN). Raises ValueError as `damping_needed_sampled_data`.

    Notes
    -----
    The damping needed rises with k_c (the derivatives of K^2/B and of (B^2 - K^2)/B are not negative), so the
    bound is the least of the roots of ``U K^2 + 2 (W b_c - b) K = b_c (2 b - W b_c)`` over all cells."""
    require_coupling(0.0, b_c, T, d, lag_hz)
    if not b >= b_c:
        return 0.0
    if d == 0 and lag_hz == 0:
        return 2 * (b - b_c) / T
    W, U = peaks(float(d), lag_ticks(lag_hz, T), overshoot=overshoot)
    left, spare = b_c * (2 * b - W * b_c), b - W * b_c
    if np.min(left) < 0:  # at k_c = 0 already too much is asked
        return 0.0
    root = np.sqrt(spare * spare + U * left)
    with np.errstate(divide="ignore", invalid="ignore"):
        K = np.where(spare >= 0, (spare + root) / U, left / (root - spare))
    low = float(np.min(K)) * 2 / T

    def needed(k: float) -> float:
        return damping_needed_sampled_data(k, b_c, T, d, lag_hz, overshoot=overshoot)

    below = low * (1 - 1e-12)  # the root is rounded: what is returned must pass
    if needed(low * (1 + 1e-9)) > b >= needed(below):
        return below
    return _largest_stiffness(needed, b, low * (1 + 1e-3))  # a closed form lets a little more pass


def k_max_between(b: float, b_c: float, T: float, between: Between = IDEAL) -> float:
    """Largest coupling stiffness that `damping_needed_between` passes at this b_c, N m/rad; or 0."""
    require_coupling(0.0, b_c, T, between.delay, between.lag_hz)
    high = min(k_max_sampled_data(b, b_c, T, *case) for case in _cases(T, between))
    if (between.sample_ticks == 1 and between.jitter == 0) or high == 0:
        return high
    return _largest_stiffness(lambda k: damping_needed_between(k, b_c, T, between), b, high, 1e-5)


def k_max_adams_hannaford(b: float, b_c: float, T: float) -> float:
    """Largest coupling stiffness the papers' Llewellyn test passes at this b_c, N m/rad; 0 without any."""
    require_coupling(0.0, b_c, T)
    if not b >= 0:
        return 0.0
    return _largest_stiffness(
        lambda k: damping_needed_adams_hannaford(k, b_c, T), b, 2.1 / T * max(b_c, 8 * b)
    )


def recommended_coupling(
    b: float, T: float, between: Between = IDEAL, *, share: float = 0.7, damping_share: float = 0.2
) -> tuple[float, float]:
    """Coupling (k_c N m/rad, b_c N m s/rad) that leaves a margin.

    Parameters
    ----------
    b : float
        Guaranteed device damping, N m s/rad. Not positive or NaN: (0, 0).
    share : float
        Share of `b` spent on the coupling (eta), 0.6 to 0.8.
    damping_share : float
        Share of that spent on b_c (r), 0.1 to 0.4.

    Notes
    -----
    docs/theory.md 2.9, with the delay inside: b_c = r eta b, and k_c the largest that eta b allows, which
    for d = 0 is 2 (1 - r) eta b / T."""
    if not b > 0:
        return 0.0, 0.0
    spent = share * b
    b_c = damping_share * spent
    return k_max_between(spent, b_c, T, between), b_c


def felt_stiffness(k_c: float, k_e: float) -> float:
    """Stiffness the hand feels through coupling and environment in series, N m/rad (docs/theory.md 2.9)."""
    return 0.0 if k_c == 0 or k_e == 0 else k_c * k_e / (k_c + k_e)


def coupling_ring(J: float, b: float, k_c: float, b_c: float) -> tuple[float, float]:
    """Frequency (rad/s) and damping ratio of the device on its coupling, hand off (docs/theory.md 2.9)."""
    if k_c == 0:
        return 0.0, math.inf
    return math.sqrt(k_c / J), (b + b_c) / (2 * math.sqrt(k_c * J))
