"""The last stage before the motor: finite, over-speed, absolute, rate and 250 ms limits, encoded value.

It shares no code with the law, so that one mistake cannot pass both. Its only inputs are the torque the
law wants, the torque that was sent, the velocity, and the limits. What it finds broken in itself (its own
memory, its limits, the value to be encoded) is a VIOLATION: the caller locks the rig out."""

from __future__ import annotations

from rtctl.control.jit import compiled, inlined
from rtctl.control.vocabulary import GateFlag

_NOT_FINITE = int(GateFlag.NOT_FINITE)
_ABSOLUTE = int(GateFlag.ABSOLUTE)
_RATE = int(GateFlag.RATE)
_DISABLED = int(GateFlag.DISABLED)
_OVERSPEED = int(GateFlag.OVERSPEED)
_SHARE = int(GateFlag.SHARE)
_WINDOW = int(GateFlag.WINDOW)
_VIOLATION = int(GateFlag.VIOLATION)

WINDOW_S = 0.25
"""Length of the window of the continuous limit."""

FOLD_BACK = 0.8
"""The limit falls from here, as a share of the continuous one, linearly to the continuous limit itself: with
1 it would be a switch, all of the peak until the mean is there and then bursts."""

SLACK = 1e-9
"""Relative rounding granted to a check of the gate's own results."""


@compiled
def _finite(x: float) -> bool:
    """False for NaN and infinities: only they are not equal to themselves, or lose x - x = 0."""
    return x - x == 0.0


@compiled
def _clamped(x: float, low: float, high: float) -> float:
    if x > high:
        return high
    return low if x < low else x


@compiled
def window_limit(mean: float, limit: float, continuous: float, share: float) -> float:
    """Largest |torque| that the 250 ms window leaves, N m.

    Parameters
    ----------
    mean : float
        Mean |torque| over the window, N m.
    limit, continuous : float
        Peak and continuous limit, N m.
    share : float
        What one tick counts (`push_window`).

    Notes
    -----
    From FOLD_BACK c on the limit falls on a line through (c, c); a constant demand settles where the line
    meets its own mean, at c. It also never lets one tick carry the mean beyond c."""
    if not continuous < limit:  # also NaN
        return limit
    start = FOLD_BACK * continuous
    slope = (limit - continuous) / (continuous - start)
    # the line alone would let a mean just below its start be carried past c by one tick of the whole peak
    ahead = mean + (continuous - mean) / share  # one tick of so much brings the mean just to c
    return _clamped(min(limit - slope * (mean - start), ahead), 0.0, limit)


@compiled
def push_window(mean: float, torque: float, share: float) -> float:
    """Mean |torque| of the window after one more tick, N m.

    Parameters
    ----------
    mean : float
        Before, N m. 0 before the first tick.
    share : float
        What one tick counts: 1 - exp(-2 T / 250 ms).

    Notes
    -----
    The window is exponential, with the time constant of half a rectangular one of 250 ms: a rectangular
    one lets a constant demand come through in bursts of its own length. While this mean stays below c, the
    plain mean of any 250 ms stays below 1.5 c, and that of long times below c."""
    return mean + share * (abs(torque) - mean)


@inlined
def gate_torque(
    wanted: float,
    previous: float,
    velocity: float,
    limit: float,
    allowed: float,
    rate: float,
    v_limit: float,
    enabled: bool,
) -> tuple[float, int]:
    """Torque that may be sent, and `GateFlag` bits saying what was done to the wanted one.

    Parameters
    ----------
    wanted, previous : float
        Torque asked for now and torque sent in the last tick, N m.
    velocity : float
        rad/s.
    limit : float
        Largest |torque| ever, N m.
    allowed : float
        Largest |torque| at present (state, temperature, waiver, window), N m. Above it |torque| falls by
        `rate` per tick, and never rises. NaN means 0.
    rate : float
        Largest change per tick, N m.
    v_limit : float
        Above this speed torque * velocity <= 0.
    enabled : bool
        False sends 0 at once.

    Returns
    -------
    torque : float
        Always finite, |torque| <= limit, and within `rate` of `previous` unless it was cut to 0 by
        DISABLED, NOT_FINITE, OVERSPEED or VIOLATION.
    flags : int
        NOT_FINITE means cut, VIOLATION lock-out: the caller acts on them in the same tick."""
    # before everything, at rest too: a limit of NaN would let any torque pass each comparison below
    if not (limit > 0.0 and rate > 0.0 and _finite(limit) and _finite(rate)):
        return 0.0, _VIOLATION
    if not abs(previous) <= limit * (1.0 + SLACK):  # its own memory: NaN is broken, too
        return 0.0, _VIOLATION
    if not enabled:
        return 0.0, _DISABLED
    if not (_finite(wanted) and _finite(velocity)):
        return 0.0, _NOT_FINITE
    flags = 0
    torque = wanted
    if abs(torque) > limit:
        torque = _clamped(torque, -limit, limit)
        flags |= _ABSOLUTE
    ceiling = allowed if allowed > 0.0 else 0.0
    # a share that falls at once must not be a jump
    ceiling = _clamped(max(ceiling, abs(previous) - rate), 0.0, limit)
    if abs(torque) > ceiling:
        torque = _clamped(torque, -ceiling, ceiling)
        flags |= _SHARE
    if abs(torque - previous) > rate:
        torque = _clamped(torque, previous - rate, previous + rate)
        flags |= _RATE
    torque = _clamped(torque, -limit, limit)  # previous may stand SLACK above it
    # last: of what would be sent, not of what was wanted
    if not -v_limit <= velocity <= v_limit and torque * velocity > 0.0:
        return 0.0, flags | _OVERSPEED
    return torque, flags


@compiled
def encoded_fits(torque: float, encoded: float, per_unit: float, limit: float) -> bool:
    """True when the value to be encoded says the torque the gate let pass, within the limit.

    Parameters
    ----------
    torque : float
        From `gate_torque`, N m.
    encoded : float
        What goes to the device, in its unit (A, or N m with `per_unit` 1).
    per_unit : float
        Torque of one unit, N m."""
    if not (_finite(torque) and _finite(encoded) and abs(torque) <= limit):
        return False
    said = encoded * per_unit
    # of the limit, not of the torque: near 0 a relative error says nothing
    return abs(said) <= limit * (1.0 + SLACK) and abs(said - torque) <= SLACK * limit


@compiled
def window_flag(allowed: float, torque: float) -> int:
    """WINDOW while the window's limit `allowed` is what bounds `torque`."""
    return _WINDOW if abs(torque) >= allowed else 0
