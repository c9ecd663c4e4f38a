"""Friction at rest as the slowest speeds show it, where a ramp is too quick for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rtctl.identify.measurement_order import Known

# a ramp finds up to a tenth less on a steep peak (docs/theory.md 9.1)
RAISED_SHARE = 0.01
"""Friction at rest is taken from the slowest speed only where the ramps found less by more than this share:
noise raises nothing."""
RAISED = ("friction_torque_nm", "weakest_place_nm", "presliding_rad", "presliding_spread_rad")
"""What is in proportion to the torque of a break-away point: a presliding length is that torque over a
stiffness."""


def held_nm(known: Sequence[Known], direction: int) -> float:
    """Friction that a joint at rest holds at least, by the slowest speeds in this direction, N m; 0 where
    they do not tell.

    Notes
    -----
    Before a joint slips it creeps, at a speed at which friction may have fallen already: a ramp finds up to a
    tenth less than what the joint drags at that speed, on a Stribeck peak at .01 rad/s. Friction that still
    falls from the slowest speed to the next is no less at rest."""
    moving = sorted(
        (one.speed_rad_s, one.friction_nm)
        for one in known
        if one.direction == direction and one.speed_rad_s > 0
    )
    # two speeds: of one alone nobody knows whether friction falls or rises there
    return moving[0][1] if len(moving) > 1 and moving[0][1] > moving[1][1] else 0.0


def raise_break_away(points: Sequence[dict[str, Any]], known: Sequence[Known]) -> None:
    """Let the break-away points, as a data set keeps them, say what the slowest speeds show; `ramp_nm` is
    what the ramps found."""
    for point in points:
        if point["target_rad_s"] != 0:
            continue
        ramp_nm = float(point.setdefault("ramp_nm", point["friction_torque_nm"]))
        held = held_nm(known, point["direction"])
        wanted = held if held > (1.0 + RAISED_SHARE) * abs(ramp_nm) else abs(ramp_nm)
        # against what stands there now, which an earlier call may have raised: the ramps' own is kept apart
        factor = wanted / abs(float(point["friction_torque_nm"]))
        for name in RAISED:
            if point.get(name) is not None:
                point[name] *= factor
