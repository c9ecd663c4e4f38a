"""Measured friction points of one axis, whatever file or rig they came from, with every column they were
measured with."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from rtctl.errors import DataError

POINTS_MIN = 8
"""Fewest points of one direction."""

SPEEDS_MIN = 4
"""Fewest different speeds of one direction."""

# repeats differ by tenths of a percent, the levels of `rtctl identify` by 12 and more (decision 0118)
LEVEL_WIDTH = 1.03
"""Highest over lowest speed of one level: what a run measures as its speed differs a little each time."""

AGAINST_FEW = 0.1
"""Share of the rows with friction against the motion up to which these rows are wrong, and not the rest."""

AT_REST = 1e-12
"""Share of the greatest speed up to which a joint is at rest."""

POINTS_MAX = 2000
"""Most points of one direction: the regression's time grows with their square. Average before."""


@dataclass(frozen=True)
class FrictionPoints:
    """Points of both directions. Arrays of one length.

    `velocity_rad_s` signed, `friction_nm` the magnitude (> 0), `direction` +1 or -1, `std_nm` and `count`
    NaN where nobody says. `source` names the file in messages, `sha256` is of its bytes. `columns` holds all
    else that was measured, by the names of `rtctl.friction.point_columns`, NaN where nobody says; each has at
    least one number. `left_out` marks points that nothing is learned from or judged by
    (`rtctl.friction.outliers`); None: none. `motion` is "rotary" or "linear" (`hw.motion`): of the latter,
    all is in m and N."""

    velocity_rad_s: np.ndarray
    friction_nm: np.ndarray
    direction: np.ndarray
    std_nm: np.ndarray
    count: np.ndarray
    source: str
    sha256: str
    columns: Mapping[str, np.ndarray] = field(default_factory=dict)
    left_out: np.ndarray | None = None
    motion: str = "rotary"

    @classmethod
    def from_rows(
        cls,
        rows: Iterable[Iterable[float]],
        source: str,
        sha256: str,
        columns: Mapping[str, np.ndarray] | None = None,
    ) -> FrictionPoints:
        """Points from rows of (velocity, friction, direction, std, count), in the units above."""
        table = np.array([tuple(row) for row in rows], dtype=float).reshape(-1, 5)
        velocity, friction, direction, std, count = table.T
        return cls(_still(velocity), friction, direction, std, count, source, sha256, told(columns or {}))

    @classmethod
    def from_signed(
        cls,
        velocity_rad_s: np.ndarray,
        torque_nm: np.ndarray,
        source: str,
        sha256: str,
        columns: Mapping[str, np.ndarray],
        where: Callable[[int], str],
    ) -> FrictionPoints:
        """Points whose torque has the sign of the motion; `columns` may have `direction`, `std_nm` and
        `count`.

        Raises
        ------
        DataError
            Naming the row by `where(index)`: no friction, friction that points against the motion, a
            direction that cannot be."""
        rest, unknown = dict(columns), np.full(len(velocity_rad_s), np.nan)
        given, std, count = (rest.pop(name, unknown) for name in ("direction", "std_nm", "count"))
        # a direction is needed at rest alone; where it is given in motion it must agree
        known = ~np.isnan(given)
        at_rest = np.where(known, given, np.sign(torque_nm))
        # at rest nothing else tells
        direction = np.where(velocity_rad_s != 0, np.sign(velocity_rad_s), at_rest)
        against = torque_nm * direction < 0
        # in this order: a wrong direction makes friction point against the motion as well
        for wrong, text in (
            (torque_nm == 0, "column friction_torque_nm: 0 is not friction; drop the row"),
            (known & (np.abs(given) != 1), "column direction: {given:g} is neither +1 nor -1; correct it"),
            (
                known & (given != direction),
                "column direction: {given:g} contradicts velocity {velocity:g}; correct it",
            ),
            (
                against,
                "column friction_torque_nm: {torque:g} N m points against the motion ({velocity:g} rad/s, "
                f"direction {{direction:+g}}); {_remedy(against, direction)}",
            ),
        ):
            for row in np.flatnonzero(wrong)[:1]:
                numbers = {"given": given[row], "velocity": velocity_rad_s[row], "torque": torque_nm[row]}
                raise DataError(f"{where(int(row))}: {text.format(**numbers, direction=direction[row])}")
        return cls(
            _still(velocity_rad_s), np.abs(torque_nm), direction, std, count, source, sha256, told(rest)
        )

    @property
    def time_s(self) -> np.ndarray | None:
        """When each point was measured, s; None where nobody says."""
        return self.columns.get("time_s")

    @property
    def temperature_range_c(self) -> tuple[float, float] | None:
        """Least and greatest temperature, degrees C; None where nobody says: 0 throughout is a rig without a
        sensor."""
        column = self.columns.get("temperature_c")
        if column is None or not np.nan_to_num(column).any():
            return None
        return float(np.nanmin(column)), float(np.nanmax(column))

    def rows_of(self, direction: int) -> np.ndarray:
        """Index of each point of one direction that is not left out, by rising speed: the order of
        `branch`."""
        mine = self.direction == direction
        chosen = np.flatnonzero(mine if self.left_out is None else mine & ~self.left_out)
        # the last key leads; by friction, too: what is learned must not go by the order of the rows
        order = np.lexsort((self.friction_nm[chosen], np.abs(self.velocity_rad_s[chosen])))
        rows: np.ndarray = chosen[order]
        return rows

    def branch(self, direction: int) -> tuple[np.ndarray, np.ndarray]:
        """(speed rad/s, friction N m) of one direction, by rising speed."""
        rows = self.rows_of(direction)
        return np.abs(self.velocity_rad_s[rows]), self.friction_nm[rows]


def _still(velocity_rad_s: np.ndarray) -> np.ndarray:
    """Velocities, 0 where they are none beside the greatest: the last rows of a simulated joint that comes to
    rest have 1e-240 rad/s, whose square is none, and no cell of a table is as narrow."""
    speed = np.abs(velocity_rad_s)
    return np.where(speed > AT_REST * speed.max(initial=0.0), velocity_rad_s, 0.0)


def _remedy(against: np.ndarray, direction: np.ndarray) -> str:
    """What to do about friction that points against the motion in these rows."""
    if against.all():
        return "so do all rows: turn the sign of one of the two columns (scale -1)"
    if any(np.array_equal(against, direction == one) for one in (1, -1)):
        return (
            "so do all rows of that direction: give friction, not its amount, the sign of the motion, and "
            "take off what pulls one way (a weight, the zero of the torque)"
        )
    if against.sum() <= AGAINST_FEW * len(against):
        return f"so do {against.sum()} of {len(against)} rows: drop them if the sensor had no value there"
    return (
        "give friction the sign of the motion (scale -1 turns a column), take its offset away, leave out "
        "what turns round, or average"
    )


def told(columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The columns that hold a number at all."""
    return {name: column for name, column in columns.items() if np.isfinite(column).any()}


def level_starts(speed: np.ndarray) -> np.ndarray:
    """The lowest speed of each level, rising; `speed` >= 0, in any order. A level has the speeds up to
    `LEVEL_WIDTH` times its lowest: repeats of one nominal speed are one level, however they were measured."""
    starts: list[float] = []
    for one in np.unique(speed):
        if not starts or one > LEVEL_WIDTH * starts[-1]:
            starts.append(float(one))
    return np.array(starts)


def levels_of(speed: np.ndarray, starts: np.ndarray | None = None) -> np.ndarray:
    """Number of the level of each speed, rising from 0; the levels begin at `starts`, or are those of these
    speeds."""
    starts = level_starts(speed) if starts is None else starts
    return np.searchsorted(starts, speed, side="right") - 1


def require_enough(points: FrictionPoints, most: float = POINTS_MAX) -> None:
    """Raise DataError for points too few, above `most`, of too few speeds or constant in a direction."""
    for direction in (1, -1):
        speed, friction = points.branch(direction)
        where = f"{points.source}: direction {direction:+d}"
        # magnitudes of both directions in one file: the remedy is another one than for few points
        if not len(speed) and len(points.direction):
            raise DataError(
                f"{where}: no row moves that way: the velocity needs the sign of the motion (a column for "
                "each direction: two files, scale -1 in the second), and each direction points of its own"
            )
        if len(speed) < POINTS_MIN:
            raise DataError(
                f"{where}: {len(speed)} points, at least {POINTS_MIN} are needed; measure more speeds"
            )
        if len(speed) > most:
            raise DataError(f"{where}: {len(speed)} points, at most {most}; average them by speed")
        if (different := len(level_starts(speed))) < SPEEDS_MIN:
            raise DataError(
                f"{where}: column velocity_rad_s: only {different} different speeds, "
                f"at least {SPEEDS_MIN} are needed; measure more speeds"
            )
        if np.ptp(friction) == 0:
            raise DataError(
                f"{where}: column friction_torque_nm: constant at {friction[0]:g} N m; "
                "a measured friction is never constant: check the current sensor"
            )
