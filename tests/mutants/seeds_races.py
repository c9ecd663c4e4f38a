"""Seeded bugs of answers that are older than what was asked before."""

from __future__ import annotations

from seed import Seed

SEEDS = (
    Seed(
        "`rtctl stop` takes a tick of before the stop for one after it",
        "rtctl/cli/operate.py",
        ' or now["command_seq_in_force"] < number:',
        ":",
        (
            "tests/unit/cli/test_one_object_and_its_code.py::"
            "test_a_motor_that_was_off_before_the_stop_is_no_success_of_it",
        ),
    ),
)
