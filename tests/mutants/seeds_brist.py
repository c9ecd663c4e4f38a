"""Seeded bugs of what an observer feeds to a joint that stands, and of the judge on MuJoCo's joints
(`rtctl.control.feeding`, `tests/foreign_engine`).
"""

from __future__ import annotations

from seed import Seed

PAYING = "tests/unit/control/test_paying.py"
ENGINE = "tests/unit/test_foreign_engine.py"

SEEDS = (
    Seed(
        "what low-passes remember of a stop is fed to a joint that stands in a turn",
        "rtctl/control/feeding.py",
        "            s.fed_slid_s[axis] = s.fed_standing_j[axis] = 0.0",
        "            s.fed_slid_s[axis] = 0.0",
        (
            f"{PAYING}"
            "::test_a_joint_that_stands_as_its_hand_turns_back_is_fed_nothing_by_what_low_passes_remember",
        ),
    ),
    Seed(
        "an observer that throws a joint which sticks between slips is sent",
        "rtctl/control/feeding.py",
        "        if s.rest_ticks[axis] == 0:",
        "        if s.rest_ticks[axis] < 0:",
        (f"{PAYING}::test_an_observer_that_pushes_a_joint_on_at_each_slip_is_taken_back",),
    ),
    Seed(
        "a run of MuJoCo's that diverged is judged",
        "tests/foreign_engine/sound.py",
        "for i, one in enumerate(d.warning) if one.number]",
        "for i, one in enumerate(d.warning) if one.number < 0]",
        (f"{ENGINE}::test_a_run_that_diverged_is_refused_by_name",),
    ),
    Seed(
        "of a joint that may hardly bend it is not told that more friction is left",
        "rtctl/check/verdicts_of_friction.py",
        "    if sure.may_be_shorter:\n",
        "    if False:\n",
        (
            "tests/unit/cli/test_check_friction.py"
            "::test_a_length_that_nobody_measured_is_not_proved_and_one_that_is_given_is",
        ),
    ),
)
