"""What a number that somebody described, a field of a packet, a line or a CAN frame, is in SI units: by its
channel, and by the motion of its axis."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from hw.interface import WHOLE_RIG_CHANNELS, BackendError, Options, Rig
from hw.motion import LENGTH_UNITS, SPEED_UNITS, coordinate_units, effort_units

Units = Mapping[str, Mapping[str, float]]
"""Units of each channel on a rotary axis, factors to SI; besides, counts. A linear axis has others."""


def spelled(turn: str, newton_metre: str) -> Units:
    """The units, with a turn and a newton metre as a format writes them."""
    angles = {"rad": 1.0, "deg": math.pi / 180, turn: 2 * math.pi}
    amperes, newton_metres = {"A": 1.0, "mA": 1e-3}, {newton_metre: 1.0, f"m{newton_metre}": 1e-3}
    return {
        "position": angles,
        "velocity": {**{f"{unit}/s": factor for unit, factor in angles.items()}, "rpm": math.pi / 30},
        "current": amperes,
        "current_command": amperes,
        "torque": newton_metres,
        "force": {"N": 1.0, "mN": 1e-3},
        "moment": newton_metres,
        "temperature": {"degC": 1.0},
    }


def si_per_unit(field: Options, rig: Rig, units: Units, where: str = "") -> float:
    """SI units per unit of a field; of what is no channel, flags and counters, 1. Raises BackendError for a
    unit that its axis does not have."""
    channel, unit = field["channel"], field["unit"]
    if unit.startswith("count"):
        return 2 * math.pi / float(rig.encoder_counts_per_rev[field["axis"]])
    if channel not in units or unit == "1":
        return 1.0
    axis = 0 if channel in WHOLE_RIG_CHANNELS else field["axis"]
    known = _on_axis(channel, units[channel], *rig.moves(axis))
    if unit not in known:
        raise BackendError(
            f"{where}{channel}: unit {unit!r}, which axis {field['axis']} does not have: it has "
            f"{', '.join(known)}; correct the unit, or motion and lead_m of the axis"
        )
    return known[unit]


def _on_axis(channel: str, rotary: Mapping[str, float], motion: str, lead_m: float) -> dict[str, float]:
    # of a screw a turn is its lead, not 6 m, and 1 N m on it is 2 pi / lead N
    if channel == "torque":
        return effort_units(rotary, motion, lead_m)
    own = {"position": LENGTH_UNITS, "velocity": SPEED_UNITS}.get(channel)
    return dict(rotary) if own is None else coordinate_units(rotary, own, motion, lead_m)


def force_numbers(components: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Coarsest step and least end, N, of those of the components of a force; 0 and 0 without any."""
    steps, ends = zip(*components, strict=True) if components else ((0.0,), (0.0,))
    return max(steps), min(ends)
