"""Seeded bugs in what chance allows a right session."""

from __future__ import annotations

from seed import Seed

CHANCE = "tests/unit/friction/test_judged_by_chance.py"

SEEDS = (
    Seed(
        "a line is nearer to few right points by what two numbers win alone",
        "rtctl/friction/learn/report_judge.py",
        " / free * chance",
        " / free",
        (f"{CHANCE}::test_a_line_is_nearer_to_a_right_session_in_one_of_twenty_at_most",),
    ),
)
