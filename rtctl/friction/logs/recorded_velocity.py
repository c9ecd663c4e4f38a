"""A recorded velocity, checked against the position it belongs to and put on its instants.

The position is the reference: the velocity of a drive or an estimator may be of another unit, turned in sign,
late, low-passed by its program, or off by the zero of a tachometer. The derivative of a position of coarse
steps is noise in most rows, so it is what is explained here, never what explains (docs/theory.md 9.7)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.logs.signal_shift import advanced, derivatives

SCALE_MAX = 0.03
"""Largest deviation of its scale from that of the position's derivative."""

PARTS, CHANGE_MAX = 3, 0.03
"""Parts of a log in which it is held against the position, and largest change of its scale between them."""

EVEN_SHARE = 0.1
"""Least by which the velocity of a part varies, share of the whole's."""

RESIDUAL_MAX = 0.2
"""Largest part of it, RMS, that the position does not explain."""

DELAY_PERIODS = 0.5
"""Largest delay that is put right, periods of the cut-off."""

UNITS = {
    "deg/s": 180 / math.pi,
    "rev/s": 0.5 / math.pi,
    "rpm": 30 / math.pi,
    "mrad/s": 1e3,
    "the position's in deg": math.pi / 180,
    "the position's in rev": 2 * math.pi,
    "the position's in mrad": 1e-3,
}
"""Scale that a unit taken for rad/s (or rad) gives."""


STEPS = 10.0
"""Steps of the position over which a recorded velocity is held against its derivative: it is right to a tenth
there."""

SURELY = 3.0
"""Standard errors by which a delay, a scale or its change must differ from what is right."""

BENT, BENT_REST = 0.05, 0.75
"""Least share by which it bends against the position's derivative at its largest, and largest share of the
rest, RMS, that is left with that, to be told."""

CUT_REST, CUT_LEAST = 0.5, 0.02
"""Largest share of the rest, RMS, that is left where the derivative is cut off at the largest velocity, and
least share of it, RMS, that is cut off."""

MORE_REST = 0.75
"""Largest share of the rest, RMS, that a second low-pass leaves to be told."""

UNEVEN_MOST = 0.5
"""Distance of a scale from 1 from which on it is one of another unit, however it changes."""

FACTOR_REST = 2.0
"""Largest part that one factor leaves over, of the factor's distance from 1, to be told as a unit."""

TRIES = 4
"""Times that a delay is found anew of a velocity already put forward by it."""


@dataclass(frozen=True)
class _Read:
    """A recorded velocity put on the instants of the position; with `scale` and `zero` still in it, and what
    of the position's it leaves over."""

    velocity: np.ndarray
    late_s: float
    scale: float
    zero: float
    rest: np.ndarray
    passes: int = 0
    """Low-passes of the first order that it is taken to be behind; 0: it is late."""


def aligned_velocity(
    recorded: np.ndarray,
    velocity: np.ndarray,
    rate_hz: float,
    cutoff_hz: float,
    source: str,
    step_rad: float = 0.0,
    grain_rad_s: float = 0.0,
) -> tuple[np.ndarray, tuple[str, ...]]:
    """The recorded velocity without its delay or low-pass and its zero, and what a reader should know of
    them.

    Parameters
    ----------
    recorded, velocity
        Recorded velocity, and derivative of the position, both through one low-pass; (n,), rad/s.
    step_rad, grain_rad_s
        Steps of the position and of the recorded velocity.

    Raises
    ------
    DataError
        It does not follow the position, or does with another sign or scale, or too late."""
    edge = max(4, round(rate_hz / cutoff_hz))
    inside = slice(edge, len(recorded) - edge)
    where = f"{source}: column velocity"
    size = float(recorded[inside].std())
    read = _best(recorded, velocity, rate_hz, inside)
    free = _free(len(velocity[inside]), rate_hz, cutoff_hz, step_rad / max(size, 1e-12))
    share = _unexplained(read, velocity[inside], rate_hz, step_rad) if size else 1.0
    bends = _bends(read, velocity, inside, grain_rad_s) if size else ""
    if not share <= RESIDUAL_MAX and not bends:
        raise DataError(
            f"{where}: does not follow the position ({100 * share:.0f} % of the position's derivative is "
            f"something else, at most {100 * RESIDUAL_MAX:.0f} %); map the velocity of the same axis, or "
            "leave it out: the position is differentiated then"
        )
    error = float(read.rest.std()) / max(size, 1e-300) / math.sqrt(free)
    told = _told(read)
    uneven = bends or _changing(read, velocity, inside, free, grain_rad_s)
    off = max(SCALE_MAX, SURELY * error)
    if uneven and off < abs(read.scale - 1) < UNEVEN_MOST:
        raise DataError(f"{where}: {uneven}; leave out the one that is wrong, or record it whole")
    _require_scale(read.scale, share, off, f"{where}: {told}" if read.passes > 1 else where)
    if abs(read.late_s) > DELAY_PERIODS / cutoff_hz:
        raise DataError(
            f"{where}: {told}, at most {1e3 * DELAY_PERIODS / cutoff_hz:.3g} "
            "ms can be put right; leave it out: the position is differentiated then"
        )
    brisk = max(float(derivatives(recorded, 1 / rate_hz)[0][inside].std()), 1e-300)
    if abs(read.late_s) < SURELY * error * size / brisk:  # steps of the position look like as much
        read = replace(read, velocity=recorded, late_s=0.0)
    notes = [f"{where}: {told}; put right"] if abs(read.late_s) * rate_hz >= 0.5 else []
    if abs(read.zero) > 0.01 * size and abs(read.zero) > SURELY * error * size:
        notes.append(f"{where}: its zero is off by {read.zero:.3g} rad/s; put right")
    notes += [f"{where}: {uneven}"] if uneven else []
    return read.velocity - read.zero, tuple(notes)


def _free(rows: int, rate_hz: float, cutoff_hz: float, step_s: float) -> float:
    """Values that are independent of each other, of so many rows; `step_s` is the time of a step of the
    position, which is wrong by the same as long."""
    return max(1.0, rows / rate_hz / max(1 / cutoff_hz, step_s))


def _best(recorded: np.ndarray, velocity: np.ndarray, rate_hz: float, inside: slice) -> _Read:
    """The velocity taken for late, or for low-passed once or twice: what leaves least over."""
    read = _shifted(recorded, velocity, rate_hz, inside)
    for passes, most in ((1, 1.0), (2, MORE_REST)):
        behind = _filtered(recorded, velocity, rate_hz, inside, passes)
        if behind.late_s > 0 and behind.rest.std() < most * read.rest.std():
            read = behind
    return read


def _bends(read: _Read, velocity: np.ndarray, inside: slice, grain_rad_s: float) -> str:
    """What is said where the scale against the position's derivative is another one at large speeds; ""
    else."""
    v, x = read.velocity[inside], velocity[inside]
    largest = max(float(np.quantile(np.abs(v), 0.99)), 1e-300)
    cut = np.clip(x, -largest, largest)  # what a velocity that was clipped would have shown
    if (cut - v).std() < CUT_REST * (x - v).std() and (x - cut).std() > CUT_LEAST * v.std():
        return (
            f"clipped at about {largest:.3g} rad/s: the position goes by up to {float(np.abs(x).max()):.3g} "
            "rad/s"
        )
    matrix = np.column_stack([v, v**3 / largest**2, np.ones_like(v)])  # odd powers: both ways bend alike
    found = np.linalg.lstsq(matrix, x, rcond=1e-9)[0]
    more = float(found[1] / found[0]) if found[0] else 0.0
    rest = x - matrix @ found
    if abs(more) < max(BENT, grain_rad_s / largest) or rest.std() > BENT_REST * read.rest.std():
        return ""
    if more > 0:
        return (
            f"saturates: at its largest, {largest:.3g} rad/s, the position's derivative is {100 * more:.0f} "
            "% larger against it than at small speeds"
        )
    return (
        "counts of the position are lost at speed: its derivative falls behind the velocity by "
        f"{-100 * more:.0f} % at the largest, {largest:.3g} rad/s (an encoder's or a counter's highest "
        "frequency), or the velocity is not linear"
    )


def _changing(read: _Read, velocity: np.ndarray, inside: slice, free: float, grain_rad_s: float) -> str:
    """What is said where its scale against the position's derivative changes over the log, of which `free`
    values are independent; "" else. A speed of few steps is off by up to half of one."""
    parts = np.array_split(np.arange(*inside.indices(len(velocity))), PARTS)
    scales, errors = [], []
    for rows in parts:
        matrix = np.column_stack([read.velocity[rows], np.ones(len(rows))])
        found = np.linalg.lstsq(matrix, velocity[rows], rcond=1e-9)[0]
        rest, size = float((velocity[rows] - matrix @ found).std()), float(read.velocity[rows].std())
        if size < EVEN_SHARE * float(read.velocity[inside].std()):
            continue  # a part at one speed tells a zero as well as a scale
        scales.append(float(found[0]))
        chance = rest / max(size, 1e-300) / math.sqrt(max(1.0, free / PARTS))
        errors.append(math.hypot(chance, 0.5 * grain_rad_s / max(size, 1e-300)))
    if not scales or max(scales) - min(scales) <= max(CHANGE_MAX, SURELY * math.hypot(*errors)):
        return ""
    return (
        "the position's scale drifts against it: its derivative is "
        f"{', '.join(f'{each:.3g}' for each in scales)} times the velocity in the thirds of the log (a "
        "belt, a potentiometer, counts that are lost); inertia and friction are wrong by as much as the "
        "wrong one of the two"
    )


def _told(read: _Read) -> str:
    late = f"{1e3 * abs(read.late_s):.3g} ms {'late' if read.late_s > 0 else 'early'} against the position"
    if not read.passes:
        return late if read.late_s > 0 else f"{late}, as a set point is, which runs ahead of the joint"
    return (
        f"filtered, as by {'a low-pass' if read.passes == 1 else 'two low-passes'} of "
        f"{0.5 * read.passes / math.pi / read.late_s:.3g} Hz ({late})"
    )


def _explained(
    recorded: np.ndarray, velocity: np.ndarray, rate_hz: float, inside: slice, order: int = 1
) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of velocity = z + c recorded + d recorded' (+ e recorded''), and what is left over."""
    first, second = derivatives(recorded, 1 / rate_hz)
    matrix = np.column_stack([np.ones_like(recorded), recorded, *(first, second)[:order]])[inside]
    unit = np.sqrt((matrix**2).mean(axis=0))
    unit[unit == 0] = 1.0
    found = np.linalg.lstsq(matrix / unit, velocity[inside], rcond=1e-9)[0] / unit
    return found, velocity[inside] - matrix @ found


def _shifted(recorded: np.ndarray, velocity: np.ndarray, rate_hz: float, inside: slice) -> _Read:
    """The velocity taken for late."""
    late_s, most_s = 0.0, 0.5 * (inside.stop - inside.start) / rate_hz
    # again from where the last one came to: a first derivative tells a small delay, and a large one only
    # nearly
    for _ in range(TRIES):
        ahead = advanced(recorded, rate_hz, late_s)
        (_, c, more), _ = _explained(ahead, velocity, rate_hz, inside)
        late_s = float(np.clip(late_s + (more / c if c else 0.0), -most_s, most_s))
    ahead = advanced(recorded, rate_hz, late_s)
    (z, c, _), rest = _explained(ahead, velocity, rate_hz, inside)
    return _Read(ahead, late_s, *_inverse(c, z), rest)


def _filtered(
    recorded: np.ndarray, velocity: np.ndarray, rate_hz: float, inside: slice, passes: int
) -> _Read:
    """The velocity taken for low-passed, by so many filters of the first order (of two the second need not be
    as the first)."""
    (z, c, *more), rest = _explained(recorded, velocity, rate_hz, inside, passes)
    lags = [float(each / c) if c else 0.0 for each in more]
    undone = recorded + sum(
        lag * each for lag, each in zip(lags, derivatives(recorded, 1 / rate_hz), strict=False)
    )
    return _Read(undone, lags[0], *_inverse(c, z), rest, passes)


def _inverse(c: float, z: float) -> tuple[float, float]:
    """Scale and zero of the recorded velocity."""
    return (float(1 / c), float(-z / c)) if c else (math.inf, 0.0)


def _unexplained(read: _Read, velocity: np.ndarray, rate_hz: float, step_rad: float) -> float:
    """Share of the position's derivative that the recorded velocity leaves over, RMS, both as means over the
    time of `STEPS` steps."""
    explained = velocity - read.rest
    rows = round(rate_hz * STEPS * step_rad / max(float(explained.std()), 1e-12))
    window = np.ones(min(max(1, rows), max(1, len(velocity) // 10)))
    rest, whole = (np.convolve(each, window / len(window), mode="valid") for each in (read.rest, velocity))
    return float(rest.std() / max(float(whole.std()), 1e-300))


def _require_scale(scale: float, share: float, most: float, where: str) -> None:
    if abs(scale - 1) <= most:
        return
    if abs(scale + 1) <= most:
        raise DataError(
            f"{where}: turned against the position; turn its sign (scale -1, behind the unit), or that of "
            "the position"
        )
    if share * FACTOR_REST > abs(scale - 1):
        raise DataError(
            f"{where}: not of the same motion as the position: {scale:.4g} times its derivative, and "
            f"{100 * share:.2g} % of that is something else: a set point in place of what was measured, a "
            "velocity that is filtered, clipped or coarse, or of another axis; leave it out, or map what "
            "was measured of both"
        )
    guess = [name for name, factor in UNITS.items() if abs(abs(scale) / factor - 1) <= SCALE_MAX]
    unit = f", as if its unit were {guess[0]}" if guess else ""
    raise DataError(
        f"{where}: {scale:.4g} times the derivative of the position{unit} (within {100 * SCALE_MAX:.0f} % "
        "of 1 is needed); correct the unit of the velocity, the position or the time, or give scale "
        f"{1 / scale:.6g}"
    )
