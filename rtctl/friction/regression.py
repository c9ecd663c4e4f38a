"""Joint least squares of inertia, viscous friction, Coulomb friction and offset from one log, with intervals.

=======  ==========  ==========================================================
v, a     rad/s, ...  velocity, acceleration
tau      N m         motor torque plus external torque
J, b     kg m^2, ..  inertia, viscous friction (N m s/rad)
F_c, o   N m         Coulomb friction, offset (bias of the torque)
s        1           direction of motion, +1 or -1, low-passed as everything else
=======  ==========  ==========================================================

Symmetric ``tau = J a + b v + F_c s + o``; per direction ``tau = J a + b+ v+ + b- v- + f+ H(s) + f- H(-s)``,
where offset and a difference of Coulomb friction cannot be told apart: both are in f+ and f-.

The intervals cover what is random in a log. A torque recorded early or late against the position, or
bristles that still bend, shift the parameters besides: d seconds of delay add J d w^2 to the viscous friction
seen at the angular frequency w, and a tenth of a millisecond may be more than its interval. Correct a known
delay before (`rtctl.friction.regressors.advanced`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.dynamics import RANK_TOLERANCE, SAMPLES_MIN, require_both_directions
from rtctl.friction.regressors import Regressors

BLOCK_PERIODS = 10
"""Shortest block of the standard errors, periods of the cut-off: residuals of two blocks are then independent."""

BLOCKS_MIN, BLOCKS_MAX = 6, 20

CONDITION_MAX = 200.0
"""Largest condition number of the scaled regression before its parameters are refused."""


@dataclass(frozen=True)
class Estimate:
    """One parameter: value, standard error and 95 % interval, in the parameter's unit."""

    value: float
    standard_error: float
    low: float
    high: float

    def holds(self, truth: float) -> bool:
        """Whether the 95 % interval contains `truth`."""
        return self.low <= truth <= self.high


@dataclass(frozen=True)
class Regression:
    """A least-squares fit: parameters by name (unit in the name) and how good it is.

    `relative_error` is the residual's RMS over the torque's, `condition` the condition number of the
    columns scaled to unit size, `blocks` the number of stretches of time behind the intervals.
    """

    parameters: dict[str, Estimate]
    condition: float
    relative_error: float
    rms_nm: float
    n: int
    blocks: int


@dataclass(frozen=True)
class JointFit:
    """Both fits of one log, and what a reader of the numbers must know besides (`warnings`)."""

    symmetric: Regression
    per_direction: Regression
    warnings: tuple[str, ...] = ()


def joint_fit(signals: Regressors) -> JointFit:
    """Fit both forms to the sliding rows of a log.

    Raises
    ------
    DataError
        One direction only, no low speeds, a motion too even to tell the parameters apart, or parameters
        of the wrong sign; each with the remedy.

    Notes
    -----
    Few slow rows are a warning as long as the condition number says that the parameters can be told apart:
    the standard errors then carry what the few rows leave open.
    """
    require_both_directions(signals.velocity_rad_s[signals.sliding], signals.source)
    v, a, s = signals.velocity_rad_s, signals.acceleration_rad_s2, signals.direction
    one = np.ones_like(v)
    ahead, back = 0.5 * (1 + s), 0.5 * (1 - s)
    symmetric = _solve(signals, {"inertia_kgm2": a, "viscous_nms_rad": v, "coulomb_nm": s, "offset_nm": one})
    per_direction = _solve(
        signals,
        {
            "inertia_kgm2": a,
            "viscous_forward_nms_rad": np.where(v > 0, v, 0.0),
            "viscous_backward_nms_rad": np.where(v < 0, v, 0.0),
            "level_forward_nm": ahead,
            "level_backward_nm": back,
        },
    )
    _require_signs(symmetric, signals.source)
    return JointFit(symmetric, per_direction, (*signals.warnings, *_few_slow(signals)))


def _few_slow(signals: Regressors) -> tuple[str, ...]:
    slow, below = signals.slow()
    if slow >= SAMPLES_MIN // 2:
        return ()
    return (
        f"{signals.source}: {slow} samples of slow motion only (below {below:.3g} rad/s): Coulomb and viscous "
        "friction are told apart by the faster motion; record slow motion too, or lower --speed-min-rad-s",
    )


def _require_signs(fit: Regression, source: str) -> None:
    inertia, coulomb = fit.parameters["inertia_kgm2"], fit.parameters["coulomb_nm"]
    if coulomb.high < 0:
        raise DataError(
            f"{source}: the torque assists the motion (Coulomb friction {coulomb.value:.3g} N m): "
            "turn its sign (scale -1), or that of the position"
        )
    if inertia.high < 0:
        raise DataError(
            f"{source}: the inertia comes out negative ({inertia.value:.3g} kg m^2): torque and position are "
            "not aligned in time, or a torque is missing; map the external torque too, or correct the time"
        )


def _solve(signals: Regressors, columns: dict[str, np.ndarray]) -> Regression:
    rows = signals.sliding
    matrix, torque = np.column_stack(list(columns.values()))[rows], signals.torque_nm[rows]
    scale = np.sqrt((matrix**2).mean(axis=0))
    scaled = matrix / np.where(scale > 0, scale, 1.0)
    singular = np.linalg.svd(scaled, compute_uv=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
    if not condition <= min(CONDITION_MAX, 1 / RANK_TOLERANCE):
        few = _few_slow(signals)
        if few:
            raise DataError(f"{few[0]}; and that is not enough here (condition number {condition:.3g})")
        raise DataError(
            f"{signals.source}: the motion is too even to tell {', '.join(columns)} apart (condition number "
            f"{condition:.3g}, at most {CONDITION_MAX:g}); record quick and slow motion with changing speed"
        )
    solution = np.linalg.lstsq(scaled, torque, rcond=None)[0]
    residual = torque - scaled @ solution
    covariance, blocks = _covariance(
        scaled, residual, signals.time_s[rows], signals.cutoff_hz, signals.source
    )
    return Regression(
        parameters=_estimates(columns, solution / scale, np.sqrt(np.diag(covariance)) / scale, blocks),
        condition=condition,
        relative_error=float(np.sqrt(np.mean(residual**2) / np.mean(torque**2))),
        rms_nm=float(np.sqrt(np.mean(residual**2))),
        n=len(torque),
        blocks=blocks,
    )


def _estimates(
    names: dict[str, np.ndarray], value: np.ndarray, error: np.ndarray, blocks: int
) -> dict[str, Estimate]:
    from scipy.stats import t

    half = float(t.ppf(0.975, blocks - 1)) * error
    return {
        name: Estimate(float(x), float(e), float(x - h), float(x + h))
        for name, x, e, h in zip(names, value, error, half, strict=True)
    }


def _covariance(
    X: np.ndarray, residual: np.ndarray, time_s: np.ndarray, cutoff_hz: float, source: str
) -> tuple[np.ndarray, int]:
    """Covariance of the solution and the number of blocks it rests on.

    Notes
    -----
    Residuals of a filtered log repeat each other, so the textbook formula is several times too narrow.
    The scores X'e are summed over G long blocks of time, which are independent of each other, and
    ``(X'X)^-1 (sum_g s_g s_g') (X'X)^-1 * G/(G-1)`` with a t distribution of G - 1 degrees of freedom
    gives the interval (Bester, Conley and Hansen, J. Econometrics 165, 2011).
    """
    longest = (time_s[-1] - time_s[0]) * cutoff_hz / BLOCK_PERIODS
    blocks = int(min(BLOCKS_MAX, longest))
    if blocks < BLOCKS_MIN:
        raise DataError(
            f"{source}: {time_s[-1] - time_s[0]:.3g} s are too short for intervals; "
            f"{BLOCKS_MIN * BLOCK_PERIODS / cutoff_hz:.3g} s are needed at a cut-off of {cutoff_hz:g} Hz"
        )
    part = np.array_split(np.arange(len(residual)), blocks)
    scores = np.array([X[rows].T @ residual[rows] for rows in part])
    bread = np.linalg.inv(X.T @ X)
    spread = scores.T @ scores * blocks / (blocks - 1)
    return bread @ spread @ bread, blocks
