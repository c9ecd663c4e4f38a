"""Columns of a data set's points as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from hw.motion import name as own_name

COLUMNS = (
    "velocity_rad_s",
    "friction_torque_nm",
    "std_nm",
    "count",
    "direction",
    "weakest_place_nm",
    "presliding_rad",
    "presliding_spread_rad",
    "presliding_ramps",
    "temperature_c",
    "position_rad",
    "time_s",
)
"""Columns of the points; `rtctl.friction.point_columns` has their units and bounds. `position_rad` is the
mean over the places a point was measured at; `time_s` runs from the begin of the first session, over all of
them."""
_NUMBER = {
    "velocity_rad_s": ".9g",
    "count": ".0f",
    "direction": ".0f",
    "presliding_ramps": ".0f",
    "temperature_c": ".2f",
    "position_rad": ".6f",
    "travel_rad": ".6f",
    "time_s": ".3f",
}
_METRES = ("position_rad", "presliding_rad", "presliding_spread_rad", "travel_rad")
# a carriage is known to a fraction of a micrometre


def points_csv(
    points: Sequence[Mapping[str, Any]], rig: str, config_sha256: str, motion: str = "rotary"
) -> str:
    """The text of a CSV file of points, by direction and rising speed."""
    # measured at random: read in order
    rows = sorted(points, key=lambda p: (-p["direction"], abs(p["target_rad_s"])))
    return table_csv(COLUMNS, rows, rig, config_sha256, motion)


def table_csv(
    columns: Sequence[str], rows: Iterable[Mapping[str, Any]], rig: str, config_sha256: str, motion: str
) -> str:
    """The text of a CSV file with these columns; one that a row does not have stays empty.

    The columns have the names, and so the units, of the axis's motion."""
    out = io.StringIO()
    out.write(f"# rig {rig}, config sha256 {config_sha256}\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([own_name(column, motion) for column in columns])
    writer.writerows([_cell(name, row.get(name), motion) for name in columns] for row in rows)
    return out.getvalue()


def _cell(column: str, value: float | None, motion: str) -> str:
    if value is None:
        return ""
    return format(value, ".9f" if motion == "linear" and column in _METRES else _NUMBER.get(column, ".7f"))
