"""Seeded bugs in what an outsider who checked issue 14 a third time found (decision 0168)."""

from __future__ import annotations

from seed import Seed

LOOP = "tests/unit/control/test_overshooting_loop.py"
ANSWER = "tests/unit/control/test_current_answer.py"
ROWS = "tests/unit/cli/test_check_own_loops.py"

SEEDS = (
    Seed(
        "a current that overshoots is proved as one of first order",
        "rtctl/control/proofs/stability.py",
        "    if between.overshoot > 0 and between.lag_hz > 0:\n",
        "    if False:\n",
        (f"{LOOP}::test_an_overshoot_costs_stiffness_and_less_of_it_is_covered",),
    ),
    Seed(
        "shares that are squared forget that the answer of a ringing loop has both signs",
        "rtctl/control/proofs/sampled_loop.py",
        "scale, mean = (1 + overshoot) / (1 - overshoot), ",
        "scale, mean = 1.0, ",
        (f"{LOOP}::test_where_shares_are_squared_an_answer_of_both_signs_counts_by_its_size",),
    ),
    Seed(
        "the test pulse does not see a current that exceeds its steps",
        "rtctl/control/current_overshoot.py",
        "if least > 0.0 and _ringing",
        "if least > step * step and _ringing",
        (f"{ANSWER}::test_a_current_that_exceeds_the_step_is_refused_unless_it_is_declared",),
    ),
    Seed(
        "noise of the current is an overshoot",
        "rtctl/control/current_overshoot.py",
        "variance = LAID_OVER * squares / (ticks - 1)",
        "variance = 0.0",
        (f"{ANSWER}::test_noise_is_no_overshoot",),
    ),
    Seed(
        "the damper of a joint proves a gear with play",
        "rtctl/check/verdicts_of_loop.py",
        "plays = link == 0 or axis.damping_needed_nms_rad <= in_play",
        "plays = True",
        (f"{ROWS}::test_what_the_damper_of_a_joint_proves_a_gear_with_play_does_not_have",),
    ),
)
