"""What was measured or learned, against the friction law of the simulated rig, which the rig file states.

For the mock alone: no real rig's true friction is known. Nothing that measures or learns imports this."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from hw.simulators.mock_bristles import modulation, static_friction, waves
from hw.simulators.mock_load import load_levels
from hw.simulators.mock_records import plant_records
from rtctl.friction.model import FrictionModel
from rtctl.rig_file.config import LoadedConfig

_GRID = 2000
_PLACES = 2001
SPEED_MIN_RAD_S = 0.005
"""Slowest speed at which a learned curve is judged: below it no run measures."""
DRY_SHARE = 0.01
"""Dry friction below this share of all of it is no measure of an error."""
# each round adds what load makes of the one before: with a share of a tenth ten rounds do
_LOAD_STEPS, _LOAD_PRECISION = 100, 1e-10
SPEED_RANGE = 400.0
"""Largest over slowest speed of the curve of a linear axis, for the same reason."""


@dataclass(frozen=True)
class Deviation:
    """Measured or learned minus true friction of one direction, magnitudes.

    `rms_share` and `worst_share` are shares of `dry_nm` over `speeds` moving points, or over the learned
    range; `break_away_share` is that of the break-away point, None without one. `dry_nm` is the rig's Coulomb
    friction F_c, or where that is no half of it its break-away F_s, or of a joint with hardly any dry
    friction (`DRY_SHARE`) the RMS of all its friction there."""

    direction: int
    dry_nm: float
    dry_name: str
    speeds: int
    rms_nm: float
    rms_share: float
    worst_share: float
    break_away_share: float | None

    def __str__(self) -> str:
        away = "" if self.break_away_share is None else f", break-away {100 * self.break_away_share:+.2f} %"
        return (
            f"direction {self.direction:+d}: RMS {100 * self.rms_share:.2f} % of {self.dry_name} = "
            f"{self.dry_nm:g} N m, largest {100 * self.worst_share:.2f} %{away}"
        )


def is_known(loaded: LoadedConfig) -> bool:
    """True when the rig file's device is the mock, whose friction law is stated there."""
    return loaded.config.device[0].kind == "mock"


def true_friction_nm(loaded: LoadedConfig, axis: int, velocity_rad_s: np.ndarray) -> np.ndarray:
    """True static friction of an axis of the mock at signed velocities, magnitude, nobody's hand on it and
    without drift, N m.

    The mean over a turn, or over the travel of a joint that cannot make one: what is measured at even places.
    Friction that grows with the motor's torque is that of the torque which moves the joint, friction itself.
    """
    params = plant_records(loaded.options, loaded.config.hardware())[0]
    dry, ripple_nm = _means_over_travel(loaded, axis, params[0])
    params["modulation_share"], params["friction_wave_count"] = 0.0, 0  # their mean is in the factor already
    for name in ("coulomb_nm", "breakaway_nm"):
        params[name][0, axis] *= dry
    return np.array(
        [_moved_by_motor_nm(float(v), params, axis) - np.copysign(ripple_nm, v) for v in velocity_rad_s]
    )


def _moved_by_motor_nm(velocity_rad_s: float, params: np.ndarray, axis: int) -> float:
    """Friction F = F(v, motor torque F) of steady sliding, N m, by iteration: load adds a small part of what
    loads."""
    # only the levels change: shape and speeds of the curve are the joint's own
    loaded = params.copy()
    friction = -1.0  # no friction is this: the first round never ends it
    for _ in range(_LOAD_STEPS):
        before, friction = friction, abs(static_friction(velocity_rad_s, 0.0, loaded[0], axis))
        if abs(friction - before) <= _LOAD_PRECISION * friction:
            break
        more, more_peak = load_levels(friction, 0.0, params[0], axis)
        loaded["coulomb_nm"][0, axis] = params["coulomb_nm"][0, axis] + more
        loaded["breakaway_nm"][0, axis] = params["breakaway_nm"][0, axis] + more + more_peak
    return friction


def _means_over_travel(loaded: LoadedConfig, axis: int, params: np.record) -> tuple[float, float]:
    """Mean factor of the dry friction over position, and mean torque ripple, N m; 1 and 0 over a whole
    turn."""
    table = loaded.config.axis[axis]
    # over whole turns every wave has a mean of nothing
    if table.position_max_rad - table.position_min_rad >= 2 * np.pi:
        return 1.0, 0.0
    places = np.linspace(table.position_min_rad, table.position_max_rad, _PLACES)
    factors = [modulation(float(x), params, axis) for x in places]
    table_of_waves, count = params["ripple_wave"][axis], int(params["ripple_wave_count"][axis])
    ripple = [waves(float(x), table_of_waves, count) for x in places]
    ripple += params["ripple_nm"][axis] * np.sin(params["ripple_per_rad"][axis] * places)
    return float(np.mean(factors)), float(np.mean(ripple))


def of_points(
    loaded: LoadedConfig, axis: int, points: Iterable[tuple[float, float, int]]
) -> tuple[Deviation, ...]:
    """Deviation of measured points, one per direction that has a moving point.

    Parameters
    ----------
    points
        (velocity rad/s, friction torque N m, both signed; direction +1 or -1) of each."""
    # reshaped: without a point it would have no columns
    table = np.array(list(points), dtype=float).reshape(-1, 3)
    found = []
    for direction in (1, -1):
        velocity, torque, _ = table[table[:, 2] == direction].T
        still = velocity == 0
        # a break-away alone is no curve: nothing is said of this direction
        if still.all():
            continue
        # break-away has a direction, and no speed
        true_nm = true_friction_nm(loaded, axis, np.where(still, direction * 1e-12, velocity))
        error = np.abs(torque) - true_nm  # magnitudes, as the law of the plant gives them
        found.append(_deviation(loaded, axis, direction, error[~still], error[still], true_nm[~still]))
    return tuple(found)


def of_model(loaded: LoadedConfig, axis: int, model: FrictionModel) -> tuple[Deviation, ...]:
    """Deviation of a learned model over its trained range above `SPEED_MIN_RAD_S`, one per direction."""
    found = []
    for direction, branch in zip((1, -1), model.branches, strict=True):
        top = branch.speed_max_rad_s
        # of a carriage no speed is slow by itself: as far below its top as .005 rad/s is below 2
        slowest = top / SPEED_RANGE if model.motion == "linear" else SPEED_MIN_RAD_S
        velocity = direction * np.linspace(slowest, top, _GRID)
        true_nm = true_friction_nm(loaded, axis, velocity)
        error = model.magnitude(velocity) - true_nm
        found.append(_deviation(loaded, axis, direction, error, np.zeros(0), true_nm))
    return tuple(found)


def _deviation(
    loaded: LoadedConfig,
    axis: int,
    direction: int,
    moving_nm: np.ndarray,
    still_nm: np.ndarray,
    true_nm: np.ndarray,
) -> Deviation:
    params = plant_records(loaded.options, loaded.config.hardware())[0]
    coulomb, breakaway = (float(params[name][0, axis]) for name in ("coulomb_nm", "breakaway_nm"))
    dry, name = (coulomb, "F_c") if 2 * coulomb >= breakaway else (breakaway, "F_s")
    # over the moving points alone
    whole = float(np.sqrt(np.mean(true_nm**2)))
    # else a joint that hardly rubs dry would be off by any share of next to nothing
    if dry < DRY_SHARE * whole:
        dry, name = whole, "the friction's RMS"
    rms = float(np.sqrt(np.mean(moving_nm**2)))
    return Deviation(
        direction=direction,
        dry_nm=dry,
        dry_name=name,
        speeds=len(moving_nm),
        rms_nm=rms,
        rms_share=rms / dry,
        worst_share=float(np.abs(moving_nm).max()) / dry,
        break_away_share=float(still_nm.mean()) / dry if len(still_nm) else None,
    )
