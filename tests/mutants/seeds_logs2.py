"""Seeded bugs in what was left over of logs: copies, causes that are not the true ones, refusals by chance."""

from __future__ import annotations

from seed import Seed

COPIES = "tests/unit/friction/test_copied_rows.py"

SEEDS = (
    Seed(
        "rows that are others again count as measured anew",
        "rtctl/friction/logs/copied_rows.py",
        "zip(edges[::2], edges[1::2], strict=True)",
        "[(0, len(fresh))]",
        (f"{COPIES}::test_a_log_that_stands_twice_or_has_a_part_pasted_is_as_sure_as_it_is_once",),
    ),
    Seed(
        "a torque that is commanded lap for lap is a copy wherever the joint went",
        "rtctl/friction/logs/copied_rows.py",
        "moved[length - 1 : -1] == moved[: len(key)]",
        "moved[length - 1 : -1] >= moved[: len(key)]",
        (f"{COPIES}::test_a_joint_at_rest_and_a_torque_that_is_commanded_lap_for_lap_are_no_copies",),
    ),
    Seed(
        "rows of points in two files count twice",
        "rtctl/friction/logs/other_programs.py",
        "kept = [part.at(mine) for part, mine in zip(parts, fresh, strict=True)]",
        "kept = list(parts)",
        (f"{COPIES}::test_rows_of_points_that_are_in_two_files_are_counted_once",),
    ),
)
