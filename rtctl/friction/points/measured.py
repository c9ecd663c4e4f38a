"""Measured friction points of one axis, from a CSV file.

Columns, any order, others ignored:

=====================  =======  ==================================================================
velocity_rad_s         rad/s    signed velocity of the run; 0 for a break-away point
friction_torque_nm     N m      friction overcome, with the sign of the motion
direction              +1, -1   optional: direction of a break-away point (else its torque's sign)
std_nm, count          N m, 1   optional: spread and number of measurements behind the point
time_s                 s        optional: when the point was measured, see `rtctl.friction.learn.hold_out`
temperature_c          deg C    optional: see `temperature_range`
=====================  =======  ==================================================================

Lines that begin with `#` are comments.
"""

from __future__ import annotations

import csv
import hashlib
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hw.outside import read_bounded
from rtctl.errors import DataError

MOST_BYTES = 1 << 26
"""Largest file of points: a million rows."""

POINTS_MIN = 8
"""Fewest points of one direction."""

SPEEDS_MIN = 4
"""Fewest different speeds of one direction."""

POINTS_MAX = 2000
"""Most points of one direction: the regression's time grows with their square. Average before."""

REPEATS_SHARE = 0.1
"""A larger share of rows that repeat another one to the last digit is a copy, not a measurement."""

_REQUIRED = ("velocity_rad_s", "friction_torque_nm")
_LIMIT = {
    "velocity_rad_s": 1e4,
    "friction_torque_nm": 1e6,
    "direction": 1,
    "std_nm": 1e6,
    "count": 1e12,
    "time_s": 1e12,
}


@dataclass(frozen=True)
class FrictionPoints:
    """Points of both directions. Arrays of one length.

    `velocity_rad_s` signed, `friction_nm` the magnitude (> 0), `direction` +1 or -1, `std_nm` and `count`
    NaN where the file does not say. `source` names the file in messages, `sha256` is of its bytes. `time_s` is
    NaN where the file does not say, and None without that column.
    """

    velocity_rad_s: np.ndarray
    friction_nm: np.ndarray
    direction: np.ndarray
    std_nm: np.ndarray
    count: np.ndarray
    source: str
    sha256: str
    time_s: np.ndarray | None = None

    @classmethod
    def from_rows(cls, rows: Iterable[Iterable[float]], source: str, sha256: str) -> FrictionPoints:
        """Points from rows of (velocity, friction, direction, std, count[, time]), in the units above."""
        table = np.array([tuple(row) for row in rows], dtype=float)
        table = table.reshape(len(table), -1) if len(table) else table.reshape(0, 5)
        velocity, friction, direction, std, count = table.T[:5]
        time_s = table[:, 5] if table.shape[1] > 5 else None
        return cls(velocity, friction, direction, std, count, source, sha256, time_s)

    def rows_of(self, direction: int) -> np.ndarray:
        """Index of each point of one direction, by rising speed: the order of `branch`."""
        chosen = np.flatnonzero(self.direction == direction)
        order = np.lexsort((self.friction_nm[chosen], np.abs(self.velocity_rad_s[chosen])))
        rows: np.ndarray = chosen[order]
        return rows

    def branch(self, direction: int) -> tuple[np.ndarray, np.ndarray]:
        """(speed rad/s, friction N m) of one direction, by rising speed."""
        rows = self.rows_of(direction)
        return np.abs(self.velocity_rad_s[rows]), self.friction_nm[rows]


def read_points(path: str | Path) -> FrictionPoints:
    """Read a CSV file of friction points.

    Raises
    ------
    DataError
        Naming the file, the row and column, what is wrong there, and the remedy. Rows may be in any order.
    """
    path = Path(path)
    try:
        raw = read_bounded(path, MOST_BYTES)
        lines = raw.decode("utf-8-sig").splitlines()
    except OSError as error:
        raise DataError(f"{path}: cannot read the points: {error.strerror}; correct the path") from error
    except UnicodeDecodeError as error:
        raise DataError(f"{path}: not a text file ({error}); save it as CSV in UTF-8") from error
    numbered = [
        (i, line) for i, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")
    ]
    if not numbered:
        raise DataError(f"{path}: the file is empty; it needs the columns {', '.join(_REQUIRED)}")
    header = [name.strip() for name in next(csv.reader([numbered[0][1]]))]
    for name in _REQUIRED:
        if name not in header:
            raise DataError(f"{path}: row {numbered[0][0]}: column {name} is missing; rename or add it")
    if len(set(header)) != len(header):
        raise DataError(f"{path}: row {numbered[0][0]}: a column name occurs twice; remove one")
    rows = [_row(path, number, line, header) for number, line in numbered[1:]]
    if "time_s" not in header:
        rows = [row[:-1] for row in rows]
    points = FrictionPoints.from_rows(rows, str(path), hashlib.sha256(raw).hexdigest())
    require_enough(points)
    _require_distinct(path, numbered[1:])
    return points


def _require_distinct(path: Path, numbered: list[tuple[int, str]]) -> None:
    """Refuse a file of which a part occurs twice: what is measured again differs in some digit."""
    first: dict[str, int] = {}
    repeats = [(number, first[line]) for number, line in numbered if first.setdefault(line, number) != number]
    if len(repeats) > REPEATS_SHARE * len(numbered):
        number, before = repeats[0]
        raise DataError(
            f"{path}: row {number} repeats row {before} to the last digit, and {len(repeats) - 1} more rows repeat "
            "others; remove the copies, they would be held out and trained on at once"
        )


def temperature_range(path: str | Path) -> tuple[float, float] | None:
    """Least and greatest `temperature_c` of a CSV file of points that `read_points` took, degrees C.

    None without that column, or without a temperature in it: 0 throughout is a rig without a sensor.

    Raises
    ------
    DataError
        A temperature outside -100..300 degrees C.
    """
    lines = Path(path).read_text("utf-8-sig").splitlines()
    rows = csv.DictReader(line for line in lines if line.strip() and not line.lstrip().startswith("#"))
    found = []
    for row in rows:
        text = next(
            (cell for name, cell in row.items() if name and name.strip() == "temperature_c"), ""
        ).strip()
        try:
            value = float(text or "nan")
        except ValueError:
            value = math.inf
        if math.isnan(value):
            continue
        if not -100 <= value <= 300:
            raise DataError(
                f"{path}: column temperature_c: {text!r} is not a temperature in degrees C; correct it"
            )
        found.append(value)
    return (min(found), max(found)) if any(found) else None


def _row(path: Path, number: int, line: str, header: list[str]) -> tuple[float, ...]:
    cells = next(csv.reader([line]))
    if len(cells) != len(header):
        raise DataError(
            f"{path}: row {number}: {len(cells)} cells, the header has {len(header)}; complete the row"
        )
    record = dict(zip(header, cells, strict=True))

    def number_in(column: str) -> float:
        text = record.get(column, "").strip()
        if not text and column not in _REQUIRED:
            return math.nan
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not abs(value) <= _LIMIT[column]:
            limit = f"a finite number within +-{_LIMIT[column]:g}"
            raise DataError(
                f"{path}: row {number}: column {column}: {text!r} is not {limit}; correct or drop the row"
            )
        return value

    velocity, torque, given = (number_in(name) for name in (*_REQUIRED, "direction"))
    if torque == 0:
        raise DataError(f"{path}: row {number}: column friction_torque_nm: 0 is not friction; drop the row")
    if not math.isnan(given) and abs(given) != 1:
        raise DataError(f"{path}: row {number}: column direction: {given:g} is neither +1 nor -1; correct it")
    direction = (
        math.copysign(1, velocity)
        if velocity
        else given
        if not math.isnan(given)
        else math.copysign(1, torque)
    )
    if not math.isnan(given) and given != direction:
        raise DataError(
            f"{path}: row {number}: column direction: {given:g} contradicts velocity {velocity:g}; correct it"
        )
    if torque * direction < 0:
        raise DataError(
            f"{path}: row {number}: column friction_torque_nm: {torque:g} N m points against the motion "
            f"({velocity:g} rad/s, direction {direction:+g}); give friction the sign of the motion"
        )
    return velocity, abs(torque), direction, number_in("std_nm"), number_in("count"), number_in("time_s")


def require_enough(points: FrictionPoints) -> None:
    """Raise DataError for points too few, too many, of too few speeds or constant in a direction."""
    for direction in (1, -1):
        speed, friction = points.branch(direction)
        where = f"{points.source}: direction {direction:+d}"
        if len(speed) < POINTS_MIN:
            raise DataError(
                f"{where}: {len(speed)} points, at least {POINTS_MIN} are needed; measure more speeds"
            )
        if len(speed) > POINTS_MAX:
            raise DataError(f"{where}: {len(speed)} points, at most {POINTS_MAX}; average them by speed")
        if len(np.unique(speed)) < SPEEDS_MIN:
            raise DataError(
                f"{where}: column velocity_rad_s: only {len(np.unique(speed))} different speeds, "
                f"at least {SPEEDS_MIN} are needed; measure more speeds"
            )
        if np.ptp(friction) == 0:
            raise DataError(
                f"{where}: column friction_torque_nm: constant at {friction[0]:g} N m; "
                "a measured friction is never constant: check the current sensor"
            )
