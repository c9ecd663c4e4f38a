"""Plan of what the law makes of a model's places (`control.place_trust`)."""

from __future__ import annotations

import math

import numpy as np

from hw.motion import own_size
from rtctl.control.disturbance_observer import SMOOTHING
from rtctl.control.place_trust import SLOW_RAD_S
from rtctl.control.vocabulary import PlaceUse
from rtctl.friction.model import FrictionModel
from rtctl.rig_file.axis_tables import AxisTable

PLACE_LENGTH = 0.5
"""Way over which a model's places are judged, share of their longest period."""
UNMATCHED_RAD = 0.31
"""Waves that are seen later than the model is (`place_trust`) by more than this are no evidence, nor are
those beyond the observer's bandwidth: of a wave .31 rad late a twentieth is lost to the correlation. The
model passes the observer's first low-pass; what is left are its second one and a late force."""
ORDINARY_SHARE = 0.05
"""Share of the trained range that ordinary motion is faster than: a ripple that is seen by slower motion only
would keep friction's waves from being judged by it."""


def judged_by(
    axis: AxisTable,
    waves_per_rad: tuple[float, float],
    trained_rad_s: float,
    bandwidth_hz: float,
    late_s: float = 0.0,
) -> tuple[float, bool]:
    """Speed below which motion says something of the places, rad/s, and whether it says it of the
    conservative part: waves a rad of friction and of that part pass a joint that was trained up to
    `trained_rad_s`, and an observer of this bandwidth, with a force so late, sees them."""
    of_friction, of_part = waves_per_rad  # waves a rad: at a speed they pass so many a second
    seen_hz = 0.0
    # 0: no observer, and nothing is ever seen
    if bandwidth_hz > 0.0:
        second_s = 1.0 / (2 * math.pi * SMOOTHING * bandwidth_hz)
        seen_hz = min(bandwidth_hz, UNMATCHED_RAD / (2 * math.pi * (second_s + late_s)))
    slow_rad_s = own_size("slow_rad_s", SLOW_RAD_S, axis.motion)
    # nothing of friction to be judged: the conservative part then has the motion to itself
    judged = of_friction == 0 or seen_hz > max(slow_rad_s, ORDINARY_SHARE * trained_rad_s) * of_part
    return seen_hz / (max(of_friction, of_part) if judged else of_friction), judged


def fill_place(p: np.void, a: int, axis: AxisTable, model: FrictionModel) -> None:
    """Parameters of what the model says of place; without a force sensor it is never seen.

    Waves of the conservative part that pass too quick for the observer but in the slowest motion, slower than
    a hand moves, are judged by nobody: they would keep all of the places from being judged, and are
    compensated only where they are given."""
    friction = axis.friction
    # all stays 0: the law then has a curve of speed alone
    if not model.has_place or friction.place == "off":
        return
    p["place_kind"][a] = PlaceUse[friction.place.upper()]
    p["place_shift_rad"][a] = friction.place_shift_rad
    p["place_trough_nm"][a] = model.place_trough_nm
    p["place_length_rad"][a] = PLACE_LENGTH * model.place_period_rad
    bandwidth_hz = p["observer_bandwidth_rad_s"][a] / (2 * math.pi)
    # of the direction that was measured less far: beyond it the model is an end, not a curve
    trained_rad_s = min(branch.speed_max_rad_s for branch in model.branches)
    late_s = float(p["observer_late_ticks"][a] * p["period_s"])
    speed_rad_s, judged = judged_by(axis, model.place_waves_per_rad, trained_rad_s, bandwidth_hz, late_s)
    p["conservative_judged"][a], p["place_speed_rad_s"][a] = judged, speed_rad_s
    # given places need nobody's judgement
    known = judged or friction.place == "given"
    if known and model.conservative is not None and friction.policy != "observer":
        p["conservative_gain"][a] = friction.gain
        p["conservative_swing_j"][a] = friction.gain * model.conservative.swing_j
