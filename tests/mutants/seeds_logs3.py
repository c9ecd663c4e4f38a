"""Seeded bugs in what logs tell: memory of a turn, files of LabVIEW, friction by load and by warmth."""

from __future__ import annotations

from seed import Seed

MEMORY = "tests/unit/friction/test_reversal_memory.py"
LOAD = "tests/unit/friction/test_load_in_motion.py"
TDMS = "tests/unit/hw/test_tdms.py"

SEEDS = (
    Seed(
        "a zero and a difference between the directions are told apart by rounding",
        "rtctl/friction/logs/reversal_memory.py",
        "rcond=TOLD)[0] / scale",
        "rcond=1e-9)[0] / scale",
        (f"{MEMORY}::test_a_zero_and_a_difference_between_directions_are_told_apart_by_no_rounding",),
    ),
    Seed(
        "a point of a log in motion is the mean over all loads",
        "rtctl/friction/logs/logs.py",
        'beside.get("load_nm"))',
        "None)",
        (f"{LOAD}::test_a_point_is_of_one_speed_and_one_load",),
    ),
    Seed(
        "the motor's torque of a point is that of both",
        "rtctl/friction/logs/loads.py",
        '"motor_nm": signals.torque_nm - outside',
        '"motor_nm": signals.torque_nm',
        (f"{LOAD}::test_a_point_is_of_one_speed_and_one_load",),
    ),
    Seed(
        "a rate that the file contradicts is taken",
        "hw/playback/rising.py",
        "abs(given_hz * step_s - 1) > MAX_RATE_ERROR",
        "abs(given_hz * step_s - 1) > 1e9",
        (f"{TDMS}::test_a_rate_that_the_file_contradicts_is_refused",),
    ),
)
