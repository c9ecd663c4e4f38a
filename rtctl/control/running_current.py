"""Is the measured current the one asked for, as ordinary motion shows it? Gain and offset, by the sums of
`running_delay`.

The same least squares tell them apart where the torque varies enough; what is judged then is the gain alone
and the offset alone, each with three of its standard errors. A torque that stays the same shows only their
sum: then the mean gap between sent and measured must be explained by what both may be together. Two windows
in a row that are off are CURRENT: a sensor that changed since the test pulse, or a drive that gives less than
it is asked for at torques that the pulse does not reach."""

from __future__ import annotations

import math

from rtctl.control.jit import compiled
from rtctl.control.records import Record
from rtctl.control.running_window import moments, of_mean, regression
from rtctl.control.vocabulary import Fault

_F_CURRENT = int(Fault.CURRENT)

ERRORS = 3.0
BAD_WINDOWS = 2

MOST_ERROR = 0.1
"""A gain that is known less well (standard error) is not known."""


@compiled
def _apart(s: Record, axis: int, floor: float, share: float) -> tuple[float, float, float, float]:
    """(gain, its standard error, offset, its standard error) of the window; infinite errors where the torque
    shows neither."""
    slope, rest, left, area = regression(s, axis)
    if area == 0.0:
        return 0.0, math.inf, 0.0, math.inf
    d, u, e, dd, du, uu = moments(s, axis)
    variance = of_mean(left, s.running_ticks[axis], floor, share)
    spread = (d * d * uu - 2.0 * d * u * du + u * u * dd) / area
    # of two regressors: the variance of one goes by the square of the other
    error = math.sqrt(variance * dd / area)
    return 1.0 - rest, error, slope * d + rest * u - e, math.sqrt(variance * (1.0 + spread))


@compiled
def _is_off(s: Record, p: Record, axis: int, floor: float, share: float) -> bool:
    """True when the window shows a current that is surely not the one asked for."""
    sums, n = s.running_sums[axis], s.running_ticks[axis]
    u, e = sums[1] / n, sums[2] / n
    most_gain, most_offset = p.current_gain_error[axis], p.current_offset_nm[axis]
    gain, gain_error, offset, offset_error = _apart(s, axis, floor, share)
    if gain_error <= MOST_ERROR:
        s.running_gain[axis], s.running_offset_nm[axis] = gain, offset  # told, whether or not it is off
        s.running_known_count[axis] = 1
        right = abs(gain - 1.0) <= most_gain + ERRORS * gain_error
        return not (right and abs(offset) <= most_offset + ERRORS * offset_error)
    error = math.sqrt(of_mean(sums[8] / n - e * e, n, floor, share))
    # the sum of both is all that shows
    return not abs(e) <= most_gain * abs(u) + most_offset + ERRORS * error


@compiled
def judge_current(s: Record, p: Record, axis: int, floor: float, share: float) -> int:
    """At the end of a window: CURRENT from the second one in a row on that is off.

    `floor`: least noise that is assumed, N m; `share`: coefficient per tick of the low-pass behind which the
    sums were taken."""
    off = _is_off(s, p, axis, floor, share)
    s.running_gap_count[axis] = s.running_gap_count[axis] + 1 if off else 0
    return _F_CURRENT if s.running_gap_count[axis] >= BAD_WINDOWS else 0
