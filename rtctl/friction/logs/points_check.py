"""Whether friction points can be of the rig that a rig file describes: the units, above all."""

from __future__ import annotations

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.logs.plausibility import Limits
from rtctl.friction.points.measured import FrictionPoints
from rtctl.rig_file.config import LoadedConfig


def require_plausible_points(points: FrictionPoints, loaded: LoadedConfig) -> None:
    """Refuse points that no axis of the rig could have given.

    Raises
    ------
    DataError
        Naming the column, its largest value, the bound of the rig file and the unit that is likely wrong.
    """
    refusals = [
        _refusal(points, Limits.of_axis(axis, loaded.path.name), axis.torque_limit_nm)
        for axis in loaded.config.axis
    ]
    if all(refusals):
        raise DataError(refusals[0])


def require_held_out(test: FrictionPoints, training: FrictionPoints) -> None:
    """Refuse to judge a fit by the very file it was made of.

    Raises
    ------
    DataError
        Both files hold the same bytes.
    """
    if test.sha256 == training.sha256:
        raise DataError(
            f"{test.source}: the same points as {training.source}; --test needs points not trained on"
        )


def _refusal(points: FrictionPoints, limits: Limits, torque_limit_nm: float) -> str:
    speed, torque = float(np.abs(points.velocity_rad_s).max()), float(points.friction_nm.max())
    if speed > limits.speed_rad_s:
        return (
            f"{points.source}: column velocity_rad_s: {speed:.4g} rad/s is not plausible (at most "
            f"{limits.speed_rad_s:.4g} for {limits.source}); is it in degrees, or of the motor's side of the gear?"
        )
    if torque > limits.motor_nm:
        return (
            f"{points.source}: column friction_torque_nm: {torque:.4g} N m is not plausible (at most "
            f"{limits.motor_nm:.4g} for {limits.source}); is it in mN m, or does torque_limit_nm = "
            f"{torque_limit_nm:g} not belong to this rig?"
        )
    if torque < limits.torque_least_nm:
        return (
            f"{points.source}: column friction_torque_nm: no friction above {torque:.3g} N m, which is not plausible "
            f"(at least {limits.torque_least_nm:.3g} for {limits.source}); is it of the motor's side of the gear?"
        )
    return ""
