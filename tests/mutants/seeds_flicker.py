"""Seeded bugs of the readings that flicker (`rtctl.control.flicker`)."""

from __future__ import annotations

from seed import Seed

TESTS = "tests/unit/control/test_flicker.py"

SEEDS = (
    Seed(
        "a flicker of the encoder is answered",
        "rtctl/control/flicker.py",
        "    if s.reading_turns[axis] >= HELD_AFTER:\n        return s.reading_held_rad[axis]\n",
        "",
        (
            f"{TESTS}::test_a_flicker_between_two_counts_stands_still",
            f"{TESTS}::test_a_noisy_encoder_at_rest_stands_still",
        ),
    ),
    Seed(
        "a flicker is taken for the newest count, and its torque jumps by one",
        "rtctl/control/flicker.py",
        "s.reading_from_rad[axis] + s.reading_sum_rad[axis] / s.reading_ticks[axis]",
        "s.reading_rad[axis]",
        (f"{TESTS}::test_it_stands_where_the_readings_are_on_the_average",),
    ),
    Seed(
        "the end of a flicker kicks the joint",
        "rtctl/control/flicker.py",
        "            s.reading_gap_rad[axis] = s.reading_held_rad[axis] - s.reading_rad[axis]\n",
        "            s.reading_gap_rad[axis] = 0.0\n",
        (f"{TESTS}::test_what_is_left_when_a_flicker_ends_goes_slowly",),
    ),
    Seed(
        "a noisy encoder in slow motion goes by steps",
        "rtctl/control/flicker.py",
        "s.reading_ticks[axis] * p.period_s >= HELD_S",
        "s.reading_ticks[axis] * p.period_s >= 0.0",
        (f"{TESTS}::test_a_noisy_encoder_in_slow_motion_is_answered_as_it_is_read",),
    ),
    Seed(
        "a joint that nothing holds glides from edge to edge of a flicker",
        "rtctl/control/flicker.py",
        "if restart or p.flicker_held[axis] == 0.0 or s.state",
        "if restart or s.state",
        (f"{TESTS}::test_a_joint_that_friction_may_not_hold_or_that_nothing_couples_is_read_as_it_is",),
    ),
    Seed(
        "friction is trusted to hold twice what it does",
        "rtctl/friction/guarantee.py",
        "RELEASE_COUNTS = 3.5",
        "RELEASE_COUNTS = 1.5",
        (
            "tests/unit/cli/test_check_plausibility.py"
            "::test_a_stiffer_display_needs_more_friction_to_hold_a_flicker",
        ),
    ),
)
