"""Columns of a data set's points as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

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
"""Columns of the points; `rtctl.friction.points.columns` has their units and bounds. `position_rad` is the mean over the places a point was measured at; `time_s` runs from
the begin of the first session, over all of them."""
_NUMBER = {
    "velocity_rad_s": ".9g",
    "count": "d",
    "direction": "d",
    "presliding_ramps": "d",
    "temperature_c": ".2f",
    "position_rad": ".6f",
    "time_s": ".3f",
}


def points_csv(points: Sequence[Mapping[str, Any]], rig: str, config_sha256: str) -> str:
    """Write points as the text of a CSV file, by direction and rising speed; a column a point does not have stays empty."""
    out = io.StringIO()
    out.write(f"# rig {rig}, config sha256 {config_sha256}\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for point in sorted(points, key=lambda p: (-p["direction"], abs(p["target_rad_s"]))):
        writer.writerow([_cell(name, point.get(name)) for name in COLUMNS])
    return out.getvalue()


def _cell(column: str, value: float | None) -> str:
    return "" if value is None else format(value, _NUMBER.get(column, ".7f"))
