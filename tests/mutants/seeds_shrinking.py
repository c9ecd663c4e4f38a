"""Seeded bugs of what tells a hand that swings out from one that moves the joint, and of a slow one."""

from __future__ import annotations

from seed import Seed

SEEDS = (
    Seed(
        "strokes that shrink are helped whole",
        "rtctl/control/law.py",
        " * steady_share(t, s, p, axis)",
        "",
        ("tests/unit/control/test_shrinking.py::test_the_law_sends_the_rest_only",),
    ),
    Seed(
        "a slower peak is believed before it is one",
        "rtctl/control/shrinking.py",
        "if _is_over(t, s, p, axis, speed) or wanted",
        "if True or wanted",
        ("tests/unit/control/test_shrinking.py",),
    ),
    Seed(
        "a joint that soft bristles stop after its turn has had its peak",
        "rtctl/control/shrinking.py",
        "return not push > p.friction_gate_deadband_nm[axis]",
        "return True",
        ("tests/unit/control/test_shrinking.py",),
    ),
    Seed(
        "a hand that holds still is helped again by waiting",
        "rtctl/control/shrinking.py",
        "if not speed > own_rad(p, axis, CREEP_RAD_S):",
        "if not speed >= 0.0:",
        (
            "tests/unit/control/test_shrinking.py"
            "::test_a_hand_that_holds_still_is_not_helped_again_by_waiting",
        ),
    ),
    Seed(
        "a joint without power remembers its strokes",
        "rtctl/control/shrinking.py",
        "if not is_powered(s.state) or is_admittance",
        "if is_admittance",
        ("tests/unit/control/test_shrinking.py",),
    ),
    Seed(
        "a slow hand is thrown by the whole observer",
        "rtctl/control/disturbance_observer.py",
        "torque *= _paced(s, p, axis)",
        "pass",
        (
            "tests/unit/control/test_observer_at_rest.py"
            "::test_a_slow_hand_is_left_half_of_it_on_top_of_a_feedforward_as_slowly_as_a_gate",
        ),
    ),
)
