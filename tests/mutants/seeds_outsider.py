"""Seeded bugs in what an outsider who checked issue 17 found (decision 0148)."""

from __future__ import annotations

from seed import Seed

TORQUES = "tests/unit/friction/test_torque_faults.py"
COMMANDS = "tests/unit/friction/test_labs_commands.py"
SHAPE = "tests/unit/friction/test_torque_shape.py"
STAMPS = "tests/unit/hw/test_playback_stamps.py"

SEEDS = (
    Seed(
        "rows stamped as their packet arrived are short stretches between gaps",
        "hw/playback/stamps.py",
        "if _is_of_arrival(time_s, gaps):",
        "if False:",
        (f"{STAMPS}::test_rows_that_are_stamped_as_a_packet_arrives_are_given_their_rate",),
    ),
    Seed(
        "regular strokes with pauses are taken for packets",
        "hw/playback/stamps.py",
        "longest < BUNCH_S",
        "True",
        (f"{STAMPS}::test_strokes_with_pauses_between_them_are_no_packets",),
    ),
    Seed(
        "stamps of even rows that jitter are not told",
        "hw/playback/rising.py",
        "if not over_even < SMOOTHER * over_stamps:",
        "if True:",
        (f"{STAMPS}::test_stamps_that_jitter_where_the_rows_do_not_are_told_and_no_others",),
    ),
    Seed(
        "a dead band of the torque is not told",
        "rtctl/friction/logs/dead_band.py",
        "if near.mean() < NEAR_SHARE or",
        "if near.mean() > NEAR_SHARE or",
        (f"{TORQUES}::test_a_torque_with_a_dead_band_is_told_and_steps_and_a_motor_that_is_off_are_not",),
    ),
    Seed(
        "strokes of a slow log are spikes",
        "rtctl/friction/logs/row_faults.py",
        "if not few and not rows.alike:",
        "if not few:",
        (f"{COMMANDS}::test_strokes_of_few_rows_of_a_slow_log_are_no_certain_fault",),
    ),
    Seed(
        "a torque whose scale differs between its signs is not told",
        "rtctl/friction/logs/two_gains.py",
        "abs(found.value) > LEAST",
        "abs(found.value) < LEAST",
        (
            f"{SHAPE}::test_a_torque_whose_scale_differs_between_its_signs_is_told_and_friction_that_does_is_not",
        ),
    ),
    Seed(
        "three waves of a sweep are told as four",
        "rtctl/friction/learn/cogging.py",
        "while count - too_few > 1:",
        "while False:",
        ("tests/unit/friction/test_cogging.py::test_three_waves_are_not_told_as_four",),
    ),
)
