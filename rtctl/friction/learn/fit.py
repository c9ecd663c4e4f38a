"""Learn a friction model: one spline-kernel epsilon-SVR of |v| per direction, then compile it.

`ladder` compares this with other machines, kernels and formulas; both end in `describe_branch`.

scikit-learn is imported when a fit runs, so that reading this module costs nothing."""

from __future__ import annotations

import platform
from datetime import UTC, datetime

import numpy as np

from hw.motion import own_size
from rtctl import __version__
from rtctl.errors import DataError, ModelError
from rtctl.friction.kind_compile import compile_curve
from rtctl.friction.kind_curve import Curve
from rtctl.friction.kind_spline import UNIT
from rtctl.friction.learn import bands, machines
from rtctl.friction.learn.grids import unit_of
from rtctl.friction.learn.hold_out import TRAINS, folds_by_speed, folds_of
from rtctl.friction.learn.machines import Candidate, FailedFitError
from rtctl.friction.model import Branch, FrictionModel, self_test_vectors
from rtctl.friction.points import FrictionPoints, level_starts, levels_of

EPSILON_NM = 0.005
"""Default half width of the epsilon tube, N m: about the noise of an averaged point of the shipped joint."""

EPSILON_SHARE = 0.02  # 5 mN m of a joint of 4 mN m erred by 13 % (decision 0091)
"""Share of the largest friction that the tube is where that is less than `EPSILON_NM`: a tube wider than the
friction of a small joint holds any curve."""

C_LIST = (10.0, 100.0, 1e3, 1e4)
"""C tried by cross-validation; steep Stribeck curves need the large ones."""

FADE_SHARE = 0.1
"""Default fade beyond the trained range, share of it."""

MAX_ITERATIONS = 5_000_000

TOLERANCE_NM = 1e-5
"""Solver tolerance."""


def candidate(c: float, epsilon_nm: float, unit_rad_s: float = 1.0) -> Candidate:
    """The machine of these models; `unit_rad_s` as of `grids.unit_of`."""
    return Candidate("epsilon", "spline", c, epsilon_nm, {} if unit_rad_s == 1.0 else {UNIT: unit_rad_s})


def train(
    speed: np.ndarray, friction_nm: np.ndarray, c: float, epsilon_nm: float, unit_rad_s: float = 1.0
) -> Curve:
    """Train the epsilon-SVR with the spline kernel on one direction, all points alike.

    Points that all lie within epsilon of a constant give that constant, without a support vector.

    Raises
    ------
    DataError
        When the regression does not converge."""
    try:
        trained = machines.train(
            candidate(c, epsilon_nm, unit_rad_s),
            speed,
            friction_nm,
            np.ones(len(speed)),
            max_iterations=MAX_ITERATIONS,
            tolerance_nm=TOLERANCE_NM,
        )
    except FailedFitError as error:
        raise DataError(f"the regression failed at C = {c:g}: {error}; choose a smaller C") from error
    if not trained.converged:
        raise DataError(
            f"the regression did not converge at C = {c:g}; choose a smaller C or a larger epsilon"
        )
    return trained.curve


def validation_errors(
    speed: np.ndarray,
    friction_nm: np.ndarray,
    c: float,
    epsilon_nm: float,
    fold: np.ndarray | None = None,
    unit_rad_s: float = 1.0,
) -> np.ndarray:
    """Errors (N m) on held-out points, by cross-validation in blocks: `fold`, or equal speed (`hold_out`)."""
    fold = folds_by_speed(speed) if fold is None else fold
    errors = []
    for k in np.unique(fold[fold != TRAINS]):
        held = fold == k
        curve = train(speed[~held], friction_nm[~held], c, epsilon_nm, unit_rad_s)
        errors.append(curve(speed[held]) - friction_nm[held])
    return np.concatenate(errors)


def viscous_slope(speed: np.ndarray, friction_nm: np.ndarray) -> float:
    """Viscous slope contained in the points, N m s/rad, not below 0.

    Notes
    -----
    Theil-Sen: the median of the slopes between all pairs of points with different speeds in the upper half
    of the range, where the Stribeck part has died out; an outlier cannot tilt it. With fewer than 4 such
    speeds it is between the 4 fastest, so that few speeds do not make damping, which is left to the device,
    look like dry friction, which is compensated. A falling curve has no viscous part: 0."""
    # four speeds at least: with fewer nothing was called viscous, and all of the friction dry (decision 0069)
    upper = speed >= min(0.5 * speed.max(), level_starts(speed)[-4:][0])
    v, f = speed[upper], friction_nm[upper]
    i, j = np.triu_indices(len(v), 1)
    level = levels_of(v)
    apart = level[j] != level[i]
    return max(0.0, float(np.median((f[j] - f[i])[apart] / (v[j] - v[i])[apart])))


def fit_branch(
    speed: np.ndarray,
    friction_nm: np.ndarray,
    *,
    c: float | None = None,
    epsilon_nm: float = EPSILON_NM,
    fold: np.ndarray | None = None,
    motion: str = "rotary",
) -> Branch:
    """Learn one direction.

    Parameters
    ----------
    speed, friction_nm : ndarray, shape (n,)
        |v| (rad/s, >= 0) and friction magnitude (N m).
    c : float, optional
        Bound on the dual coefficients. By default the one of `C_LIST` with the least held-out RMSE, the
        smaller one when two are within 2 %.
    fold : ndarray, shape (n,), optional
        Fold of each point; by default in blocks of equal speed.
    motion : str
        Of a "linear" axis the kernel counts speeds by the largest (`grids.unit_of`), and C is as of a force
        at a joint's handle.

    Raises
    ------
    DataError
        A regression that fails, or a curve that is not positive over the range."""
    unit, size = unit_of(motion, float(speed.max())), own_size("c_nm", 1.0, motion)
    tried = {
        value: validation_errors(speed, friction_nm, value, epsilon_nm, fold, unit)
        for value in ([size * one for one in C_LIST] if c is None else (c,))
    }
    rmse = {value: float(np.sqrt(np.mean(errors**2))) for value, errors in tried.items()}
    # C goes by tens: the smaller one is the smoother curve, with duals that cancel less
    chosen = min(value for value in tried if rmse[value] <= 1.02 * min(rmse.values()))
    return describe_branch(
        train(speed, friction_nm, chosen, epsilon_nm, unit),
        speed,
        friction_nm,
        tried[chosen],
        {"C": chosen, "epsilon_nm": epsilon_nm},
    )


def describe_branch(
    source: Curve,
    speed: np.ndarray,
    friction_nm: np.ndarray,
    held_out_errors: np.ndarray,
    hyper_parameters: dict[str, float],
) -> Branch:
    """Compile a learned curve and gather what the model file says about it.

    Parameters
    ----------
    source : Curve
    speed, friction_nm, held_out_errors
        Points of this direction, shape (n,); errors (N m) on points held out of training.

    Raises
    ------
    DataError
        A curve that is not positive over the range, or that cannot be compiled."""
    speed_max, viscous = float(speed.max()), viscous_slope(speed, friction_nm)
    try:
        curve, _ = compile_curve(source, speed_max)
    except ModelError as error:  # too many cells, or a proof that does not hold
        raise DataError(str(error)) from error
    places = curve.extreme_speeds(speed_max)
    if not (curve(places) > 0).all():
        at = f"{places[int(np.argmin(curve(places)))]:.4g} rad/s"
        raise DataError(f"the learned friction is not positive at {at}; add points there or lower C")
    dry = curve.extreme_speeds(speed_max, viscous)  # the dry part turns elsewhere
    residual = np.abs(curve(speed) - friction_nm)
    return Branch(
        support_vectors=source.support_vectors,
        dual_coef=source.dual_coef,
        intercept=source.intercept,
        curve=curve,
        speed_max_rad_s=speed_max,
        n_points=len(speed),
        train_mean_error_nm=float(residual.mean()),
        train_rmse_nm=float(np.sqrt(np.mean(residual**2))),
        train_max_error_nm=float(residual.max()),
        validation_rmse_nm=float(np.sqrt(np.mean(held_out_errors**2))),
        validation_max_error_nm=float(np.abs(held_out_errors).max()),
        friction_min_nm=float((curve(dry) - viscous * dry).min()),
        friction_max_nm=float(curve(places).max()),
        viscous_nms_rad=viscous,
        hyper_parameters=hyper_parameters,
        kind=source.kind,
        parameters=dict(source.parameters),
        parts=source.parts,
    )


def fit_points(
    points: FrictionPoints,
    *,
    rig: str,
    c: float | None = None,
    epsilon_nm: float | None = None,
    fade_rad_s: float | None = None,
    folds: str = "speed",
) -> FrictionModel:
    """Learn the friction model of one axis from measured points, one regression per direction.

    Parameters
    ----------
    rig : str
        Name of the rig the points were measured on; the model is refused on any other.
    epsilon_nm : float, optional
        Half width of the tube, N m; default `EPSILON_NM`, of weaker friction `EPSILON_SHARE` of the largest.
    fade_rad_s : float, optional
        The feed-forward fades to 0 over this much beyond the trained range; default a tenth of it.
    folds : str
        What is held out together, of `hold_out.WAYS`.

    Raises
    ------
    DataError
        Naming the file, the direction, what went wrong and the remedy."""
    if epsilon_nm is None:
        epsilon_nm = min(EPSILON_NM, EPSILON_SHARE * float(points.friction_nm.max()))
    branches = []
    for direction in (1, -1):
        try:
            fold = folds_of(points, (direction,), folds)
            branches.append(
                fit_branch(
                    *points.branch(direction), c=c, epsilon_nm=epsilon_nm, fold=fold, motion=points.motion
                )
            )
        except DataError as error:
            raise DataError(f"{points.source}: direction {direction:+d}: {error}") from error
    chosen = [
        candidate(one.hyper_parameters["C"], epsilon_nm, one.parameters.get(UNIT, 1.0)) for one in branches
    ]
    # 1: as `train` weighs them
    band = bands.band_of(points, list(zip(chosen, (1, -1), strict=True)), folds, break_away_weight=1.0)
    both = bands.with_band((branches[0], branches[1]), band)
    return assemble(points, both, rig=rig, fade_rad_s=fade_rad_s)


def assemble(
    points: FrictionPoints,
    branches: tuple[Branch, Branch],
    *,
    rig: str,
    fade_rad_s: float | None = None,
    selection: str = "",
) -> FrictionModel:
    """Make a model of two branches: provenance, fade and self-test vectors."""
    import sklearn

    forward, backward = branches
    return FrictionModel(
        rig=rig,
        kind=forward.kind,
        motion=points.motion,
        branches=branches,
        speed_fade_rad_s=fade_rad_s or FADE_SHARE * max(forward.speed_max_rad_s, backward.speed_max_rad_s),
        data_sha256=points.sha256,
        created=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        versions={
            "python": platform.python_version(),
            "rtctl": __version__,
            "numpy": np.__version__,
            "scikit-learn": sklearn.__version__,
        },
        self_test=self_test_vectors(branches),
        selection=selection,
    )


def compile_error_nm(branch: Branch) -> float:
    """Largest difference of compiled and learned curve over the trained range, N m."""
    speed = np.linspace(0, branch.speed_max_rad_s, 4001)  # to look at; proofs have a bound
    return float(np.max(np.abs(branch.curve(speed) - branch.kernel_sum(speed))))
