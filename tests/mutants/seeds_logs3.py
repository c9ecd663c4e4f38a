"""Seeded bugs in what logs tell: memory of a turn, files of LabVIEW, friction by load and by warmth."""

from __future__ import annotations

from seed import Seed

MEMORY = "tests/unit/friction/test_reversal_memory.py"
LOAD = "tests/unit/friction/test_load_in_motion.py"
TDMS = "tests/unit/hw/test_tdms.py"
WARMTH = "tests/unit/friction/test_temperature_of_sessions.py"
JUDGE = "tests/unit/cli/test_fit_judge.py"

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
    Seed(
        "what a kelvin changes is put on test points instead of off",
        "rtctl/friction/learn/warmth.py",
        "points.friction_nm - over_k * by_k",
        "points.friction_nm + over_k * by_k",
        (f"{WARMTH}::test_test_points_that_are_warmer_are_judged_with_what_a_kelvin_changes_taken_off",),
    ),
    Seed(
        "test points of another temperature are judged without a word of it",
        "rtctl/friction/learn/report_sentences.py",
        "if abs(over_k) < TEMPERATURE_SPAN_K:",
        "if abs(over_k) < 1e9:",
        (f"{WARMTH}::test_what_is_said_of_warmth_is_of_what_the_sensor_says",),
    ),
    Seed(
        "a judgement takes no more points than a fit learns from",
        "rtctl/cli/fit_judge.py",
        "require_enough(points, math.inf)",
        "require_enough(points)",
        (f"{JUDGE}::test_more_points_than_are_learned_from_are_judged",),
    ),
)
