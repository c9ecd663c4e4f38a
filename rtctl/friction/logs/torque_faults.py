"""Faults of one column of torque: standing still, spikes, too coarse."""

from __future__ import annotations

import numpy as np

from rtctl.errors import DataError

# five bits: a torque of fewer levels repeats itself by nature, and no test of equal values means anything
LEVELS_MIN = 32

COARSE_SHARE = 0.15
"""Largest rounding error (RMS) of a torque, share of its own RMS."""

FROZEN_S, FROZEN_SHARE, FROZEN_ROWS = 0.15, 0.02, 20
"""A torque that otherwise changes with every row and stands still for so long, and so many rows, is told; for
this share of the log, refused."""

OFF_SHARE, OFF_S, OFF_TRAVEL = 0.03, 0.5, 0.1
"""A motor is off whose torque stays below this share of its usual largest for so long; the joint is moved by
another if it goes this share of its range to and fro meanwhile."""

DROPPED_SHARE, DROPPED_NOISE, DROPPED_MOST, DROPPED_LEAST = 0.1, 8.0, 50, 5
"""Zeros between torques of one sign, both above this share of the usual largest and so many times the usual
change of a row, in so many rows at most, are no torque; fewest that are told."""

SPIKE_SCALES, SPIKE_SHARE, SPIKES_MOST = 15.0, 1.0, 0.05
"""Spikes are so many robust standard deviations off, and the usual largest torque; at most this share of
rows, else they are the signal."""

SPIKE_AROUND = 0.4
"""Largest range of the two rows before and after a spike, share of its height."""

WRAPPED_SHARE, MAGNITUDE_SHARE = 0.8, 0.02
"""Numbers of one sign are negative ones that wrapped, where this share of the largest is between two bands;
magnitudes, where the least is below this share (gravity leaves more)."""


ONE_SIGNAL, CANCELS = 0.9995, 0.03
"""Correlation of two torques that are one signal; size of the sum of two that cancel, share of the
motor's."""


def longest_run(marks: np.ndarray) -> tuple[int, int]:
    """First index and length of the longest run of True; (0, 0) without any."""
    at = np.concatenate([[0], marks.astype(int), [0]])
    begins, ends = np.flatnonzero(np.diff(at) > 0), np.flatnonzero(np.diff(at) < 0)
    if not len(begins):
        return 0, 0
    longest = int(np.argmax(ends - begins))
    return int(begins[longest]), int(ends[longest] - begins[longest])


def faults(
    signal: np.ndarray, rate_hz: float, where: str, *, may_rest: np.ndarray | None = None, unit: str = "N m"
) -> list[str]:
    """Warnings about a torque, or another column in `unit`: constant, standing still, spikes, coarse.

    Parameters
    ----------
    may_rest
        Marks of the rows, (n,), in which standing still is nothing wrong: a motor that is off, a joint at one
        speed.

    Raises
    ------
    DataError
        It stands still for a good part of the log."""
    if np.ptp(signal) == 0:
        return [
            f"{where}: constant at {signal[0]:.4g} {unit}; map the column that was measured, or leave it "
            "out if nothing was"
        ]
    return [
        *_dropouts(signal, where),
        *_frozen(signal, rate_hz, where, may_rest, unit),
        *_spikes(signal, where, unit),
        *_coarse(signal, where, unit),
    ]


def _frozen(
    signal: np.ndarray, rate_hz: float, where: str, may_rest: np.ndarray | None, unit: str
) -> list[str]:
    same = np.diff(signal) == 0
    # `_coarse` says that better
    if same.mean() > 0.5 and len(np.unique(signal)) < LEVELS_MIN:
        return []  # coarse
    if may_rest is not None:
        same &= ~may_rest[1:]
    begin, length = longest_run(same)
    # a slower bus stands as long everywhere, and more often than not
    others = np.delete(same, np.s_[begin : begin + length])
    if (
        length < max(FROZEN_ROWS, FROZEN_S * rate_hz)
        or longest_run(others)[1] > length / 2
        or others.mean() > 0.5
    ):
        return []
    text = (
        f"{where}: stands still at {signal[begin]:.4g} {unit} for {length / rate_hz:.3g} s from row "
        f"{begin + 1} on, though it changes otherwise: the sensor or its transfer was frozen; cut the log "
        "there"
    )
    if length > FROZEN_SHARE * len(signal):
        raise DataError(text)
    return [text]


def require_on(motor: np.ndarray, position: np.ndarray, rate_hz: float, where: str) -> None:
    """Refuse a motor torque (N m), the only torque there is, that is 0 for a while in which the joint turns
    back: the motor was off, and something else moved it.

    Raises
    ------
    DataError
        Names row and time."""
    if len(np.unique(motor)) < LEVELS_MIN:
        return  # 0 is a level as any other
    # not 0 itself: an amplifier that is off has an offset and noise
    off = np.abs(motor) <= OFF_SHARE * float(np.quantile(np.abs(motor), 0.95))
    begin, length = longest_run(off)
    if length < max(OFF_S * rate_hz, FROZEN_SHARE * len(motor)):
        return
    there = position[begin : begin + length]
    least = OFF_TRAVEL * float(np.ptp(position))
    # there and back: a joint that coasts to rest goes one way only, and no torque is missing
    high, low = np.maximum.accumulate(there), np.minimum.accumulate(there)
    forth, back = float((there - low).max()), float((high - there).max())
    if min(forth, back) > least:
        raise DataError(
            f"{where}: about 0 for {length / rate_hz:.3g} s from row {begin + 1} on, and the joint turns "
            "back meanwhile: the motor was off and something else moved it; map that torque, or cut that "
            "part out"
        )


def lost_sign(signal: np.ndarray, position: np.ndarray, where: str) -> list[str]:
    """Warnings about a torque (N m), the only one, that has one sign although the joint turns back: it is a
    magnitude.

    Raises
    ------
    DataError
        Negative numbers became large ones; names what to take off."""
    top = float(np.abs(signal).max())
    turned = position - position[0]
    # the way there and the way back, all strokes together: a short turn is no reason for another sign
    there_and_back = min(float(np.diff(turned).clip(0).sum()), float(-np.diff(turned).clip(None, 0).sum()))
    # a motion one way has a torque of one sign by right
    if signal.min() < 0 or not 0 < np.ptp(position) < 4 * there_and_back:
        return []
    levels = np.unique(signal)
    # numbers that wrapped leave the middle of their range empty
    widest = int(np.argmax(np.diff(levels))) if len(levels) > 2 else 0
    high = signal > levels[widest]
    if levels[widest + 1] - levels[widest] > WRAPPED_SHARE * top and 0.05 < high.mean() < 0.95:
        step = float(np.diff(levels).min())
        raise DataError(
            f"{where}: no value is between {levels[widest]:.4g} and {levels[widest + 1]:.4g} N m: negative "
            f"numbers were written without a sign; take {top + step:.6g} N m (a power of 2 of the counts: "
            "65536 of 16 bits) off those above"
        )
    # gravity keeps a torque away from 0; a magnitude comes down to it at every turn
    if levels[0] > MAGNITUDE_SHARE * top:
        return []
    return [
        f"{where}: never negative although the joint turns back: a magnitude? Map the torque with its sign"
    ]


def much(signal: np.ndarray, where: str) -> str:
    """A warning about a torque (N m) that is much for a joint of which nothing is known.

    Raises
    ------
    DataError
        Where it is of whole numbers: what a drive counts in."""
    largest = float(np.abs(signal).max())
    if bool((signal == np.round(signal)).all()):
        raise DataError(
            f"{where}: whole numbers up to {largest:.4g}, read as N m: what a drive counts in (per mille or "
            "percent of the rated torque, mN m, steps of a converter); give what one of them is in N m as "
            "the scale (NAME:Nm:SCALE), or --config RIG, whose limits count then"
        )
    return (
        f"{where}: {largest:.3g} N m is much for what a hand moves: is it in mN m, percent or "
        "per mille of the rated one? Correct its unit, or give --config RIG, whose limits count then"
    )


def require_two(motor: np.ndarray, external: np.ndarray, where: str) -> None:
    """Refuse two torques (N m) that are one signal.

    Raises
    ------
    DataError
        The same column twice, or two that cancel."""
    # without their means: two sensors of one torque have two zeros
    one, other = motor - motor.mean(), external - external.mean()
    sizes = float(one.std()), float(other.std())
    if not min(sizes) > 0:
        return
    if float(np.mean(one * other)) > ONE_SIGNAL * sizes[0] * sizes[1]:
        raise DataError(
            f"{where}: external torque: is the motor torque again, {sizes[1] / sizes[0]:.3g} times it: one "
            "torque mapped twice counts twice; leave one out, or map the hand's"
        )
    if float((one + other).std()) < CANCELS * sizes[0]:
        raise DataError(
            f"{where}: external torque: cancels the motor torque: one torque seen from both sides (a sensor "
            "between motor and joint?) leaves nothing that moves the joint; map the one that acts on what "
            "is behind the position, and leave the other out"
        )


def _dropouts(signal: np.ndarray, where: str) -> list[str]:
    """Rows of exactly 0 between rows that are not, by far, and of one sign: no sample was there."""
    usual = float(np.quantile(np.abs(signal), 0.95))
    # exactly 0: a sensor has noise, and only a program writes this
    given = np.flatnonzero(signal != 0)
    if len(given) < 2 or len(np.unique(signal)) < LEVELS_MIN:
        return []
    before, after = given[:-1], given[1:]
    # a torque that passes 0 is near it in the rows beside
    far = max(DROPPED_SHARE * usual, DROPPED_NOISE * float(np.median(np.abs(np.diff(signal[given])))))
    high = (signal[before] * signal[after] > 0) & (
        np.minimum(np.abs(signal[before]), np.abs(signal[after])) > far
    )
    holes = high & (after - before > 1) & (after - before <= DROPPED_MOST)
    count = int((after - before - 1)[holes].sum())
    if count < DROPPED_LEAST:
        return []
    text = (
        f"{where}: {count} rows are exactly 0 between rows that are far from it, the first row "
        f"{before[holes][0] + 2}: no sample was there (a slower bus, a message that was lost); leave these "
        "rows out, or fill them"
    )
    if count > FROZEN_SHARE * len(signal):
        raise DataError(text)
    return [text]


def _spikes(signal: np.ndarray, where: str, unit: str) -> list[str]:
    up, down = np.diff(signal)[:-1], -np.diff(signal)[1:]
    # how far a row is beyond both its neighbours; a quick change that stays is none
    off = np.zeros(len(signal))
    off[1:-1] = np.where(up * down > 0, np.minimum(np.abs(up), np.abs(down)), 0.0)
    # rows between their neighbours are no extremes, and say nothing of how far noise makes one
    scale = 1.4826 * (float(np.median(off[off > 0])) if off.any() else 0.0)
    around = np.stack([signal[:-4], signal[1:-3], signal[3:-1], signal[4:]])
    off[2:-2][np.ptp(around, axis=0) > SPIKE_AROUND * off[2:-2]] = 0.0  # a servo that rings
    usual = float(np.quantile(np.abs(signal - np.median(signal)), 0.95))
    bound = max(SPIKE_SCALES * scale, SPIKE_SHARE * usual)
    rows = np.flatnonzero(off > bound)
    if not len(rows) or len(rows) > SPIKES_MOST * len(signal):
        return []
    return [
        f"{where}: {len(rows)} rows are spikes of up to {off.max():.3g} {unit}, the first row "
        f"{rows[0] + 1}; they count as measured: look for the cause, or take them out"
    ]


def _coarse(signal: np.ndarray, where: str, unit: str) -> list[str]:
    levels = np.unique(signal)
    if len(levels) >= LEVELS_MIN or _is_switched(signal, levels):
        return []
    # the median: a level that was never reached makes one step of two
    step = float(np.median(np.diff(levels)))
    share = step / np.sqrt(12) / max(float(signal.std()), 1e-12)
    if share <= COARSE_SHARE:
        return []
    return [
        f"{where}: too coarse: {len(levels)} levels, steps of {step:.3g} {unit}, a rounding error of "
        f"{100 * share:.0f} % of it; record more digits, or lower the range of the sensor"
    ]


def _is_switched(signal: np.ndarray, levels: np.ndarray) -> bool:
    """Whether a torque of few `levels` is a command that goes from one to another (steps, a random binary
    one): what was rounded goes by one level at a time, and no sensor has two levels."""
    goes = np.abs(np.diff(np.searchsorted(levels, signal)))
    return len(levels) == 2 or (len(levels) > 2 and float(np.median(goes[goes > 0])) > 1)
