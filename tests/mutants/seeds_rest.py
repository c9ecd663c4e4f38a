"""Seeded bugs of the friction at rest, and of a motion that comes to rest in between, in an
identification.
"""

from __future__ import annotations

from seed import Seed

SEEDS = (
    Seed(
        "a break-away below what the slowest speeds hold is kept",
        "rtctl/identify/rest.py",
        "wanted = held if",
        "wanted = abs(ramp_nm) if",
        ("tests/unit/identify/test_rest.py",),
    ),
    Seed(
        "slow speeds that chance puts first end an identification",
        "rtctl/identify/session.py",
        "if not any(task.speed_rad_s >= top_rad_s for task in todo):",
        "if todo:",
        (
            "tests/unit/identify/test_difficult_joints.py"
            "::test_where_only_quick_speeds_become_steady_no_order_of_the_speeds_ends_it",
        ),
    ),
)
