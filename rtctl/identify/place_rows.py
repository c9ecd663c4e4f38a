"""What was measured place by place: the rows of points_places.csv."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from rtctl.identify.columns import table_csv
from rtctl.identify.tick_readings import Measurement

COLUMNS = ("velocity_rad_s", "friction_torque_nm", "direction", "count", "position_rad", "travel_rad")
"""As `rtctl.friction.point_columns` has them; `travel_rad` is the way around the place that a row is the mean
over."""

Row = tuple[float, float, int, int, float, float]


def rows_of(direction: int, measurements: Sequence[Measurement]) -> list[Row]:
    """One row for each place: measurements without a tick between them are of one place."""
    rows: list[Row] = []
    groups: list[list[Measurement]] = []
    for one in measurements:
        before = groups[-1][-1] if groups else None
        if (
            before is not None
            and one.first_tick == before.first_tick + before.ticks
            and one.velocity_rad_s != 0
        ):
            groups[-1].append(one)
        else:
            groups.append([one])
    for group in groups:
        torque, speed, x = (
            float(np.mean([getattr(one, name) for one in group]))
            for name in ("torque_nm", "velocity_rad_s", "position_rad")
        )
        torque += float(np.mean([one.cogging_nm for one in group]))  # `rtctl fit --sweep` takes it off
        if torque * direction > 0:  # else something pulls more than friction holds
            way = group[-1].time_s - group[0].time_s
            # times are of the middles of windows: from the first to the last there is one window less
            each = way / (len(group) - 1) if len(group) > 1 else 0.0
            rows.append((speed, torque, direction, len(group), x, abs(speed) * (way + each)))
    return rows


def places_csv(rows: Iterable[Sequence[float]], rig: str, config_sha256: str, motion: str = "rotary") -> str:
    """The text of a CSV file of such rows, with the names of the axis's motion."""
    told = (dict(zip(COLUMNS, row, strict=True)) for row in rows)
    return table_csv(COLUMNS, told, rig, config_sha256, motion)
