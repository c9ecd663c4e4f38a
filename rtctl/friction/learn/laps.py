"""Laps: a motion that repeats itself. A lap that is held out beside its own repeat would vouch for it."""

from __future__ import annotations

import numpy as np

from rtctl.friction.points import FrictionPoints

ALIKE = 0.9
"""Correlation of a motion with itself one lap later from which it repeats itself."""

LAPS_MIN = 3
"""Fewest laps that show a repeat."""

ROWS_MIN = 50
"""Fewest samples in which a lap is looked for."""


def laps_of(points: FrictionPoints) -> np.ndarray | None:
    """Number of the lap each point was measured in, shape (n,); None where no motion repeats itself, or
    nobody knows.

    The columns time_s and position_rad are needed, with a number in every row."""
    time_s, position = points.columns.get("time_s"), points.columns.get("position_rad")
    if time_s is None or position is None or len(time_s) < ROWS_MIN:
        return None
    if not (np.isfinite(time_s).all() and np.isfinite(position).all() and np.ptp(time_s) > 0):
        return None
    period = period_s(time_s, np.stack([position, points.velocity_rad_s]))
    if period is None:
        return None
    # from the first row on: where a lap begins does not matter, only that its repeat begins as late
    laps: np.ndarray = ((time_s - time_s.min()) / period).astype(int)
    last = int(np.ptp(time_s) / period + 0.5) - 1
    laps[laps > last] = last  # a few samples more are no lap
    return laps


def period_s(time_s: np.ndarray, signals: np.ndarray) -> float | None:
    """Duration of one lap, s; None where nothing repeats itself at least `LAPS_MIN` times.

    Parameters
    ----------
    time_s
        Instants, shape (n,), in any order.
    signals
        What repeats itself, shape (k, n): all of them must.

    Notes
    -----
    Each signal less its mean, on an even grid: its correlation with itself one lag later, both parts by their
    own power. The first lag of a maximum from `ALIKE` on, after the correlation fell below one half."""
    order = np.argsort(time_s, kind="stable")
    t = time_s[order]
    n = len(t)
    # an even grid: the correlation goes by steps, stamps may not
    grid = np.linspace(t[0], t[-1], n)
    # the lag of a lap of just so many, and one more: a maximum is told by what comes behind it
    lags = n // LAPS_MIN + 2
    found = [_alike(np.interp(grid, t, signal[order]), lags) for signal in signals]
    # the worst of them: a position that repeats while the speed does not is another motion
    alike = np.min(found, axis=0)
    # every slow signal is like itself a step later: a lap is a maximum after it was unlike
    below = np.flatnonzero(alike < 0.5)
    if not len(below):
        return None
    rest = alike[below[0] :]
    peaks = 1 + np.flatnonzero((rest[1:-1] >= rest[:-2]) & (rest[1:-1] > rest[2:]) & (rest[1:-1] >= ALIKE))
    if not len(peaks):
        return None
    return float((below[0] + peaks[0]) * (t[-1] - t[0]) / (n - 1))


def _alike(signal: np.ndarray, lags: int) -> np.ndarray:
    """Correlation of a signal with itself for 0..lags - 1 steps, shape (lags,)."""
    x = signal - signal.mean()
    n = len(x)
    # padded to twice its length: the end must not meet the begin
    spectrum = np.fft.rfft(x, 2 * n)
    product = np.fft.irfft(spectrum * spectrum.conj())[:lags]
    power = np.concatenate([[0.0], np.cumsum(x**2)])
    k = np.arange(lags)
    # by the power of the parts that overlap: by that of the whole a long lag would look unlike whatever the
    # motion
    size = np.sqrt(power[n - k] * (power[n] - power[k]))
    found: np.ndarray = np.divide(product, size, out=np.zeros(lags), where=size > 0)
    return found
