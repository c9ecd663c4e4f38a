"""The classical friction formulas, fitted by bounded least squares, one direction at a time.

F_c, F_s, b >= 0; F_s below F_c is allowed (a friction that rises with speed before it levels out).
docs/theory.md 8.1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.errors import UnidentifiableError
from rtctl.friction.kind import Formula
from rtctl.friction.kind_curve import Curve
from rtctl.friction.kind_table import FORMULAS
from rtctl.friction.points import level_starts

# geared joints have .02 to .2 rad/s; a grid over the measured range alone may have none of these
STRIBECK_STARTS_RAD_S = (0.05, 0.1, 0.2)
"""Stribeck speeds first tried; a grid over the measured range follows."""

# neighbours are then 1.4 apart for speeds of 1 to 400, nearer than a peak is wide
_STARTS = 25
_BELOW_MIN = 2
"""Fewest different speeds at or below v_s without which a peak is a guess."""

_P_VALUE = 0.001
"""A peak must be this unlikely to come by chance. Strict, because v_s is searched: some bump is always
found."""

_BEYOND = "stribeck_speed_beyond_range"


@dataclass(frozen=True)
class FormulaFit:
    """A fitted formula.

    `covariance` follows the order of `curve.parameters`, squared units; it is infinite where the points
    cannot separate them. A straight formula's parameter on its bound (0) has zero there; with a peak the
    search ends a hair above its bounds, and all count as free: errors are then too large, not too small.
    `standard_error` is the root of its diagonal. `peak_p_value` is the chance of points as peaked as these if
    friction were Coulomb + viscous."""

    curve: Curve
    covariance: np.ndarray
    rmse_nm: float
    peak_p_value: float

    @property
    def standard_error(self) -> dict[str, float]:
        """Standard error of each parameter, in its unit."""
        return dict(zip(self.curve.parameters, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def peak_nm(self) -> tuple[float, float]:
        """Stribeck peak F_s - F_c and its standard error, N m."""
        p, c = self.curve.parameters, self.covariance
        # of the difference: F_c and F_s lean on the same points, and each by itself may be known far worse
        # than what parts them
        variance = c[0, 0] + c[2, 2] - 2 * c[0, 2] if np.isfinite(c).all() else np.inf
        return p["breakaway_nm"] - p["coulomb_nm"], float(np.sqrt(variance))


def fit_formula(
    kind: str, speed: np.ndarray, friction_nm: np.ndarray, weight: np.ndarray | None = None
) -> FormulaFit:
    """Fit a formula to one direction by bounded least squares, whether or not the data can tell all of it.

    Parameters
    ----------
    kind : str
        One of `FORMULAS`.
    speed, friction_nm : ndarray, shape (n,)
        |v| (rad/s, >= 0) and friction magnitude (N m).
    weight : ndarray, shape (n,), optional
        Counts of each point in the sum of squares.

    Raises
    ------
    UnidentifiableError
        Reason "too_few_points": not more points than parameters.

    Notes
    -----
    For a given v_s the formulas are linear, so v_s alone is searched on a grid with the other parameters at
    their bounded optimum; the best three are starts of the bounded refinement in all parameters.
    Covariance s^2 (J'WJ)^-1 over the parameters that are not on a bound."""
    formula = FORMULAS[kind]
    n = len(formula.names)
    # as many points as numbers leave nothing to tell an error from
    if len(speed) <= n:
        raise UnidentifiableError(
            "too_few_points", f"{kind}: {len(speed)} points for {n} parameters; add points"
        )
    # the root: squares of the rows then weigh by the weight
    root = np.ones(len(speed)) if weight is None else np.sqrt(np.asarray(weight, dtype=float))
    if formula.is_straight:
        design = _linear_design(formula, speed)
        values = _bounded(design * root[:, None], friction_nm * root)
        jacobian = design
    else:
        values = _fit_stribeck(formula, speed, friction_nm, root)
        jacobian = _jacobian(formula, values, speed)
    curve = Curve.formula(kind, dict(zip(formula.names, values.tolist(), strict=True)))
    residual = curve(speed) - friction_nm
    variance = float(np.sum((root * residual) ** 2)) / (len(speed) - n)
    covariance = _covariance(jacobian * root[:, None], values, variance)
    rmse = float(np.sqrt(np.mean(residual**2)))
    return FormulaFit(curve, covariance, rmse, _peak_p_value(n, speed, friction_nm, root, variance))


def _peak_p_value(
    n: int, speed: np.ndarray, friction_nm: np.ndarray, root: np.ndarray, variance: float
) -> float:
    """F-test of the two parameters of the peak against Coulomb + viscous; NaN for formulas without."""
    if n <= 2:
        return float("nan")
    from scipy.special import fdtrc

    straight = _linear_design(FORMULAS["coulomb_viscous"], speed) * root[:, None]
    without = float(np.sum((straight @ _bounded(straight, friction_nm * root) - friction_nm * root) ** 2))
    left = len(speed) - n
    # two numbers more: the peak and where it falls
    gain = max(0.0, without - left * variance) / 2
    # else the points are exact
    return float(fdtrc(2, left, gain / variance)) if variance > 0 else float(gain == 0)


def require_identifiable(fit: FormulaFit, speed: np.ndarray) -> None:
    """Refuse a fit whose Stribeck peak the points cannot tell.

    Raises
    ------
    UnidentifiableError
        Reasons "no_points_below_stribeck_speed", "stribeck_speed_beyond_range", "singular",
        "peak_within_its_error", "stribeck_speed_within_its_error"."""
    p = fit.curve.parameters
    if "stribeck_rad_s" not in p:
        return
    v_s = p["stribeck_rad_s"]
    error = fit.standard_error["stribeck_rad_s"]
    peak, peak_error = fit.peak_nm
    below = int(np.sum(level_starts(speed) <= v_s))
    for reason, holds, text in (
        (
            "no_points_below_stribeck_speed",
            below < _BELOW_MIN,
            f"only {below} speeds at or below v_s = {v_s:.3g} rad/s: measure slower",
        ),
        (
            _BEYOND,
            is_bend(fit, speed),
            f"v_s = {v_s:.3g} rad/s is not well below the fastest point ({speed.max():.3g} rad/s): measure "
            "faster",
        ),
        ("singular", not np.isfinite([peak_error, error]).all(), "the points cannot separate the parameters"),
        (
            "peak_within_its_error",
            not (2 * peak_error < abs(peak) and fit.peak_p_value < _P_VALUE),
            f"the Stribeck peak {peak:.3g} +- {peak_error:.2g} N m cannot be told from none "
            f"(p = {fit.peak_p_value:.2g}); use coulomb_viscous",
        ),
        (
            "stribeck_speed_within_its_error",
            not error < v_s,
            f"v_s = {v_s:.3g} rad/s is within its standard error {error:.3g}: measure more slow speeds",
        ),
    ):
        if holds:
            raise UnidentifiableError(reason, f"{fit.curve.kind}: {text}")


def require_told(fit: FormulaFit, speed: np.ndarray) -> None:
    """Refuse a fit as a curve, whatever its numbers mean.

    A v_s beyond half of the range is no peak, and says nothing of a joint; but the curve then bends over all
    speeds, where held-out points judge it as any other. A peak below the slowest speeds they cannot judge.

    Raises
    ------
    UnidentifiableError
        Any reason of `require_identifiable` but a v_s beyond the range of a fit that a straight line is told
        from."""
    try:
        require_identifiable(fit, speed)
    except UnidentifiableError as error:
        if error.reason != _BEYOND or not fit.peak_p_value < _P_VALUE:
            raise


def says_little_of_rest(fit: FormulaFit, speed: np.ndarray) -> bool:
    """Whether v_s is not below the slowest motion that was measured: what the curve rises by towards rest is
    then at most 1.8 times the peak seen at that speed, whether or not its numbers are told."""
    moving = speed[speed > 0]
    return fit.curve.parameters.get("stribeck_rad_s", np.inf) >= float(moving.min(initial=np.inf))


def is_bend(fit: FormulaFit, speed: np.ndarray) -> bool:
    """Whether v_s is beyond half of the range: the formula follows the points, but its numbers are no
    Stribeck peak."""
    return fit.curve.parameters.get("stribeck_rad_s", 0.0) > 0.5 * float(np.max(speed))


def _linear_design(formula: Formula, speed: np.ndarray, v_s: float = 1.0) -> np.ndarray:
    """Columns of F_c, b and F_s at a given v_s."""
    if formula.is_straight:
        return np.column_stack([np.ones(len(speed)), speed])[:, : len(formula.names)]
    shape = formula.shape(speed / v_s)
    return np.column_stack([1 - shape, speed, shape])  # of F_s itself, not of F_s - F_c: its bound is then 0


def _bounded(design: np.ndarray, target: np.ndarray) -> np.ndarray:
    from scipy.optimize import nnls

    values: np.ndarray = nnls(design, target)[0]
    return values


def _fit_stribeck(
    formula: Formula, speed: np.ndarray, friction_nm: np.ndarray, root: np.ndarray
) -> np.ndarray:
    from scipy.optimize import least_squares

    top = float(speed.max())
    slowest = float(np.min(speed[speed > 0], initial=top))
    tried = []
    # a peak may lie below the slowest point or bend over all: both are refused later, and by their numbers
    # beyond the range on both sides: a v_s that ends there is how a peak shows that it is not in the points
    for v_s in (*STRIBECK_STARTS_RAD_S, *np.geomspace(0.3 * slowest, 3 * top, _STARTS)):
        design = _linear_design(formula, speed, float(v_s)) * root[:, None]
        values = _bounded(design, friction_nm * root)
        tried.append((float(np.sum((design @ values - friction_nm * root) ** 2)), *values, float(v_s)))

    def residual(values: np.ndarray) -> np.ndarray:
        design = _linear_design(formula, speed, float(values[3]))
        out: np.ndarray = root * (design @ values[:3] - friction_nm)
        return out

    def slope(values: np.ndarray) -> np.ndarray:
        out: np.ndarray = root[:, None] * _jacobian(formula, values, speed)
        return out

    # beyond both bounds v_s does nothing to any point: the search would walk for ever. A peak that falls
    # below the slowest speed may say anything of rest, unless rest was measured (decision 0145)
    least = (0.1 if speed.min() == 0 else 1.0) * slowest
    lower, upper = np.array([0, 0, 0, least]), np.array([np.inf, np.inf, np.inf, 10 * top])
    best = [
        least_squares(
            residual,
            np.clip(start[1:], lower, upper),  # a joint of .02 rad/s has no room for the usual starts
            jac=slope,
            bounds=(lower, upper),
            x_scale="jac",
            ftol=1e-10,
        )
        # v_s has several valleys: the grid may favour the wrong one by a hair
        for start in sorted(tried)[:3]
    ]
    found: np.ndarray = min(best, key=lambda result: float(result.cost)).x
    return found


def _jacobian(formula: Formula, values: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Derivatives of F by F_c, b, F_s, v_s."""
    coulomb, _, breakaway, v_s = values
    y = speed / v_s
    by_v_s = (breakaway - coulomb) * formula.shape(y, 1) * (-y / v_s)
    return np.column_stack([_linear_design(formula, speed, v_s), by_v_s])


def _covariance(jacobian: np.ndarray, values: np.ndarray, variance: float) -> np.ndarray:
    # on its bound a number has no slope to both sides, and no standard error that means one
    free = values > 0
    covariance = np.zeros((len(values), len(values)))
    normal = jacobian[:, free].T @ jacobian[:, free]
    scale = np.sqrt(np.diag(normal))  # the columns' units differ: unscaled, the condition would be theirs
    if not (scale > 0).all() or np.linalg.cond(normal / np.outer(scale, scale)) > 1e12:
        return np.full_like(covariance, np.inf)
    covariance[np.ix_(free, free)] = (
        variance * np.linalg.inv(normal / np.outer(scale, scale)) / np.outer(scale, scale)
    )
    return covariance
