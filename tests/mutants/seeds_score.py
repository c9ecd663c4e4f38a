"""Seeded bugs of what is told of the next session, and of curves whose numbers are not told."""

from __future__ import annotations

from seed import Seed

FORETOLD = "tests/unit/friction/test_foretold.py"
TOLD = (f"{FORETOLD}::test_eight_of_ten_next_sessions_err_what_is_told_however_few_are_known",)
OWN = (f"{FORETOLD}::test_what_is_each_errors_own_is_known_by_many_and_less_of_the_next",)
WEAR = (f"{FORETOLD}::test_wear_is_told_and_widens_the_band_and_days_are_not",)
CURVE = (
    "tests/unit/friction/test_mean.py"
    "::test_a_formula_that_is_refused_for_its_numbers_alone_has_a_share_as_a_curve",
)
REST = (
    "tests/unit/friction/test_baselines.py"
    "::test_a_peak_below_the_slowest_speed_says_of_rest_little_more_than_was_seen",
)
CERTAINTY, LADDER = "rtctl/friction/learn/certainty.py", "rtctl/friction/learn/ladder.py"

SEEDS = (
    Seed(
        "two sessions know the spread of sessions by two numbers",
        CERTAINTY,
        "shared * fdtri(1, sessions - 1, ends)",
        "shared * fdtri(1, sessions, ends)",
        TOLD,
    ),
    Seed(
        "the next session is held against as few others as one held out",
        CERTAINTY,
        "np.sqrt((1 - 1 / sessions**2) * square)",
        "np.sqrt(square)",
        OWN,
    ),
    Seed(
        "the range of the next session does not know of wear",
        "rtctl/friction/learn/foretold.py",
        "return times * low, times * high",
        "return low, high",
        WEAR,
    ),
    Seed(
        "a peak below the slowest speed says anything of rest",
        "rtctl/friction/learn/formulas.py",
        "(0.1 if speed.min() == 0 else 1.0) * slowest",
        "0.1 * slowest",
        REST,
    ),
    Seed(
        "a formula that is refused for its numbers has no share",
        LADDER,
        "_usable(rung.curve, points, sides) if rung.untold else rung for rung",
        "rung for rung",
        CURVE,
    ),
    Seed(
        "a curve without its numbers is not deployed alone",
        LADDER,
        "return mean.alone(one, choice) if one.untold else choice",
        "return choice",
        CURVE,
    ),
)
