"""Regression over a window of a second of running: the gap of the torque on its slope and on itself.

With u the torque sent, d its change over a tick and e what the measured torque lacks of it, all behind one
low-pass, the sums of `running_sums` are those of d, u, e, dd, du, uu, de, ue, ee. The gap is e = slope d +
rest u: a delay of slope ticks and a gain of 1 - rest. `running_delay` judges the first, `running_current` the
second."""

from __future__ import annotations

from rtctl.control.jit import compiled
from rtctl.control.records import Record


@compiled
def moments(s: Record, axis: int) -> tuple[float, float, float, float, float, float]:
    """(mean of d, of u, of e, variance of d, covariance of d and u, variance of u) of the window."""
    sums, n = s.running_sums[axis], s.running_ticks[axis]
    d, u, e = sums[0] / n, sums[1] / n, sums[2] / n
    return d, u, e, sums[3] / n - d * d, sums[4] / n - d * u, sums[5] / n - u * u


@compiled
def regression(s: Record, axis: int) -> tuple[float, float, float, float]:
    """(slope, rest, variance that both leave, determinant) of the window; a determinant of 0 where the torque
    shows neither."""
    sums, n = s.running_sums[axis], s.running_ticks[axis]
    d, u, e, dd, du, uu = moments(s, axis)
    de, ue, ee = sums[6] / n - d * e, sums[7] / n - u * e, sums[8] / n - e * e
    area = dd * uu - du * du
    # area over dd uu is 1 less their squared correlation: a ramp alone has u and d alike
    if not area > 1e-6 * dd * uu:  # torque and its change go together: neither can be told
        return 0.0, 0.0, 0.0, 0.0
    slope, rest = (de * uu - ue * du) / area, (ue * dd - de * du) / area
    return slope, rest, ee - slope * de - rest * ue, area


@compiled
def of_mean(variance: float, n: int, floor: float, share: float) -> float:
    """Variance of the mean of `n` values behind the low-pass, of which one in two time constants is
    independent."""
    # a window without noise would be sure of everything
    return max(variance, floor * floor) * 2.0 / (share * n)
