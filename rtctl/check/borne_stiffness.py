"""How stiff a coupling the device of an axis bears behind a current loop that was measured."""

from __future__ import annotations

import math
from collections.abc import Callable

from rtctl.check.stability_report import bearing
from rtctl.control.proofs.stability import Between, k_max_between
from rtctl.rig_file.config import LoadedConfig


def stiffest(loaded: LoadedConfig, index: int) -> Callable[[float, float, float], float]:
    """For axis `index`: the stiffest coupling with the damper of its file, N m/rad, behind a delay and a
    lag, in ticks, and an overshoot."""
    b, _, _, load = bearing(loaded, index)
    b_c, T = (1 + load) * loaded.config.axis[index].coupling.damping_nms_rad, loaded.config.period_s

    def bears(delay: float, lag: float, overshoot: float) -> float:
        return k_max_between(b, b_c, T, Between(delay, 1 / (2 * math.pi * lag * T), overshoot=overshoot))

    return bears
