"""Least squares of the balance of torques on the sliding rows of logs: columns, solution and intervals
(docs/theory.md 9.3)."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from rtctl.friction.logs.even_motion import TooEvenError
from rtctl.friction.logs.intervals import Estimate, covariance, estimates, telling_blocks, time_blocks
from rtctl.friction.logs.offsets import OffsetColumns
from rtctl.friction.logs.regressors import Regressors
from rtctl.friction.logs.speeds_seen import few_slow

CONDITION_MAX = 200.0
"""Largest condition number of the scaled regression before its parameters are refused."""


Columns = dict[str, np.ndarray]
"""Columns of a regression on every row (n,), by the name of their parameter."""


def columns_of(signals: Regressors, offset: OffsetColumns) -> tuple[Columns, Columns]:
    """Columns of both forms, symmetric and per direction."""
    v, a, s = signals.velocity_rad_s, signals.acceleration_rad_s2, signals.direction
    levels = dict(zip(offset.names, offset.logs.T, strict=True))
    besides = dict(signals.by_place)
    if signals.share_nm is not None:
        besides["torque_share"] = signals.share_nm
    return (
        {"inertia_kgm2": a, "viscous_nms_rad": v, "coulomb_nm": s, **besides, **levels},
        {
            "inertia_kgm2": a,
            "viscous_forward_nms_rad": np.where(v > 0, v, 0.0),
            "viscous_backward_nms_rad": np.where(v < 0, v, 0.0),
            "level_forward_nm": 0.5 * (1 + s),
            "level_backward_nm": 0.5 * (1 - s),
            **besides,
        },
    )


@dataclass(frozen=True)
class Regression:
    """A least-squares fit: parameters by name (unit in the name) and how good it is.

    `relative_error` is the residual's RMS over that of the torque without a spring's, `condition` the
    condition number of the columns scaled to unit size (those of a place are one by one at right angles),
    `blocks` the number of stretches of time behind the intervals."""

    parameters: dict[str, Estimate]
    condition: float
    relative_error: float
    rms_nm: float
    n: int
    blocks: int


def solve(
    signals: Regressors, columns: dict[str, np.ndarray], offset: OffsetColumns, nuisance: np.ndarray
) -> Regression:
    """Fit the named `columns` beside the `nuisance` ones."""
    rows, block = signals.sliding, time_blocks(signals)
    if signals.waves is not None:
        nuisance = np.hstack([nuisance, signals.waves])
    matrix, torque = np.column_stack([*columns.values(), nuisance])[rows], signals.torque_nm[rows]
    # a spring moves nothing: beside a strong one any residual would be a small share
    moved = (signals.torque_nm - signals.place_nm)[rows]
    scale = np.sqrt((matrix**2).mean(axis=0))
    scale[scale == 0] = 1.0
    scaled = matrix / scale
    condition = _condition(signals, _told_together(scaled, columns, signals.by_place), columns)
    solution = np.linalg.lstsq(scaled, torque, rcond=None)[0]
    residual = torque - scaled @ solution
    own, drift = np.split(scaled, [len(columns)], axis=1)
    # what a column shares with the drift tells nothing of its parameter (Frisch, Waugh and Lovell)
    # drift and waves are solved for with the rest above; only the intervals are of what is a column's own
    own = own - drift @ np.linalg.lstsq(drift, own, rcond=None)[0]
    error = np.sqrt(np.diag(covariance(own, residual, block, len(offset.owner)))) / scale[: len(columns)]
    telling = telling_blocks(own, block)
    # the fewer of both: slow columns use blocks up, and few blocks may tell a column (docs/theory.md 9.7)
    freedom = [
        min(offset.freedom(name, signals.log[rows], block), blocks - 1)
        for name, blocks in zip(columns, telling, strict=False)
    ]
    return Regression(
        parameters=estimates(list(columns), solution / scale, error, freedom),
        condition=condition,
        relative_error=float(np.sqrt(np.mean(residual**2) / np.mean(moved**2))),
        rms_nm=float(np.sqrt(np.mean(residual**2))),
        n=len(torque),
        blocks=int(block[-1]) + 1,
    )


def _told_together(scaled: np.ndarray, columns: Collection[str], by_place: Collection[str]) -> np.ndarray:
    """Scaled columns, of which those of a place are axes of what they tell together, about their mean:
    gravity, a spring and an offset are alike over a short travel, and the joint is told all the same."""
    if not by_place:
        return scaled
    together = np.zeros(scaled.shape[1], bool)
    together[: len(columns)] = [name in by_place for name in columns]
    place = scaled[:, together] - scaled[:, together].mean(axis=0)
    return np.hstack([scaled[:, ~together], np.linalg.qr(place)[0] * np.sqrt(len(scaled))])


def _condition(signals: Regressors, scaled: np.ndarray, columns: dict[str, np.ndarray]) -> float:
    singular = np.linalg.svd(scaled, compute_uv=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
    # too even is said by what is missing, where that is known: slow rows are easier to record than a motion
    if condition <= CONDITION_MAX:
        return condition
    few = few_slow(signals)
    if few:
        raise TooEvenError(f"{few[0]}; and that is not enough here (condition number {condition:.3g})")
    raise TooEvenError(
        f"{signals.source}: the motion is too even to tell {', '.join(columns)} apart (condition number "
        f"{condition:.3g}, at most {CONDITION_MAX:g}); record quick and slow motion with changing speed"
    )
