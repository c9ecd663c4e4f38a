"""A recorded velocity, checked against the position it belongs to and put on its instants.

The position is the reference: the velocity of a drive or an estimator may be of another unit, turned in sign,
late by its filter, or off by the zero of a tachometer.
"""

from __future__ import annotations

import math

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.logs.signal_shift import advanced

SCALE_MAX = 0.03
"""Largest deviation of its scale from that of the position's derivative."""

RESIDUAL_MAX = 0.2
"""Largest part of it, RMS, that the position does not explain."""

DELAY_PERIODS = 0.5
"""Largest delay that is put right, periods of the cut-off."""

UNITS = {
    "deg/s": 180 / math.pi,
    "rev/s": 0.5 / math.pi,
    "rpm": 30 / math.pi,
    "the position's in deg": math.pi / 180,
    "the position's in rev": 2 * math.pi,
}
"""Scale that a unit taken for rad/s (or rad) gives."""


def aligned_velocity(
    recorded: np.ndarray,
    velocity: np.ndarray,
    acceleration: np.ndarray,
    rate_hz: float,
    cutoff_hz: float,
    source: str,
) -> tuple[np.ndarray, tuple[str, ...]]:
    """The recorded velocity without its delay and zero, and what a reader should know of them.

    Parameters
    ----------
    recorded, velocity, acceleration
        Recorded velocity, and first and second derivative of the position, all through one low-pass;
        (n,), rad/s and rad/s^2.

    Raises
    ------
    DataError
        It does not follow the position, or does with another sign or scale, or too late.

    Notes
    -----
    recorded = s v - s d a + zero by least squares gives scale s, delay d and zero at once.
    """
    edge = max(4, round(rate_hz / cutoff_hz))
    inside = slice(edge, len(recorded) - edge)
    matrix = np.column_stack([velocity, -acceleration, np.ones_like(velocity)])[inside]
    scale, late, zero = np.linalg.lstsq(matrix, recorded[inside], rcond=None)[0]
    rest = recorded[inside] - matrix @ [scale, late, zero]
    where = f"{source}: column velocity"
    size = float(recorded[inside].std())
    if not float(rest.std()) <= RESIDUAL_MAX * size or size == 0:
        share = float(rest.std()) / size if size else 1.0
        raise DataError(
            f"{where}: does not follow the position ({100 * share:.0f} % of it is something else, at most "
            f"{100 * RESIDUAL_MAX:.0f} %); map the velocity of the same axis, or leave it out: the position is "
            "differentiated then"
        )
    _require_scale(float(scale), where)
    delay_s = float(late / scale)
    if abs(delay_s) > DELAY_PERIODS / cutoff_hz:
        raise DataError(
            f"{where}: {1e3 * delay_s:.3g} ms late against the position, at most {1e3 * DELAY_PERIODS / cutoff_hz:.3g} "
            "ms can be put right; leave it out: the position is differentiated then"
        )
    notes = []
    if abs(delay_s) * rate_hz >= 0.5:
        word = "late" if delay_s > 0 else "early"
        notes.append(f"{where}: {1e3 * abs(delay_s):.3g} ms {word} against the position; put right")
    if abs(zero) > 0.01 * size:
        notes.append(f"{where}: its zero is off by {zero:.3g} rad/s; put right")
    return advanced(recorded - zero, rate_hz, delay_s), tuple(notes)


def _require_scale(scale: float, where: str) -> None:
    if abs(scale - 1) <= SCALE_MAX:
        return
    if abs(scale + 1) <= SCALE_MAX:
        raise DataError(
            f"{where}: turned against the position; turn its sign (scale -1), or that of the position"
        )
    guess = [name for name, factor in UNITS.items() if abs(abs(scale) / factor - 1) <= SCALE_MAX]
    unit = f", as if its unit were {guess[0]}" if guess else ""
    raise DataError(
        f"{where}: {scale:.4g} times the derivative of the position{unit} (within {100 * SCALE_MAX:.0f} % of 1 "
        f"is needed); correct the unit of the velocity, the position or the time, or give scale {1 / scale:.6g}"
    )
