"""Seeded bugs in what an outsider who checked issue 14 a second time found (decision 0166)."""

from __future__ import annotations

from seed import Seed

SLOPE = "tests/unit/cli/test_check_slope.py"
PULSE = "tests/unit/test_pulse_of_the_plan.py"

SEEDS = (
    Seed(
        "a slope that no hand's motion is followed by is let pass",
        "rtctl/check/verdicts_of_motion.py",
        "refused = not calm and follows < SLOPE_SHARE * fast",
        "refused = False",
        (f"{SLOPE}::test_a_slope_that_follows_up_to_the_velocity_limit_passes_and_a_quarter_of_it_is_asked",),
    ),
    Seed(
        "what a late spring gives out is counted half",
        "rtctl/check/verdicts_of_motion.py",
        "min(0.42 * beyond, 0.27)",
        "min(0.21 * beyond, 0.13)",
        (f"{SLOPE}::test_the_bound_of_a_late_spring_is_above_every_swing_and_not_by_much",),
    ),
    Seed(
        "the test pulse spends the account of its own port",
        "rtctl/check/axis_plan.py",
        "gentle_nm, moved_nm, held_nm)",
        "gentle_nm, held_nm)",
        (f"{PULSE}::test_a_pulse_leaves_the_account_alone",),
    ),
    Seed(
        "the test pulse is over before a sample shows it",
        "rtctl/check/axis_plan.py",
        "return max(least, math.floor(",
        "return max(2, math.floor(",
        (f"{PULSE}::test_a_good_rig_passes_its_own_test",),
    ),
    Seed(
        "the test pulse asks for more than the empty account of a late motor can pay for",
        "rtctl/check/axis_plan.py",
        "moved_nm, held_nm)",
        "moved_nm)",
        (f"{PULSE}::test_a_pulse_leaves_the_account_alone",),
    ),
    Seed(
        "what the account may be short of is not asked",
        "rtctl/check/verdicts_of_slips.py",
        "+ FLOOR_FACTOR * passivity.budget_j,",
        "+ FLOOR_FACTOR * 0.0,",
        (f"{SLOPE}::test_energies_in_mj_are_told",),
    ),
)
