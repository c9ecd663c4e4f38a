"""Where the law ends a motion that runs out of its travel: room is left behind it to be braked in."""

from __future__ import annotations

from rtctl.control.program import BRAKE_SHARE
from rtctl.identify.settings import Rig

SPARE_S = 0.15
"""Time a host may be late in ending a motion; the planned travel leaves room for it."""


def run_on_rad(rig: Rig, speed_rad_s: float) -> float:
    """How far the joint runs on while the law brakes it from a speed (`control.program`, BRAKE), without any
    friction, rad.

    Notes
    -----
    At its speed until the torque answers. Then d v, at most the cap c: down to c/d at the rate c/J, from
    there on exponentially by another J/d times the speed."""
    most_nm, d, J = BRAKE_SHARE * rig.torque_limit_nm, rig.damping_nms_rad, rig.inertia_kgm2
    slow = min(speed_rad_s, most_nm / d)
    late_rad = rig.late_s * speed_rad_s
    return late_rad + J * (speed_rad_s**2 - slow**2) / (2 * most_nm) + J * slow / d


def guards_rad(
    rig: Rig, travel_rad: tuple[float, float], here_rad: float, margin_rad: float, velocity_rad_s: float
) -> tuple[float, float]:
    """Lower and upper guard of a motion from `here_rad` at `velocity_rad_s` (signed; 0: not a turn), within
    the planned travel and a margin at either end.

    Half a margin beyond what is planned; on the way out far enough within the rig's own end to be braked
    there, but never so far that a host in half of its time would meet it. On the way in the guard behind the
    joint is a little behind it, where a late host left it out there: an encoder that flickers goes outward
    at times."""
    ends, half_rad, v = (rig.position_min_rad, rig.position_max_rad), 0.5 * margin_rad, velocity_rad_s
    guards = []
    for side, end, planned in zip((-1.0, 1.0), ends, travel_rad, strict=True):
        beyond = side * planned + half_rad
        if side * v > 0.0:
            stopped = side * end - run_on_rad(rig, abs(v))
            beyond = min(beyond, max(stopped, side * planned - 0.5 * SPARE_S * abs(v)))
        elif side * v < 0.0:
            beyond = max(beyond, side * here_rad + 0.5 * half_rad)
        guards.append(side * min(side * end, beyond))
    return guards[0], guards[1]
