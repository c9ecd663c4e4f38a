"""Seeded bugs of the friction at rest, of a motion that comes to rest in between, and of the rest: what was
left over elsewhere.
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
    Seed(
        "a CAN board that heard no stop is sent counts that begin anew after a re-plug",
        "hw/can/board_backend.py",
        "sent.stop(bus)\n        for frame in self._poll:",
        "sent.send(bus, (), (), False)\n        for frame in self._poll:",
        ("tests/unit/hw/test_stop_sequence.py",),
    ),
    Seed(
        "the count of a CAN board with idle bytes begins anew after a re-plug",
        "hw/can/board_out.py",
        "self._counter[1].count = before._counter[1].count",
        "self._counter[1].count = 0",
        ("tests/unit/hw/test_stop_sequence.py",),
    ),
)
