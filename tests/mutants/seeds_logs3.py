"""Seeded bugs in what logs of a joint in motion tell: memory of a turn, files of LabVIEW, friction by load and
warmth."""

from __future__ import annotations

from seed import Seed

MEMORY = "tests/unit/friction/test_reversal_memory.py"

SEEDS = (
    Seed(
        "a zero and a difference between the directions are told apart by rounding",
        "rtctl/friction/logs/reversal_memory.py",
        "rcond=TOLD)[0] / scale",
        "rcond=1e-9)[0] / scale",
        (f"{MEMORY}::test_a_zero_and_a_difference_between_directions_are_told_apart_by_no_rounding",),
    ),
)
