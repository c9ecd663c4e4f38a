"""Closed forms of friction that grows with the torque through the gear, and their least squares.

With e the torque from outside (hand, weight) and m the motor's, both at the joint and both positive along the
motion, v >= 0 and s = exp(-(v / v_s)^a):

    F = F_c + b v + |k_e e - k_m m| + s (F_s + |p_e e - p_m m| + q)

q = q_e e^2 where the motor drives against the load (e m < 0, |e| < |m|), q_m m^2 where the load drives it
back (|e| > |m|), else 0. So friction differs by the direction of the power. The rungs below leave terms away.
They are the forms of Duclusaud, Passault, Padois and Ly, Extended Friction Models for the Physics Simulation
of Servo Actuators (arXiv 2410.08650)."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.load import COEFFICIENTS, peak_left

LINEAR = ("coulomb_nm", "viscous_nms_rad", "stribeck_nm")
NAMES = (
    *LINEAR,
    *COEFFICIENTS,
    "stribeck_rad_s",
    "stribeck_power",
    "second_share",
    "second_rad_s",
    "backward",
)
"""Parameters, in the order of `Terms.values`; torques in N m at the joint, shares in N m per N m."""

_ONE = ("coulomb_nm", "viscous_nms_rad", "backward")
_PEAK = ("stribeck_nm", "stribeck_rad_s", "stribeck_power")
_TWO = ("second_share", "second_rad_s")
_BOTH = ("outside", "motor")
_BOTH_PEAK = ("outside_peak", "motor_peak")

RUNGS: Mapping[str, tuple[str, ...]] = {
    "coulomb_viscous": _ONE,
    "stribeck": (*_ONE, *_PEAK),
    "load": (*_ONE, *_BOTH),
    "load_stribeck": (*_ONE, *_PEAK, *_BOTH, *_BOTH_PEAK),
    "load_by_flow": (*_ONE, *_PEAK, *_BOTH, *_BOTH_PEAK),
    "load_squared": tuple(name for name in NAMES if name not in _TWO),
    "load_two_speeds": NAMES,
}
"""Parameters that each rung has, the plainest first; in `load` and `load_stribeck` outside and motor share
theirs."""

SHARED = ("load", "load_stribeck")

POWERS = (0.7, 1.0, 1.5, 2.5, 4.0)
"""Powers of the peak's fall that a fit begins with."""

SHARES = (0.3, 0.6)
"""Shares of the second speed that a fit begins with, where there is one."""

_SPEEDS = 5

_FALL = NAMES.index("stribeck_rad_s")
"""Where in `NAMES` the numbers begin that are not linear."""


@dataclass(frozen=True)
class Rows:
    """Measurements along their motion, shape (n,): speed (rad/s, >= 0), friction (N m), outside and motor's
    torque (N m), and which were backward."""

    speed: np.ndarray
    friction_nm: np.ndarray
    outside_nm: np.ndarray
    motor_nm: np.ndarray
    backward: np.ndarray

    def of(self, chosen: np.ndarray) -> Rows:
        """Some of the rows."""
        return Rows(*(column[chosen] for column in self.columns))

    @property
    def columns(self) -> tuple[np.ndarray, ...]:
        """All five."""
        return self.speed, self.friction_nm, self.outside_nm, self.motor_nm, self.backward


@dataclass(frozen=True)
class Terms:
    """A rung fitted: `values` and `errors` (standard errors; NaN where the points do not tell) in the order
    of `NAMES`."""

    rung: str
    values: np.ndarray
    errors: np.ndarray

    def __call__(self, rows: Rows) -> np.ndarray:
        """Friction at each row, N m."""
        return friction(self.values, rows)

    def value(self, name: str) -> float:
        """One parameter of `NAMES`."""
        return float(self.values[NAMES.index(name)])

    @property
    def told(self) -> dict[str, tuple[float, float]]:
        """Load coefficients the rung has, each with its standard error."""
        shared = self.rung in SHARED
        return {
            name: (float(self.values[NAMES.index(name)]), float(self.errors[NAMES.index(name)]))
            for name in COEFFICIENTS
            if name in RUNGS[self.rung] and not (shared and name.startswith("motor"))
        }


def friction(values: np.ndarray, rows: Rows) -> np.ndarray:
    """The closed form."""
    base, viscous, peak, k_e, k_m, p_e, p_m, q_e, q_m, v_s, power, second, v_2, backward = values
    e, m = rows.outside_nm, rows.motor_nm
    drives, driven = _squares(rows)
    fall = peak_left(rows.speed, v_s, power, second, v_2) if v_s > 0 else np.zeros_like(e)
    peak_nm = peak + np.abs(p_e * e - p_m * m) + q_e * drives + q_m * driven
    dry = base + np.abs(k_e * e - k_m * m) + fall * peak_nm
    found: np.ndarray = (dry + viscous * rows.speed) * np.where(rows.backward, backward, 1.0)
    return found


def slopes(values: np.ndarray, rows: Rows) -> np.ndarray:
    """Derivatives of `friction` by each parameter, shape (n, len(NAMES)); those of the fall are nil where v_s
    is."""
    _, _, peak, k_e, k_m, p_e, p_m, q_e, q_m, v_s, power, second, v_2, backward = values
    e, m, v = rows.outside_nm, rows.motor_nm, rows.speed
    drives, driven = _squares(rows)
    # of a size |.|: where the two torques cancel it has no slope, and the sign there is 0
    level, top = np.sign(k_e * e - k_m * m), np.sign(p_e * e - p_m * m)
    peak_nm = peak + np.abs(p_e * e - p_m * m) + q_e * drives + q_m * driven
    none = np.zeros_like(v)
    fall, by_fall = none, [none] * 4
    if v_s > 0:
        u, w = (v / v_s) ** power, (v / v_2) ** power
        log_u, log_w = (np.log(np.where(v > 0, v, one) / one) for one in (v_s, v_2))
        first, last = np.exp(-u), np.exp(-w)
        fall = (1 - second) * first + second * last
        by_fall = [
            (1 - second) * first * u * power / v_s,
            -(1 - second) * first * u * log_u - second * last * w * log_w,
            last - first,
            second * last * w * power / v_2,
        ]
    columns = [np.ones_like(v), v, fall, level * e, -level * m, fall * top * e, -fall * top * m]
    columns += [fall * drives, fall * driven, *(one * peak_nm for one in by_fall)]
    side = np.where(rows.backward, backward, 1.0)
    by_side = np.where(rows.backward, friction(np.array([*values[:-1], 1.0]), rows), 0.0)
    return np.column_stack([*(one * side for one in columns), by_side])


def _squares(rows: Rows) -> tuple[np.ndarray, np.ndarray]:
    """The smaller torque's square where the two oppose each other: where the motor drives, and where it is
    driven."""
    e, m = rows.outside_nm, rows.motor_nm
    against = e * m < 0
    drives, driven = against & (np.abs(e) < np.abs(m)), against & (np.abs(e) > np.abs(m))
    return np.where(drives, e**2, 0.0), np.where(driven, m**2, 0.0)


def fit_terms(rung: str, rows: Rows) -> Terms:
    """Least squares of one of `RUNGS`; all parameters are >= 0.

    Raises
    ------
    DataError
        No start of the search can be found.

    Notes
    -----
    Where the torques oppose each other the form is linear but for v_s and a: the best of a grid of these two,
    by non-negative least squares, is where the search of all parameters at once begins."""
    from scipy.optimize import least_squares

    free = [NAMES.index(name) for name in RUNGS[rung]]
    if rung in SHARED:
        free = [at for at in free if not NAMES[at].startswith("motor")]
    high = np.full(len(NAMES), np.inf)
    fastest = float(rows.speed.max())
    high[_FALL:] = 10 * fastest, 12.0, 1.0, 10 * fastest, 3.0
    low = np.zeros(len(NAMES))  # shares and torques below 0 would help the motion
    low[_FALL:] = 0.02 * fastest / (10 if "second_share" in RUNGS[rung] else 1), 0.3, 0.0, 0.02 * fastest, 0.3

    def whole(part: np.ndarray) -> np.ndarray:
        values = np.zeros(len(NAMES))
        # any speed will do, but 0, which is divided by
        values[-2] = 1.0  # the second speed, where its share is nil
        values[free] = part
        return _shared(values) if rung in SHARED else values

    def miss(part: np.ndarray) -> np.ndarray:
        return np.asarray(friction(whole(part), rows) - rows.friction_nm)

    def by_part(part: np.ndarray) -> np.ndarray:
        by = slopes(whole(part), rows)
        if rung in SHARED:  # one coefficient for both torques
            by[:, [3, 5]] += by[:, [4, 6]]
        return np.asarray(by[:, free])

    best = None
    for start in _starts(rung, rows):
        begin = np.clip(start[free], low[free] + 1e-9, high[free])
        found = least_squares(
            miss, begin, by_part, bounds=(low[free], high[free]), x_scale="jac", ftol=ENOUGH, max_nfev=200
        )
        best = found if best is None or found.cost < best.cost else best
    assert best is not None  # `_starts` has one, or says that there is none
    errors = np.full(len(NAMES), np.nan)
    errors[free] = _standard_errors(best.jac, best.fun)
    if rung in SHARED:
        errors = _shared(errors)
    return Terms(rung, whole(best.x), errors)


def _shared(values: np.ndarray) -> np.ndarray:
    """Values whose coefficients of the motor are those of outside."""
    out = values.copy()
    out[NAMES.index("motor")], out[NAMES.index("motor_peak")] = out[3], out[5]
    return out


# the sum of squares has several valleys over the fall of the peak: the grid's best may lie beside the deepest
STARTS = 3

ENOUGH = 1e-6
"""Share of the sum of squares below which a step is the last: half of that in the error."""


def _starts(rung: str, rows: Rows) -> list[np.ndarray]:
    """Parameters to begin with: the best of the grid first."""
    from scipy.optimize import nnls

    has = [name in RUNGS[rung] for name in NAMES[:_FALL]]
    e, m = np.abs(rows.outside_nm), np.abs(rows.motor_nm)
    drives, driven = _squares(rows)
    shared = rung in SHARED
    both = np.abs(rows.outside_nm - rows.motor_nm)
    found = []
    for fall in _falls(rung, rows):
        s = peak_left(rows.speed, *fall)
        columns = np.column_stack(
            [
                np.ones_like(s),
                rows.speed,
                s,
                both if shared else e,
                np.zeros_like(s) if shared else m,
                s * (both if shared else e),
                np.zeros_like(s) if shared else s * m,
                s * drives,
                s * driven,
            ]
        )
        # scipy's solver gives up after 3 n steps, on columns that are nearly alike: another fall begins then
        with contextlib.suppress(RuntimeError):
            values, miss = nnls(columns * has, rows.friction_nm)
            found.append((miss, np.array([*values, *fall, 1.0])))
    if not found:
        raise DataError(f"{rung}: no least squares of these loads and speeds; measure more of both")
    found.sort(key=lambda one: one[0])
    return [values for _, values in found[:STARTS]]


def _falls(rung: str, rows: Rows) -> list[tuple[float, float, float, float]]:
    """Falls of the peak that are tried first: v_s, a, c, v_2."""
    if "stribeck_nm" not in RUNGS[rung]:
        return [(1.0, 1.0, 0.0, 1.0)]
    speeds = [float(v) for v in np.quantile(rows.speed[rows.speed > 0], np.linspace(0.2, 0.8, _SPEEDS))]
    if "second_share" not in RUNGS[rung]:
        return [(v_s, power, 0.0, 1.0) for v_s in speeds for power in POWERS]
    pairs = [(first, second) for k, first in enumerate(speeds) for second in speeds[k + 1 :]]
    return [
        (first, power, share, second) for first, second in pairs for power in POWERS[1:4] for share in SHARES
    ]


def _standard_errors(jacobian: np.ndarray, miss: np.ndarray) -> np.ndarray:
    """Standard error of each free parameter; NaN where the points do not tell it."""
    scale = np.linalg.norm(jacobian, axis=0)
    out = np.full(jacobian.shape[1], np.nan)
    known = scale > 1e-9 * max(float(scale.max()), 1e-300)
    part = jacobian[:, known] / scale[known]
    free = max(len(miss) - int(known.sum()), 1)
    variance = np.diag(np.linalg.pinv(part.T @ part, rcond=1e-12)) * float(miss @ miss) / free
    out[known] = np.sqrt(variance) / scale[known]
    return out
