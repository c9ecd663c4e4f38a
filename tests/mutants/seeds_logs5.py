"""Seeded bugs in what a log says of springs and of a rig file's figures (decision 0167)."""

from __future__ import annotations

from seed import Seed

RIG = "tests/unit/friction/test_plausibility.py"
SPRINGS = "tests/unit/friction/test_springs.py"

SEEDS = (
    Seed(
        "friction that goes by the place is a spring",
        "rtctl/friction/logs/springs.py",
        "abs(turned) > ALIKE * abs(both)",
        "abs(turned) > 1e9 * abs(both)",
        (f"{SPRINGS}::test_what_is_no_spring_stays",),
    ),
    Seed(
        "the spring stays in the friction points",
        "rtctl/friction/logs/log_input.py",
        "friction = friction - found[name].value * column",
        "friction = friction - 0.0 * column",
        (f"{SPRINGS}::test_the_points_are_without_the_spring",),
    ),
    Seed(
        "a spring is told by itself where gravity looks alike",
        "rtctl/friction/logs/springs.py",
        "left.rest < TOLD_APART * fits[k].rest",
        "left.rest < 0.0 * fits[k].rest",
        (f"{SPRINGS}::test_over_a_short_travel_gravity_and_a_spring_are_told_together",),
    ),
    Seed(
        "gravity and a spring that are alike refuse the joint",
        "rtctl/friction/logs/least_squares.py",
        "if not by_place:",
        "if True:",
        (f"{SPRINGS}::test_over_a_short_travel_gravity_and_a_spring_are_told_together",),
    ),
    Seed(
        "a motor's turned sign is a spring",
        "rtctl/friction/logs/springs.py",
        "return not explained_as_well(balance, plain, fit)",
        "return True",
        (f"{SPRINGS}::test_a_motor_that_plays_a_spring_with_its_sign_turned_is_no_spring",),
    ),
    Seed(
        "the steps of an encoder tell no unit",
        "rtctl/friction/logs/against_rig.py",
        "abs(ratio / factor - 1) < SAME_STEP",
        "abs(ratio / factor - 1) < -SAME_STEP",
        (f"{RIG}::test_the_steps_of_an_encoder_tell_the_unit_of_a_position",),
    ),
    Seed(
        "less dry friction than the rig promises is no word",
        "rtctl/friction/logs/against_rig.py",
        "coulomb.high < axis.dry_friction_nm",
        "coulomb.high < 0.0 * axis.dry_friction_nm",
        (f"{RIG}::test_parameters_that_contradict_the_rig_file_are_said",),
    ),
    Seed(
        "a motion of one frequency hides a spring, and nothing says so",
        "rtctl/friction/logs/springs.py",
        "own.std() > OWN_LEAST * x.std()",
        "own.std() > -OWN_LEAST * x.std()",
        (f"{SPRINGS}::test_a_motion_of_one_frequency_tells_no_spring",),
    ),
)
