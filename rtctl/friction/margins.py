"""What a friction model and its feed-forward leave of one axis' passivity: curves in, figures out.

Friction is taken at its lower bound, never below 0: the model minus what `friction.guarantee` says it may be
off by (its largest known error, its spread over places, `drift_nm`). Beyond the trained range it is taken to
rise from there with the rig file's `viscous_nms_rad` only, while the feed-forward fades out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rtctl.control import compensation_limit as limits
from rtctl.control.proofs import friction_passivity as friction
from rtctl.control.proofs import stability
from rtctl.control.vocabulary import Policy
from rtctl.friction.guarantee import guarantee
from rtctl.friction.model import FrictionModel
from rtctl.friction.roll_off import rolled_off
from rtctl.rig_file.axis_tables import AxisTable

_GRID = 4000


@dataclass(frozen=True)
class FrictionFigures:
    """What the friction model and its feed-forward do to one axis. Torques in N m, dampings in N m s/rad."""

    model: str
    error_max_nm: float
    speed_max_rad_s: float
    secant_damping_nms_rad: float
    secant_speed_rad_s: float
    beyond_damping_nms_rad: float | None
    slope_damping_nms_rad: float
    gain_max: float
    friction_floor_nm: float
    feedforward_max_nm: float
    two_line_margin_nm: float
    two_line_capped_margin_nm: float
    dry_left_nm: float
    """Least friction on the motor's side less most feed-forward at the same speed, N m, not below 0."""
    helped_share: float
    """Most feed-forward over the least friction at the same speed, as if it were never more than that."""
    drag_nms_rad: float
    """Least of all the friction over speed, N m s/rad, its largest known error added."""
    drag_speed_rad_s: float
    presliding_rad: float
    """Length that a feed-forward by displacement takes to turn."""
    place_stiffness_nm_rad: float = 0.0
    """How steeply the feed-forward may change over position, N m/rad; 0 where it does not go by place."""
    place_waves_per_rad: tuple[float, float] = (0.0, 0.0)
    """Most waves of a rad that friction has over place, and the conservative part."""
    conservative_most_nm: float = 0.0
    """Most of the conservative part that is compensated, N m."""
    conservative_swing_j: float = 0.0
    """Most energy that it gives from one place to another and takes back, J."""
    load_share: float = 0.0
    """Torque that the compensation of load adds for each N m through the gear; 0 where it does not go by
    load."""
    load_loop: float = 0.0
    """The motor's part of it: of the coupling's own torque."""
    load_most_nm: float = 0.0
    """Most that load adds to the friction at torques up to the limit, N m, where the law goes by it."""
    factor_max: float = 1.0
    """Largest factor of the learned friction that the feed-forward may go by: all of these are of that
    one."""


@dataclass(frozen=True)
class _Curves:
    """One direction over a grid of speeds: model, lower bound of friction, most feed-forward.

    `ff` is of the configured policy; `ff_capped` the same capped below the least dry friction."""

    v: np.ndarray
    F_hat: np.ndarray
    F_lo: np.ndarray
    ff: np.ndarray
    ff_capped: np.ndarray


def _at_places(model: FrictionModel, branch: int, axis: AxisTable, v: np.ndarray) -> list[_Curves]:
    """Sample the curves of one direction, with the feed-forward as the compiled law limits it.

    Of a model that the law goes by place with: at the weakest and at the strongest place, both its friction
    and its feed-forward; of one that it goes by load with: without load and with most, likewise."""
    part = model.branches[branch]
    tables = part.place_tables(model.place) if _by_place(model, axis) else None
    # curve of speed alone: one weakest case, or two where load adds friction
    if tables is None:
        curves = [_curves(model, branch, axis, v)]
        if most_load_nm(model, axis) > 0:
            curves.append(_curves(model, branch, axis, v, load_nm=most_load_nm(model, axis)))
        return curves
    doubt_nm = float(model.error_max_nm.max()) + axis.friction.drift_nm
    # held at the end of the range: beyond it the tables were taught nothing
    turn = tables.over_turn(np.minimum(v, part.speed_max_rad_s))
    return [
        _curves(model, branch, axis, v, part.magnitude(v) + place, doubt_nm, load_nm)
        for place in (turn.min(axis=1), turn.max(axis=1))
        for load_nm in sorted({0.0, most_load_nm(model, axis)})
    ]


def _curves(
    model: FrictionModel,
    branch: int,
    axis: AxisTable,
    v: np.ndarray,
    F_hat: np.ndarray | None = None,
    doubt_nm: float | None = None,
    load_nm: float = 0.0,
) -> _Curves:
    """The curves where friction is `F_hat` by the model, and less by `doubt_nm` at most; by default as the
    curve of speed has it.

    `load_nm` is what load adds, by the model; to the lower bound as far as it surely does."""
    part, table = model.branches[branch], axis.friction
    end = part.speed_max_rad_s
    F_hat = part.magnitude(v) if F_hat is None else F_hat
    doubt_nm = guarantee(axis, model).doubt_nm if doubt_nm is None else doubt_nm
    # beyond what was taught only the damping of the rig file is believed
    past = np.maximum(v - end, 0.0)
    sure = 0.0 if model.load is None else model.load.sure_share
    F_lo = np.maximum(F_hat + sure * load_nm - doubt_nm, 0.0) + axis.viscous_nms_rad * past
    fade = np.clip(1 - past / model.speed_fade_rad_s, 0.0, 1.0)
    within = np.minimum(v, end)
    cap = 0.0 if table.policy == "off" else table.cap_share * axis.torque_limit_nm
    least = float(model.friction_min_nm.min()) - model.place_trough_nm
    ungated = limits.ungated_cap(table.gain, least)
    # a gate is opened by a hand, so that a gated help may be more than the least friction
    gated = limits.is_force_gated(Policy[table.policy.upper()])
    viscous = part.viscous_nms_rad * within
    ff, capped = (
        limits.feedforward_limit(
            F_hat,
            viscous,
            table.gain,
            table.viscous_gain,
            fade,
            limits.cap_in_force(free, cap, ungated),
            table.load_gain * load_nm,
        )
        for free in (gated, False)
    )
    return _Curves(v, F_hat + load_nm, F_lo, ff, capped)


def _grid(model: FrictionModel, branch: int, start: float, end: float) -> np.ndarray:
    """Speeds from start to end: even, dense near 0, and every knot of the model."""
    knots = model.branches[branch].curve.knots
    inside = knots[(knots > start) & (knots < end)]
    # torque over speed is steepest near 0, where an even grid has few speeds to a ratio
    fine = end * np.geomspace(1e-4, 1, _GRID // 4)
    grid = np.concatenate([np.linspace(start, end, _GRID), fine[(fine > start) & (fine < end)], inside])
    return np.unique(grid)


def friction_figures(
    model: FrictionModel,
    path: Path,
    axis: AxisTable,
    T: float,
    count: float,
    between: stability.Between | None = None,
    dry_share: float = 1.0,
    taken_nms_rad: float = 0.0,
) -> FrictionFigures:
    """Figures of one axis, the worse of its two directions.

    `T` is the control period, s, `count` one encoder count, rad; `path` is only named in the result.
    `between` is what lies between law and joint; without it the delay of the rig file.
    `dry_share` is the motor's of the dry friction, which all the help is taken off, `taken_nms_rad`
    the viscous damping that a hand behind an elastic joint can cancel (docs/theory.md 2.8)."""
    k_c, b_c = axis.coupling.stiffness_nm_rad, axis.coupling.damping_nms_rad
    between = stability.Between(axis.coupling.delay_ticks) if between is None else between
    model = rolled_off(model, axis, T, between, taken_nms_rad)
    spring = place_stiffness_nm_rad(model, axis)
    loop = _load_loop(model, axis)
    k_c, b_c = (1 + loop) * k_c + spring, (1 + loop) * b_c  # as late (docs/theory.md 8.10)
    need = stability.damping_needed_between(k_c, b_c, T, between)
    trained, beyond, lines, capped, drags = [], [], [], [], []
    coupling = {"k_c": k_c, "b_c": b_c, "T": T, "Delta": count}
    for branch, part in enumerate(model.branches):
        end = min(part.speed_max_rad_s, axis.velocity_limit_rad_s)
        if axis.velocity_limit_rad_s > end:
            outside = _grid(model, branch, end, axis.velocity_limit_rad_s)
            beyond += [
                friction.secant_damping(c.v, c.F_lo, c.ff)[0]
                for c in _at_places(model, branch, axis, outside)
            ]
        for c in _at_places(model, branch, axis, _grid(model, branch, 0.0, end)):
            trained.append(c)
            lines.append(friction.two_line_margin(c.v, c.F_lo, c.ff, **coupling).margin_nm)
            capped.append(friction.two_line_margin(c.v, c.F_lo, c.ff_capped, **coupling).margin_nm)
            drags.append(_drag(c, part.error_max_nm))
    secant, at = min(friction.secant_damping(c.v, c.F_lo, c.ff) for c in trained)
    return FrictionFigures(
        model=str(path),
        error_max_nm=float(model.error_max_nm.max()),
        speed_max_rad_s=min(part.speed_max_rad_s for part in model.branches),
        secant_damping_nms_rad=secant,
        secant_speed_rad_s=at,
        beyond_damping_nms_rad=min(beyond) if beyond else None,
        slope_damping_nms_rad=min(friction.slope_damping(c.v, c.F_hat, c.ff) for c in trained),
        gain_max=min(friction.gain_max(c.v, c.F_lo, c.F_hat, need + taken_nms_rad) for c in trained),
        friction_floor_nm=min(float(c.F_lo.min()) for c in trained),
        feedforward_max_nm=max(float(c.ff.max()) for c in trained),
        two_line_margin_nm=min(lines),
        two_line_capped_margin_nm=min(capped),
        dry_left_nm=max(0.0, min(float((dry_share * c.F_lo - c.ff).min()) for c in trained)),
        helped_share=max(float(np.max(c.ff / np.maximum(c.F_lo, np.maximum(c.ff, 1e-12)))) for c in trained),
        drag_nms_rad=min(drags)[0],
        drag_speed_rad_s=min(drags)[1],
        presliding_rad=axis.friction.stop_rad
        or guarantee(axis, model).turn_rad(Policy[axis.friction.policy.upper()]),
        place_stiffness_nm_rad=spring,
        place_waves_per_rad=model.place_waves_per_rad if model.has_place else (0.0, 0.0),
        conservative_most_nm=conservative_most_nm(model, axis),
        conservative_swing_j=conservative_swing_j(model, axis),
        load_share=_load_share(model, axis),
        load_loop=loop,
        load_most_nm=most_load_nm(model, axis),
    )


def _by_load(model: FrictionModel, axis: AxisTable) -> bool:
    policy = axis.friction.policy
    return model.load is not None and axis.friction.load_gain > 0 and policy not in ("off", "observer")


def most_load_nm(model: FrictionModel, axis: AxisTable) -> float:
    """Most that load adds to the friction at torques up to the axis' limit, N m; 0 where the law does not go
    by load."""
    if model.load is None or not _by_load(model, axis):
        return 0.0
    return model.load.most_added_nm(axis.torque_limit_nm)


def _load_share(model: FrictionModel, axis: AxisTable) -> float:
    """Torque that the compensation adds for each N m that goes through the gear."""
    if model.load is None or not _by_load(model, axis):
        return 0.0
    return axis.friction.load_gain * model.load.share(axis.torque_limit_nm)


def _load_loop(model: FrictionModel, axis: AxisTable) -> float:
    """The motor's part of it: by so much more the coupling acts, in samples as late (docs/theory.md 8.10)."""
    if model.load is None or not _by_load(model, axis):
        return 0.0
    return axis.friction.load_gain * model.load.motor_share(axis.torque_limit_nm)


def _by_place(model: FrictionModel, axis: AxisTable) -> bool:
    return (
        model.has_place and axis.friction.place != "off" and axis.friction.policy not in ("off", "observer")
    )


def conservative_most_nm(model: FrictionModel, axis: AxisTable) -> float:
    """Most torque against the conservative part, N m."""
    if model.conservative is None or not _by_place(model, axis):
        return 0.0
    return axis.friction.gain * model.conservative.most_nm


def conservative_swing_j(model: FrictionModel, axis: AxisTable) -> float:
    """Most energy that the compensated conservative part gives from one place to another, J."""
    if model.conservative is None or not _by_place(model, axis):
        return 0.0
    return axis.friction.gain * model.conservative.swing_j


def place_stiffness_nm_rad(model: FrictionModel, axis: AxisTable) -> float:
    """Most slope over position of what is compensated, N m/rad: of a spring, and of friction that changes
    from place to place."""
    if not _by_place(model, axis):
        return 0.0
    # added, as both may be steepest at one place: what acts there is their sum
    spring = 0.0 if model.conservative is None else model.conservative.steepest_nm_rad
    return axis.friction.gain * (spring + model.place_steepest_nm_rad)


def _drag(c: _Curves, error_nm: float) -> tuple[float, float]:
    """Least friction over speed, N m s/rad, with the model's error on its side, and the speed where it is
    least."""
    # friction at rest over no speed is no damping
    moving = c.v > 0
    drag = (c.F_hat[moving] + error_nm) / c.v[moving]
    at = int(np.argmin(drag))
    return float(drag[at]), float(c.v[moving][at])
