"""How gently help with friction ends beyond the speeds that its model was measured at (docs/theory.md 5.14).

Over a stretch Delta the help, at most all of the dry friction F at the end of the range, falls to nothing: a
damper of slope S = F/Delta that acts t late. A mass swings by it from S t/J_m = pi/2 on, J_m that of the
motor where a gear lets it, and a motor on its gear where b + S cos(w t) is below 0. Of a declared gear
b is what no hand behind it takes away (2.8). So

    S <= J/(2 t),        S <= b/max(-cos(w t)) over all gears up to `FASTEST_GEAR_HZ`"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from rtctl.control.proofs.stability import Between, late_ticks
from rtctl.friction.model import Branch, FrictionModel
from rtctl.rig_file.axis_tables import AxisTable

MOTOR_SHARE = 0.5
"""The motor's part of the inertia, as of all gears that are not declared (`drive_in_hand.resonance`)."""

FASTEST_GEAR_HZ = 250.0
"""A drive that is later than a quarter of its period, 1 ms, swings by slopes beyond the joint's damping."""

_LAST = 0.9
"""Friction may not fall over the last tenth of the range, by more than the model may be off."""


def rolled_off(
    model: FrictionModel, axis: AxisTable, period_s: float, between: Between, taken_nms_rad: float = 0.0
) -> FrictionModel:
    """The model, with help that ends as gently as this axis needs it.

    Where friction still falls with speed at the end of the range it is less beyond, nobody knows how much,
    and a model by place is later there than it was shown to be: both end as the model says.
    `taken_nms_rad` is the damping that a hand behind an elastic joint can cancel."""
    by_place = model.place is not None or model.conservative is not None
    # friction that falls may be gone beyond the range: help that lasts longer would drive the joint
    if by_place or any(map(_falls, model.branches)):
        return model
    steepest = _steepest_nms_rad(axis, period_s, between, taken_nms_rad)
    gentle = max(map(_dry_end_nm, model.branches)) / steepest if steepest > 0 else 0.0
    return replace(model, speed_fade_rad_s=max(model.speed_fade_rad_s, gentle))


def _steepest_nms_rad(axis: AxisTable, period_s: float, between: Between, taken_nms_rad: float) -> float:
    """Largest slope of the help over speed. A velocity is half a period old, and a torque held for as
    long."""
    late_s = period_s * (late_ticks(between, period_s) + 1.0)
    # at most half a turn: a slower gear of the range has that lag already
    turned = min(2 * math.pi * FASTEST_GEAR_HZ * late_s, math.pi)
    against = max(-math.cos(turned), 0.0)
    on_a_gear = (axis.viscous_nms_rad - taken_nms_rad) / against if against > 0 else math.inf
    return min(MOTOR_SHARE * axis.inertia_kgm2 / late_s, on_a_gear)


def _falls(branch: Branch) -> bool:
    before, end = branch.magnitude(branch.speed_max_rad_s * np.array([_LAST, 1.0]))
    return bool(end < before - branch.error_max_nm)


def _dry_end_nm(branch: Branch) -> float:
    """Friction at the end of the range less its viscous part, N m."""
    end = branch.speed_max_rad_s
    return float(branch.magnitude(np.array([end]))[0]) - branch.viscous_nms_rad * end
