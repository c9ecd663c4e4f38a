"""Plan of what the law makes of a model's places (`control.place_trust`)."""

from __future__ import annotations

import math

import numpy as np

from hw.motion import at_handle
from rtctl.control.place_trust import SLOW_RAD_S
from rtctl.control.vocabulary import PlaceUse
from rtctl.friction.model import FrictionModel
from rtctl.rig_file.axis_tables import AxisTable

PLACE_LENGTH = 0.5
"""Way over which a model's places are judged, share of their longest period."""
PLACE_LAG = 0.25
"""Waves that come at more than this share of the observer's bandwidth are seen too late to judge by."""
ORDINARY_SHARE = 0.05
"""Share of the trained range that ordinary motion is faster than: a ripple that is seen by slower motion only
would keep friction's waves from being judged by it."""


def fill_place(p: np.void, a: int, axis: AxisTable, model: FrictionModel) -> None:
    """Parameters of what the model says of place; without a force sensor it is never seen.

    Waves of the conservative part that pass too quick for the observer but in the slowest motion, slower than
    a hand moves, are judged by nobody: they would keep all of the places from being judged, and are
    compensated only where they are given."""
    friction = axis.friction
    if not model.has_place or friction.place == "off":
        return
    p["place_kind"][a] = PlaceUse[friction.place.upper()]
    p["place_shift_rad"][a] = friction.place_shift_rad
    p["place_trough_nm"][a] = model.place_trough_nm
    p["place_length_rad"][a] = PLACE_LENGTH * model.place_period_rad
    size = at_handle("slow_rad_s") if axis.motion == "linear" else 1.0
    seen_rad_s = PLACE_LAG * p["observer_bandwidth_rad_s"][a] / (2 * math.pi)
    of_friction, of_part = model.place_waves_per_rad
    ordinary_rad_s = ORDINARY_SHARE * min(branch.speed_max_rad_s for branch in model.branches)
    judged = of_friction == 0 or seen_rad_s > max(SLOW_RAD_S * size, ordinary_rad_s) * of_part
    p["conservative_judged"][a] = judged
    p["place_speed_rad_s"][a] = seen_rad_s / (max(of_friction, of_part) if judged else of_friction)
    known = judged or friction.place == "given"
    if known and model.conservative is not None and friction.policy != "observer":
        p["conservative_gain"][a] = friction.gain
        p["conservative_swing_j"][a] = friction.gain * model.conservative.swing_j
