"""Seeded bugs in what a ninth look at logs found (decision 0178)."""

from __future__ import annotations

from seed import Seed

CLOCKS = "tests/unit/hw/test_other_clocks.py"

SEEDS = (
    Seed(
        "a clipped log is counted beside sound ones",
        "rtctl/friction/logs/log_checks.py",
        "return found if len(found) < len(logs) else {}",
        "return {}",
        ("tests/unit/friction/test_clipping.py::"
            "test_of_several_logs_the_one_that_is_clipped_is_named_and_left_out",),
    ),
    Seed(
        "a wall clock beside the time is not looked at",
        "hw/playback/text_table.py",
        "clocks += other_clocks.beside(",
        "clocks += () and other_clocks.beside(",
        (CLOCKS,),
    ),
    Seed(
        "a rate above the header is not looked at",
        "hw/playback/other_clocks.py",
        "match = _SAID.match(line)",
        "match = None",
        (CLOCKS,),
    ),
    Seed(
        "an emergency stop that ends before it begins is silent",
        "hw/simulators/mock_options.py",
        "if self.estop_to_s < self.estop_from_s:",
        "if False:",
        ("tests/unit/hw/test_mock_options.py",),
    ),
    Seed(
        "a smoothed position turns its friction over at once",
        "rtctl/friction/logs/smoothed.py",
        "turned = np.column_stack([balance.acceleration, balance.velocity, means[rows, 1]])",
        "turned = balance.motion",
        ("tests/unit/friction/test_processed_logs.py::"
            "test_a_smoothed_position_turns_its_friction_over_as_slowly",),
    ),
    Seed(
        "an echo is a torque that is late",
        "rtctl/friction/logs/late_torques.py",
        "if delay > 0 and (again := _echo(balance, plain, one)):",
        "if False and (again := _echo(balance, plain, one)):",
        ("tests/unit/friction/test_processed_logs.py::"
            "test_an_echo_of_the_torque_is_told_and_a_late_torque_is_none",),
    ),
    Seed(
        "test points are held against what was held out alone",
        "rtctl/friction/learn/report_sentences.py",
        "before_nm = max(held_out_nm, expected_nm)",
        "before_nm = held_out_nm",
        ("tests/unit/friction/test_sentences.py::"
            "test_test_points_are_held_against_what_was_expected_of_the_next_session",),
    ),
)  # fmt: skip
