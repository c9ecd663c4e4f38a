"""Velocity from encoder positions: FOAW, difference, low-pass, Kalman (docs/theory.md 10.1).

x position rad, T period s, k newest sample, l samples back, d accepted deviation (band).
Between two valid samples more than one grid tick may have passed (missed samples, missed ticks); the
history is then filled along the straight line, so every estimator sees equally spaced positions."""

from __future__ import annotations

import math

import numpy as np

from rtctl.control.jit import compiled, inlined
from rtctl.control.records import HISTORY, Record
from rtctl.control.vocabulary import VelocityMethod

_FOAW = int(VelocityMethod.FOAW)
_LOWPASS = int(VelocityMethod.LOWPASS)
_KALMAN = int(VelocityMethod.KALMAN)


def lowpass_alpha(cutoff_hz: float, period_s: float) -> float:
    """Coefficient per tick of the first-order low-pass y += alpha (x - y) with this cut-off.

    Notes
    -----
    alpha = 1 - exp(-2 pi f T): the exact sampled pole. A cut-off of 0 means no filter (alpha = 1)."""
    return 1.0 if cutoff_hz <= 0 else -math.expm1(-2.0 * math.pi * cutoff_hz * period_s)


def kalman_gains(count_rad: float, bandwidth_hz: float, period_s: float) -> tuple[float, float]:
    """Steady gains of the constant-velocity Kalman filter.

    Parameters
    ----------
    count_rad : float
        One encoder count, rad; its variance Delta^2/12 cancels, since the bandwidth is given.
    bandwidth_hz, period_s : float

    Returns
    -------
    gain_position : float
        Dimensionless.
    gain_velocity : float
        1/s.

    Raises
    ------
    ValueError
        When an argument is not positive.

    Notes
    -----
    White acceleration of density w_c^4 R T against the measurement variance R gives the continuous
    filter the bandwidth w_c. In units of R and T the discrete Riccati equation in steady state reduces to
        q (1 - a) = b^2,     a^2 + a b + b^2/6 = 2 b,     q = (w_c T)^4,
    with a the position gain and b = T times the velocity gain (derived for this project); solved by
    bisection in b, on which the difference of the two sides of the first equation is monotone."""
    if not (count_rad > 0 and bandwidth_hz > 0 and period_s > 0):
        msg = f"count, bandwidth and period must be positive: {count_rad}, {bandwidth_hz}, {period_s}"
        raise ValueError(msg)
    q = (2.0 * math.pi * bandwidth_hz * period_s) ** 4

    def position_gain(b: float) -> float:
        return 0.5 * (math.sqrt(8.0 * b + b * b / 3.0) - b)

    low, high = 0.0, 3.0 - math.sqrt(3.0)  # the upper end is where the position gain reaches 1
    for _ in range(
        200
    ):  # until the ends are neighbours, for the small gains of slow filters on quick loops, too
        middle = 0.5 * (low + high)
        if middle * middle > q * (1.0 - position_gain(middle)):
            high = middle
        else:
            low = middle
    return position_gain(high), high / period_s


@inlined
def push_history(history: np.ndarray, position: float, elapsed: int, window: int) -> None:
    """Put the newest position in front of `history` (newest first), filling skipped ticks linearly."""
    before = history[0]
    moved = min(elapsed, window)
    # from the oldest on: each place is read before it is written over
    for i in range(window - 1, moved - 1, -1):
        history[i] = history[i - moved]
    for i in range(moved):
        history[i] = position + (before - position) * i / elapsed


_ROUNDING = 1e-12
"""Above what rounding can make of a deviation, as a share of what it is the difference of."""


@inlined
def _worst_deviation(history: np.ndarray, n: int, intercept: float, slope: float) -> float:
    """Largest deviation of samples 0..n (relative to the newest) from the line, which is finite."""
    a = b = c = d = 0.0
    newest, back = history[0], 0
    while back + 3 <= n:  # four at a time: none of them waits for another
        e = abs(history[back] - newest - (intercept - slope * back))
        f = abs(history[back + 1] - newest - (intercept - slope * (back + 1)))
        g = abs(history[back + 2] - newest - (intercept - slope * (back + 2)))
        h = abs(history[back + 3] - newest - (intercept - slope * (back + 3)))
        a, b = a if e <= a else e, b if f <= b else f
        c, d = c if g <= c else g, d if h <= d else h
        back += 4
    while back <= n:
        e = abs(history[back] - newest - (intercept - slope * back))
        a = a if e <= a else e
        back += 1
    a, c = a if b <= a else b, c if d <= c else d
    return a if c <= a else c


@inlined
def foaw_velocity(history: np.ndarray, count: int, window: int, band: float, period: float) -> float:
    """First-order adaptive windowing, best-fit slope (Janabi-Sharifi et al. 2000).

    Parameters
    ----------
    history : array, shape (>= window,)
        Positions, newest first, rad.
    count : int
        Valid entries of it.
    window : int
        Longest window, samples.
    band : float
        Accepted deviation from the line, rad.
    period : float
        s.

    Notes
    -----
    b_n = 6 sum_{l=0..n} (n - 2l) x_{k-l} / (n (n+1) (n+2)) per tick, a_n = mean(x_k..x_{k-n}) + b_n n/2.
    Windows grow while |x_{k-l} - (a_n - b_n l)| <= d for all l; n = 1 is always accepted; the last
    accepted slope is the result. Sums are kept relative to x_k, so large angles lose no digits.
    The samples are looked at again only where the line has turned so far, since they were, that one of them
    could lie beside it: no sample is farther from the new line than from the old one and the lines from each
    other, at the window's ends."""
    newest = history[0]
    total = 0.0
    weighted = 0.0
    slope = before = 0.0
    worst = math.inf
    for n in range(1, min(window, count)):
        y = history[n] - newest
        total += y
        weighted += n * y
        candidate = 6.0 * (n * total - 2.0 * weighted) / (n * (n + 1.0) * (n + 2.0))
        intercept = total / (n + 1.0) + 0.5 * candidate * n
        if n > 1:
            turned = max(abs(intercept - before), abs(intercept - before - (candidate - slope) * (n - 1)))
            # a bound, so that most windows look at one sample
            worst += turned + _ROUNDING * (abs(intercept) + abs(candidate) * n + band)
            newly = abs(y - (intercept - candidate * n))
            if not newly <= band:  # nor is what is no number within any band
                break
            if worst <= band:
                worst = max(worst, newly)
            else:
                worst = _worst_deviation(history, n, intercept, candidate)
                if worst > band:
                    break
        slope, before = candidate, intercept  # n = 1, too: two samples are always a line
    return slope / period


@compiled
def _kalman_velocity(s: Record, p: Record, axis: int, elapsed: int) -> float:
    """One predict-and-correct step with steady gains over `elapsed` ticks."""
    predicted = s.kalman_position_rad[axis] + s.kalman_velocity_rad_s[axis] * p.period_s * elapsed
    innovation = s.position_rad[axis] - predicted
    s.kalman_position_rad[axis] = predicted + p.kalman_gain_position[axis] * innovation
    s.kalman_velocity_rad_s[axis] += p.kalman_gain_velocity[axis] * innovation
    return s.kalman_velocity_rad_s[axis]


@compiled
def _start(s: Record, axis: int) -> None:
    """Begin at rest at the present position."""
    s.position_history_rad[axis, 0] = s.position_rad[axis]
    s.history_count[axis] = 1
    s.velocity_rad_s[axis] = 0.0
    s.kalman_position_rad[axis] = s.position_rad[axis]
    s.kalman_velocity_rad_s[axis] = 0.0


@inlined
def estimate_velocity(s: Record, p: Record, axis: int, elapsed: int) -> tuple[float, float]:
    """Velocity by the configured method, and the plain backward difference.

    Parameters
    ----------
    elapsed : int
        Grid ticks since the last valid sample; 0 on a missed one.

    Returns
    -------
    velocity : float
        rad/s; a missed sample holds the last estimate.
    difference : float
        (x_k - x_{k-1})/T, rad/s: 0 on a missed sample, where the held position does not move."""
    if elapsed == 0:
        return s.velocity_rad_s[axis], 0.0
    if s.history_count[axis] == 0:  # no place before: a difference would be any number
        _start(s, axis)
        return 0.0, 0.0
    window = min(max(p.velocity_window_ticks[axis], 2), HISTORY)
    history = s.position_history_rad[axis]
    # over all ticks since
    difference = (s.position_rad[axis] - s.position_before_rad[axis]) / (elapsed * p.period_s)
    push_history(history, s.position_rad[axis], elapsed, window)
    s.history_count[axis] = min(s.history_count[axis] + elapsed, HISTORY)
    method = p.velocity_method[axis]
    velocity = difference
    if method == _FOAW:
        velocity = foaw_velocity(
            history, s.history_count[axis], window, p.velocity_band_rad[axis], p.period_s
        )
    elif method == _LOWPASS:
        keep = (1.0 - p.velocity_alpha[axis]) ** elapsed  # the low-pass over all ticks at once
        velocity = difference + keep * (s.velocity_rad_s[axis] - difference)
    elif method == _KALMAN:
        velocity = _kalman_velocity(s, p, axis, elapsed)
    s.velocity_rad_s[axis] = velocity
    return velocity, difference
