"""The last stage before the motor: finite, over-speed, absolute and rate limits.

It shares no code with the law, so that one mistake cannot pass both. Its only inputs are the torque the
law wants, the torque that was sent, the velocity, and four limits.
"""

from __future__ import annotations

from rtctl.control.jit import compiled
from rtctl.control.vocabulary import GateFlag

_NOT_FINITE = int(GateFlag.NOT_FINITE)
_ABSOLUTE = int(GateFlag.ABSOLUTE)
_RATE = int(GateFlag.RATE)
_DISABLED = int(GateFlag.DISABLED)
_OVERSPEED = int(GateFlag.OVERSPEED)


@compiled
def _finite(x: float) -> bool:
    """False for NaN and infinities: only they are not equal to themselves, or lose x - x = 0."""
    return x - x == 0.0


@compiled
def gate_torque(
    wanted: float, previous: float, velocity: float, limit: float, rate: float, v_limit: float, enabled: bool
) -> tuple[float, int]:
    """Torque that may be sent, and `GateFlag` bits saying what was done to the wanted one.

    Parameters
    ----------
    wanted, previous : float
        Torque asked for now and torque sent in the last tick, N m.
    velocity : float
        rad/s.
    limit, rate : float
        Largest |torque|, N m, and largest change per tick, N m. Not positive or not finite means 0.
    v_limit : float
        Above this speed torque * velocity <= 0.
    enabled : bool
        False sends 0 at once.

    Returns
    -------
    torque : float
        Always finite, |torque| <= limit, and within `rate` of `previous` unless it was cut to 0 by
        DISABLED, NOT_FINITE or OVERSPEED.
    flags : int
        NOT_FINITE means cut: the caller disables the rig in the same tick.
    """
    if not enabled:
        return 0.0, _DISABLED
    if not (_finite(wanted) and _finite(previous) and _finite(velocity)):
        return 0.0, _NOT_FINITE
    if not (limit > 0.0 and rate > 0.0 and _finite(limit) and _finite(rate)):
        return 0.0, _ABSOLUTE
    flags = 0
    torque = wanted
    if torque > limit or torque < -limit:
        torque = limit if torque > 0.0 else -limit
        flags |= _ABSOLUTE
    if torque > previous + rate:
        torque = previous + rate
        flags |= _RATE
    elif torque < previous - rate:
        torque = previous - rate
        flags |= _RATE
    # The last torque was within limits too, unless limits or state were damaged: never trust it.
    if torque > limit or torque < -limit:
        torque = limit if torque > 0.0 else -limit
        flags |= _ABSOLUTE
    if not -v_limit <= velocity <= v_limit and torque * velocity > 0.0:
        return 0.0, flags | _OVERSPEED
    return torque, flags
