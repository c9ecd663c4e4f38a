"""A friction model in memory: two branches of |v|, their support vectors, and the compiled curve.

Branch 0 holds for v >= 0, branch 1 for v < 0, as in the `MODEL` record. All arrays of speeds are |v|."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rtctl.control.records import LOOKUP_CELLS, MODEL
from rtctl.friction.band import Band
from rtctl.friction.kind_compile import error_bound
from rtctl.friction.kind_cubic import PiecewiseCubic
from rtctl.friction.kind_curve import Curve
from rtctl.friction.kind_harmonics import Harmonics
from rtctl.friction.kind_place import PlaceKernel, PlaceTables, compile_place
from rtctl.friction.load import Load

SELF_TEST_VECTORS = 64
"""Self-test vectors of a model file, half of them per branch."""


@dataclass(frozen=True)
class Branch:
    """One direction.

    `validation_max_error_nm` is the largest error on speeds held out of training, `train_...` on the
    training points. `friction_min_nm` is the least dry friction (curve minus `viscous_nms_rad` times
    speed) and `friction_max_nm` the largest value of the curve over 0..`speed_max_rad_s`. `kind` and
    `parameters` are those of `kind_curve.Curve`; `hyper_parameters` are what the training was given or found.
    `place_spread_nm` is the largest shortfall of the friction below the curve at any place and speed that was
    visited, 0 or more; None where the points do not say. `test_max_error_nm` is the largest error on test
    points, `single_max_error_nm` the largest that a single measurement behind the points is expected to have;
    None: not known."""

    support_vectors: np.ndarray
    dual_coef: np.ndarray
    intercept: float
    curve: PiecewiseCubic
    speed_max_rad_s: float
    n_points: int
    train_mean_error_nm: float
    train_rmse_nm: float
    train_max_error_nm: float
    validation_rmse_nm: float
    validation_max_error_nm: float
    friction_min_nm: float
    friction_max_nm: float
    viscous_nms_rad: float
    hyper_parameters: dict[str, float]
    kind: str = "spline"
    parameters: dict[str, float] = field(default_factory=dict)
    place_spread_nm: float | None = None
    test_max_error_nm: float | None = None
    single_max_error_nm: float | None = None
    sliding_doubt_nm: float | None = None
    """Most that friction was off the curve at any place, at speeds that surely slide; None: not known."""
    support_places: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """Position of each support vector, rad, of a model with a kernel of place; else empty."""
    parts: tuple[tuple[float, Curve], ...] = ()
    """Curves that a mean is of, each with its share (`kind_mean`); else empty."""
    band: Band | None = None
    """Within it lie 95 % of what a session measures that was not learned from; None: not known."""

    def place_tables(self, kernel: PlaceKernel | None) -> PlaceTables | None:
        """What place adds to the curve; None for a curve of speed alone."""
        if kernel is None:
            return None
        return compile_place(kernel, self.support_vectors, self.support_places, self.dual_coef)

    @property
    def source(self) -> Curve:
        """The learned curve, uncompiled."""
        sums = (self.support_vectors, self.dual_coef, self.intercept)
        return Curve(self.kind, self.parameters, *sums, self.parts)

    def magnitude(self, speed: np.ndarray) -> np.ndarray:
        """Friction at each speed >= 0, N m; held at the end of the trained range beyond it."""
        return self.curve(np.minimum(speed, self.speed_max_rad_s))

    def kernel_sum(self, speed: np.ndarray) -> np.ndarray:
        """Evaluate the learned curve at each speed >= 0, N m; not held beyond the trained range."""
        return self.source(speed)

    @property
    def rounding_bound_nm(self) -> float:
        """Most the compiled curve may differ from the learned one, N m: proved for tables, else rounding."""
        return error_bound(self.source, self.curve, self.speed_max_rad_s)

    @property
    def friction_lower_nm(self) -> float:
        """Lower bound of friction: the least value of the curve minus its largest known error, >= 0, N m."""
        values = self.magnitude(self.curve.extreme_speeds(self.speed_max_rad_s))
        return max(0.0, float(values.min()) - self.error_max_nm)

    @property
    def secant_damping_nms_rad(self) -> float:
        """Damping it is worth to a passivity proof: least (curve - largest error) / v, N m s/rad."""
        return self.curve.least_secant(self.speed_max_rad_s, self.error_max_nm)

    @property
    def slope_damping_nms_rad(self) -> float:
        """Least slope of the curve, N m s/rad: below 0 on a Stribeck flank, where a servo may stick-slip."""
        return self.curve.least_slope(self.speed_max_rad_s)

    @property
    def error_max_nm(self) -> float:
        """Largest known error of the curve, N m: all points, measurements behind them, and the band."""
        band_nm = 0.0 if self.band is None else self.band.widest_nm
        # the largest of all, since no proof may lean on the kinder one
        beside = (self.test_max_error_nm or 0.0, self.single_max_error_nm or 0.0, band_nm)
        return max(self.train_max_error_nm, self.validation_max_error_nm, *beside)


@dataclass(frozen=True)
class FrictionModel:
    """Learned friction of one axis of one rig."""

    rig: str
    kind: str
    branches: tuple[Branch, Branch]
    speed_fade_rad_s: float
    data_sha256: str
    created: str
    versions: dict[str, str]
    self_test: np.ndarray
    """Shape (64, 2): signed velocity (rad/s) and friction magnitude (N m), by the uncompiled curve."""
    temperature_min_c: float | None = None
    temperature_max_c: float | None = None
    """Range of temperature the points were measured in, degrees C; None: not said."""
    evaluation_ns: float | None = None
    """Time of one evaluation at the slowest speed, ns, on the machine that fitted; None: not measured."""
    motion: str = "rotary"
    """"linear": speeds are in m/s and friction in N, under the same names (`hw.motion`)."""
    selection: str = ""
    """Why this model was chosen, in words."""
    presliding_rad: float | None = None
    """Presliding length, rad: break-away torque over the initial slope of torque over position, as
    `presliding` defines and measures it (F_s / sigma0 of LuGre); mean over all ramps, both directions. None:
    not measured."""
    presliding_spread_rad: float | None = None
    """Standard deviation of one ramp's presliding length, rad; None: not measured, or given by hand."""
    presliding_ramps: int = 0
    """Ramps behind the presliding length; 0 when it was not measured, or given by hand."""
    place: PlaceKernel | None = None
    """Kernel of place of both branches, whose curves are then means over a turn. None: of speed alone."""
    conservative: Harmonics | None = None
    """Torque of the joint's place alone (cogging, ripple); None: not measured, or none found."""
    load: Load | None = None
    """What the load adds: the curves are then those of a gear without load. None: over all loads."""

    def magnitude(self, velocity: np.ndarray | float) -> np.ndarray:
        """Friction magnitude at each signed velocity (rad/s), N m; NaN for NaN.

        The same function as the loop's compiled `friction_magnitude`: branch 1 below zero, values held at
        the end of the trained range."""
        v = np.asarray(velocity, dtype=float)
        forward, backward = (branch.magnitude(np.abs(v)) for branch in self.branches)
        return np.where(v < 0, backward, forward)

    @property
    def friction_min_nm(self) -> np.ndarray:
        """Least dry friction per branch, N m, shape (2,)."""
        return np.array([branch.friction_min_nm for branch in self.branches])

    @property
    def error_max_nm(self) -> np.ndarray:
        """Largest known error per branch, N m, shape (2,)."""
        return np.array([branch.error_max_nm for branch in self.branches])

    @property
    def place_spread_nm(self) -> np.ndarray | None:
        """Largest shortfall below the curve at any place per branch, N m, shape (2,); None: unknown."""
        forward, backward = (branch.place_spread_nm for branch in self.branches)
        return None if forward is None or backward is None else np.array([forward, backward])

    @property
    def sliding_doubt_nm(self) -> float | None:
        """Most that sliding friction may be off, N m, with the band; None: unknown."""
        forward, backward = (branch.sliding_doubt_nm for branch in self.branches)
        if forward is None or backward is None:
            return None
        # the watch compares sessions: what they differ by is no drift
        bands = (0.0 if branch.band is None else branch.band.widest_nm for branch in self.branches)
        return max(forward, backward, *bands)

    @property
    def friction_max_nm(self) -> float:
        """Largest torque the model ever gives, N m."""
        return max(branch.friction_max_nm for branch in self.branches)

    def place_magnitude(self, velocity: np.ndarray, position_rad: np.ndarray) -> np.ndarray:
        """What place adds to `magnitude` at each velocity (rad/s) and position (rad), N m; of one length."""
        # -0.0 is forward here as in the law
        v, out = np.asarray(velocity, dtype=float), np.zeros(len(velocity))
        for side, branch in ((v >= 0, self.branches[0]), (v < 0, self.branches[1])):
            tables = branch.place_tables(self.place)
            if tables is not None and side.any():
                speed = np.minimum(np.abs(v[side]), branch.speed_max_rad_s)
                out[side] = tables(speed, np.asarray(position_rad)[side])
        return out

    @property
    def place_steepest_nm_rad(self) -> float:
        """Bound of how steeply friction changes over position, N m/rad; 0 for a model of speed alone."""
        found = [0.0]
        for branch in self.branches:
            tables = branch.place_tables(self.place)
            if tables is not None:
                found.append(tables.steepest_nm_rad(branch.curve.extreme_speeds(branch.speed_max_rad_s)))
        return max(found)

    @property
    def place_trough_nm(self) -> float:
        """How far friction is below its mean over a turn at most, N m, >= 0."""
        return self._most_over_turn(-1.0)

    @property
    def place_crest_nm(self) -> float:
        """How far friction is above its mean over a turn at most, N m, >= 0."""
        return self._most_over_turn(1.0)

    def _most_over_turn(self, side: float) -> float:
        found = [0.0]
        for branch in self.branches:
            tables = branch.place_tables(self.place)
            if tables is not None:
                speeds = branch.curve.extreme_speeds(branch.speed_max_rad_s)
                found.append(float((side * tables.over_turn(speeds)).max()))
        return max(found)

    @property
    def has_place(self) -> bool:
        """Whether anything in the model depends on the joint's place."""
        return self.place is not None or self.conservative is not None

    @property
    def place_period_rad(self) -> float:
        """Longest period of what depends on place, rad; 0 without."""
        parts = [part for part in (self.place, self.conservative) if part is not None]
        return max((part.period_rad for part in parts), default=0.0)

    @property
    def place_waves_per_rad(self) -> tuple[float, float]:
        """Shortest waves per rad of the joint, of friction and of the conservative part; 0 without."""
        of_friction = 0.0 if self.place is None else self.place.orders / self.place.period_rad
        part = self.conservative
        return of_friction, 0.0 if part is None else float(part.orders.max()) / part.period_rad

    def record(self) -> np.ndarray:
        """Compiled record for the loop: shape (1,), dtype `MODEL`, look-up filled.

        Cell c of the look-up holds the segment in force at its left edge, taken a hair early, because the
        evaluation may round a speed just below the edge into the cell; it then walks forward."""
        out = np.zeros(1, MODEL)
        row = out[0]
        for d, branch in enumerate(self.branches):
            knots, n = branch.curve.knots, len(branch.curve.knots)
            row["n_segments"][d] = n
            row["knot_rad_s"][d, :n] = knots
            # the first of them ends the last segment: there the law holds
            row["knot_rad_s"][d, n:] = branch.speed_max_rad_s
            row["coefficient"][d, :n] = branch.curve.coefficients
            scale = LOOKUP_CELLS / branch.speed_max_rad_s
            edges = np.arange(LOOKUP_CELLS) * (1 - 1e-12) / scale
            row["lookup"][d] = np.searchsorted(knots, edges, side="right") - 1
            row["lookup_scale"][d] = scale
            row["speed_max_rad_s"][d] = branch.speed_max_rad_s
            row["friction_min_nm"][d] = branch.friction_min_nm
            row["viscous_nms_rad"][d] = branch.viscous_nms_rad
            tables = branch.place_tables(self.place)
            if tables is not None:
                row["place_orders"][d] = tables.orders
                row["place_coefficient"][d, :n, : 2 * tables.orders] = tables.coefficients
        if self.place is not None:
            row["place_turns_per_rad"] = 1.0 / self.place.period_rad
        if self.conservative is not None:
            row["conservative_per_rad"] = 1.0 / self.conservative.period_rad
            row["conservative"] = self.conservative.table()
        if self.load is not None:
            self.load.fill(row)
        row["speed_fade_rad_s"] = self.speed_fade_rad_s
        return out


def self_test_vectors(branches: tuple[Branch, Branch]) -> np.ndarray:
    """Vectors (velocity, kernel sum) over the trained range of both branches, ends included, shape (64, 2).

    Against a shifted knot or a swapped branch."""
    # by the uncompiled curve: the compiled one cannot vouch for itself
    rows = []
    half = SELF_TEST_VECTORS // 2
    for sign, branch in zip((1.0, -1.0), branches, strict=True):
        # squared spacing: dense near zero, where the Stribeck curve bends
        share = np.linspace(0 if sign > 0 else 1 / half, 1, half) ** 2  # 0 is forward, as in the law
        speed = share * branch.speed_max_rad_s
        rows.append(np.column_stack([sign * speed, branch.kernel_sum(speed)]))
    return np.concatenate(rows)
