"""Seeded bugs of the watch on a joint that trembles (`rtctl.control.trembling`)."""

from __future__ import annotations

from seed import Seed

UNIT = "tests/unit/control"

SEEDS = (
    Seed(
        "a joint that trembles is helped",
        "rtctl/control/law.py",
        "    share *= calm_share(s, p, axis)\n",
        "",
        (
            f"{UNIT}/test_trembling.py"
            "::test_the_law_sends_no_help_to_a_joint_that_trembled_until_it_is_moved_on",
        ),
    ),
    Seed(
        "help comes back to a joint that has come to rest, and shakes it again",
        "rtctl/control/trembling.py",
        "        and abs(s.turn_rad[axis] - s.turn_from_rad[axis]) > own_rad(p, axis, ON_RAD)\n",
        "",
        (
            f"{UNIT}/test_trembling.py"
            "::test_help_does_not_come_back_at_rest_or_in_a_creep_but_when_a_hand_moves_the_joint_on",
        ),
    ),
    Seed(
        "help comes back at once, and pushes the hand that trembled",
        "rtctl/control/trembling.py",
        "- FORGETTING * p.period_s",
        "- 10.0 * FORGETTING * p.period_s",
        (
            f"{UNIT}/test_trembling.py"
            "::test_help_does_not_come_back_at_rest_or_in_a_creep_but_when_a_hand_moves_the_joint_on",
        ),
    ),
    Seed(
        "a hand that turns back slowly trembles",
        "rtctl/control/trembling.py",
        "if s.turn_s[axis] <= p.tremble_turn_s[axis]:",
        "if s.turn_s[axis] <= 20.0 * p.tremble_turn_s[axis]:",
        (f"{UNIT}/test_trembling.py::test_a_hand_that_moves_to_and_fro_is_helped_whole",),
    ),
    Seed(
        "the flicker of an encoder trembles",
        "rtctl/control/trembling.py",
        "elif on < -max(TURN_COUNTS * p.count_rad[axis], REST_SHARE * p.presliding_rad[axis]):",
        "elif on < 0.0:",
        (f"{UNIT}/test_trembling.py::test_an_encoder_that_flickers_between_counts_turns_nothing",),
    ),
    Seed(
        "a joint that was shaken without power is not helped",
        "rtctl/control/trembling.py",
        "if not is_powered(s.state):",
        "if False:",
        (f"{UNIT}/test_trembling.py::test_what_shook_a_joint_without_power_is_forgotten",),
    ),
)
