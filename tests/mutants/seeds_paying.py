"""Seeded bugs of what a hand pays for, and of what the observer feeds (`rtctl.control.paying`,
`rtctl.control.feeding`).
"""

from __future__ import annotations

from seed import Seed

TESTS = "tests/unit/control/test_paying.py"

SEEDS = (
    Seed(
        "a swing that nobody feeds is helped on",
        "rtctl/control/law.py",
        "    share *= paid_share(t, s, p, axis, elapsed)\n",
        "",
        (f"{TESTS}::test_the_law_sends_as_much_as_both_leave",),
    ),
    Seed(
        "a swing that nobody feeds pays for nothing and is helped",
        "rtctl/control/paying.py",
        " - LEAST * s.friction_credit_j[axis]",
        "",
        (f"{TESTS}::test_a_swing_that_nobody_feeds_loses_its_help",),
    ),
    Seed(
        "what the joint's inertia lends is taken for payment",
        "rtctl/control/paying.py",
        "(dx + s.paid_rad[axis]) - 0.5 * p.inertia_kgm2[axis]",
        "(dx + s.paid_rad[axis]) - 0.0 * p.inertia_kgm2[axis]",
        (
            f"{TESTS}::test_who_pays_for_some_of_the_friction_is_helped_whole_whatever_the_inertia_lends",
            f"{TESTS}::test_a_swing_that_nobody_feeds_loses_its_help",
        ),
    ),
    Seed(
        "what is paid comes and goes in step with a ring",
        "rtctl/control/paying.py",
        "min(GATE_TIMES * p.rest_alpha[axis], 1.0) * (left",
        "1.0 * (left",
        (
            f"{TESTS}"
            "::test_help_does_not_come_and_go_in_step_with_a_ring_whose_inertia_is_another_than_was_said",
        ),
    ),
    Seed(
        "an observer that feeds a ring is sent",
        "rtctl/control/law.py",
        "    t.observer_torque_nm[axis] *= unfed_share(s, p, axis, elapsed)\n",
        "",
        (f"{TESTS}::test_the_law_sends_as_much_as_both_leave",),
    ),
    Seed(
        "an observer that damps a ring is taken back",
        "rtctl/control/feeding.py",
        "(FED_MOST * p.viscous_nms_rad[axis] * v - acted) * v * T",
        "-abs(FED_MOST * p.viscous_nms_rad[axis] * v - acted) * abs(v) * T",
        (f"{TESTS}::test_an_observer_that_damps_a_ring_and_one_in_a_turn_are_left_alone",),
    ),
    Seed(
        "an observer that was taken back never comes again",
        "rtctl/control/feeding.py",
        " + forgotten * (bank - s.fed_j[axis])",
        "",
        (f"{TESTS}::test_what_was_fed_is_forgotten_within_seconds",),
    ),
)
