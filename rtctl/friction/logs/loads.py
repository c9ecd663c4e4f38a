"""The torques through the gear along a log of two torques."""

from __future__ import annotations

from dataclasses import replace

from rtctl.errors import DataError
from rtctl.friction.logs.logs import FrictionSamples
from rtctl.friction.logs.regressors import Regressors


def with_load(samples: FrictionSamples, signals: Regressors) -> FrictionSamples:
    """Samples of the pooled `signals` with the torque from outside and the motor's, N m, signed.

    Raises
    ------
    DataError
        Only one torque was recorded."""
    outside = signals.external_nm
    if outside is None:
        raise DataError(
            f"{signals.source}: friction by load needs two torques of the log, the motor's and the one from "
            "outside (--column torque=... or current=..., and --column external=...); leave --by-load out"
        )
    both = {"load_nm": outside, "motor_nm": signals.torque_nm - outside}
    rows = signals.sliding
    return replace(samples, columns={**samples.columns, **{name: one[rows] for name, one in both.items()}})
