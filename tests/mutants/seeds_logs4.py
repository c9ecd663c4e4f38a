"""Seeded bugs in how the logs of a third outsider are read (decision 0161)."""

from __future__ import annotations

from seed import Seed

LOST = "tests/unit/friction/test_lost_rows.py"

SEEDS = (
    Seed(
        "rows that are missing again and again are those of a slower device",
        "rtctl/friction/logs/lost_rows.py",
        "if len(twice) > MOST_LOST and",
        "if len(twice) > 10**9 and",
        (f"{LOST}::test_every_tenth_row_is_missing_and_the_stamps_are_even",),
    ),
    Seed(
        "stamps that tell of lost rows are no help",
        "rtctl/friction/logs/lost_rows.py",
        "velocity = np.diff(position_rad) / step_s",
        "velocity = np.diff(position_rad) / np.median(step_s)",
        (f"{LOST}::test_stamps_that_tell_of_the_lost_rows_are_right",),
    ),
    Seed(
        "an angle that starts over in the first rows is left as it is",
        "rtctl/friction/logs/row_faults.py",
        'size=_window(rows), mode="mirror")',
        'size=_window(rows), mode="nearest")',
        (f"{LOST}::test_an_angle_may_start_over_in_any_row",),
    ),
)
