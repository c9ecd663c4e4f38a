"""Derivatives of a filtered signal, and the signal as it was a little earlier or later."""

from __future__ import annotations

import numpy as np


def derivatives(position: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivative by five-point central differences; two samples at each end are zero.

    Notes
    -----
    The error is (w T)^4/30 of the first and (w T)^4/90 of the second, against (w T)^2/6 and (w T)^2/12 of
    three points, so a log of 100 Hz does as well as one of 1 kHz."""
    # the ends stay 0 and not one-sided: every reader cuts a period of the cut-off off there
    x = position
    v, a = np.zeros_like(x), np.zeros_like(x)
    v[2:-2] = (8 * (x[3:-1] - x[1:-3]) - (x[4:] - x[:-4])) / (12 * step)
    a[2:-2] = (16 * (x[3:-1] + x[1:-3]) - (x[4:] + x[:-4]) - 30 * x[2:-2]) / (12 * step**2)
    return v, a


def advanced(signal: np.ndarray, rate_hz: float, delay_s: float) -> np.ndarray:
    """A signal recorded `delay_s` late against the position, as it was at the instants of the position.

    The `delay_s` at its end (at its begin for a negative one) repeat the last (first) sample: cut them off.

    Notes
    -----
    By whole samples, and the rest d of at most half a sample by the second-order Taylor series
    ``s(t + d) = s + d s' + d^2/2 s''``: the error is (w d)^3/6, 2e-6 for half a period of 1 kHz and 3 Hz of
    motion. Linear, so it may come before or after a filter."""
    whole = round(delay_s * rate_hz)
    rest_s = delay_s - whole / rate_hz
    # whole samples first: Taylor's series is good for half a sample, and a filter for no delay at all
    s = signal[np.clip(np.arange(len(signal)) + whole, 0, len(signal) - 1)]
    first, second = derivatives(s, 1 / rate_hz)
    return np.asarray(s + rest_s * first + 0.5 * rest_s**2 * second)
