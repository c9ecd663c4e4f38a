"""A recorded velocity, checked against the position it belongs to and put on its instants.

The position is the reference: the velocity of a drive or an estimator may be of another unit, turned in sign,
late, low-passed by its program, or off by the zero of a tachometer. The derivative of a position of coarse steps is noise in most rows,
so it is what is explained here, never what explains (docs/theory.md 9.7).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.logs.signal_shift import advanced, derivatives

SCALE_MAX = 0.03
"""Largest deviation of its scale from that of the position's derivative."""

PARTS, CHANGE_MAX = 3, 0.03
"""Parts of a log in which it is held against the position, and largest change of its scale between them."""

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


STEPS = 10.0
"""Steps of the position over which a recorded velocity is held against its derivative: it is right to a tenth there."""

TRIES = 4
"""Times that a delay is found anew of a velocity already put forward by it."""


@dataclass(frozen=True)
class _Read:
    """A recorded velocity put on the instants of the position; with `scale` and `zero` still in it, and what of the position's it leaves over."""

    velocity: np.ndarray
    late_s: float
    scale: float
    zero: float
    rest: np.ndarray
    filtered: bool


def aligned_velocity(
    recorded: np.ndarray,
    velocity: np.ndarray,
    rate_hz: float,
    cutoff_hz: float,
    source: str,
    step_rad: float = 0.0,
) -> tuple[np.ndarray, tuple[str, ...]]:
    """The recorded velocity without its delay or low-pass and its zero, and what a reader should know of them.

    Parameters
    ----------
    recorded, velocity
        Recorded velocity, and derivative of the position, both through one low-pass; (n,), rad/s.
    step_rad
        Step of the position.

    Raises
    ------
    DataError
        It does not follow the position, or does with another sign or scale, or too late.
    """
    edge = max(4, round(rate_hz / cutoff_hz))
    inside = slice(edge, len(recorded) - edge)
    where = f"{source}: column velocity"
    size = float(recorded[inside].std())
    shifted, behind = (
        _shifted(recorded, velocity, rate_hz, inside),
        _filtered(recorded, velocity, rate_hz, inside),
    )
    read = behind if behind.late_s > 0 and behind.rest.std() < shifted.rest.std() else shifted
    share = _unexplained(read, velocity[inside], rate_hz, step_rad) if size else 1.0
    if not share <= RESIDUAL_MAX:
        raise DataError(
            f"{where}: does not follow the position ({100 * share:.0f} % of the position's derivative is something else, at most "
            f"{100 * RESIDUAL_MAX:.0f} %); map the velocity of the same axis, or leave it out: the position is "
            "differentiated then"
        )
    _require_scale(read.scale, where)
    told = _told(read, where)
    if abs(read.late_s) > DELAY_PERIODS / cutoff_hz:
        raise DataError(
            f"{where}: {told}, at most {1e3 * DELAY_PERIODS / cutoff_hz:.3g} "
            "ms can be put right; leave it out: the position is differentiated then"
        )
    notes = [f"{where}: {told}; put right"] if abs(read.late_s) * rate_hz >= 0.5 else []
    if abs(read.zero) > 0.01 * size:
        notes.append(f"{where}: its zero is off by {read.zero:.3g} rad/s; put right")
    notes += _changing(read, velocity, inside, where)
    return read.velocity - read.zero, tuple(notes)


def _changing(read: _Read, velocity: np.ndarray, inside: slice, where: str) -> list[str]:
    """The warning that its scale against the position's derivative changes over the log."""
    parts = np.array_split(np.arange(*inside.indices(len(velocity))), PARTS)
    scales = []
    for rows in parts:
        matrix = np.column_stack([read.velocity[rows], np.ones(len(rows))])
        scales.append(float(np.linalg.lstsq(matrix, velocity[rows], rcond=1e-9)[0][0]))
    if max(scales) - min(scales) <= CHANGE_MAX:
        return []
    return [
        f"{where}: the position's scale drifts against it: its derivative is {', '.join(f'{each:.3g}' for each in scales)} times the velocity in the thirds of the log "
        "(a belt, a potentiometer, counts that are lost); inertia and friction are wrong by as much as the wrong one of the two"
    ]


def _told(read: _Read, where: str) -> str:
    if read.filtered:
        return f"filtered, as by a low-pass of {0.5 / math.pi / read.late_s:.3g} Hz ({1e3 * read.late_s:.3g} ms late against the position)"
    return f"{1e3 * abs(read.late_s):.3g} ms {'late' if read.late_s > 0 else 'early'} against the position"


def _explained(
    recorded: np.ndarray, velocity: np.ndarray, rate_hz: float, inside: slice
) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of velocity = c recorded + d recorded' + z, and what is left over."""
    matrix = np.column_stack([recorded, derivatives(recorded, 1 / rate_hz)[0], np.ones_like(recorded)])[
        inside
    ]
    unit = np.sqrt((matrix**2).mean(axis=0))
    unit[unit == 0] = 1.0
    found = np.linalg.lstsq(matrix / unit, velocity[inside], rcond=1e-9)[0] / unit
    return found, velocity[inside] - matrix @ found


def _shifted(recorded: np.ndarray, velocity: np.ndarray, rate_hz: float, inside: slice) -> _Read:
    """The velocity taken for late."""
    late_s, most_s = 0.0, 0.5 * (inside.stop - inside.start) / rate_hz
    for _ in range(TRIES):
        ahead = advanced(recorded, rate_hz, late_s)
        (c, more, _), _ = _explained(ahead, velocity, rate_hz, inside)
        late_s = float(np.clip(late_s + (more / c if c else 0.0), -most_s, most_s))
    ahead = advanced(recorded, rate_hz, late_s)
    (c, _, z), rest = _explained(ahead, velocity, rate_hz, inside)
    return _Read(ahead, late_s, *_inverse(c, z), rest, filtered=False)


def _filtered(recorded: np.ndarray, velocity: np.ndarray, rate_hz: float, inside: slice) -> _Read:
    """The velocity taken for low-passed, by a filter of the first order."""
    (c, more, z), rest = _explained(recorded, velocity, rate_hz, inside)
    late_s = float(more / c) if c else 0.0
    undone = recorded + late_s * derivatives(recorded, 1 / rate_hz)[0]
    return _Read(undone, late_s, *_inverse(c, z), rest, filtered=True)


def _inverse(c: float, z: float) -> tuple[float, float]:
    """Scale and zero of the recorded velocity."""
    return (float(1 / c), float(-z / c)) if c else (math.inf, 0.0)


def _unexplained(read: _Read, velocity: np.ndarray, rate_hz: float, step_rad: float) -> float:
    """Share of the position's derivative that the recorded velocity leaves over, RMS, both as means over the time of `STEPS` steps."""
    explained = velocity - read.rest
    rows = round(rate_hz * STEPS * step_rad / max(float(explained.std()), 1e-12))
    window = np.ones(min(max(1, rows), max(1, len(velocity) // 10)))
    rest, whole = (np.convolve(each, window / len(window), mode="valid") for each in (read.rest, velocity))
    return float(rest.std() / max(float(whole.std()), 1e-300))


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
