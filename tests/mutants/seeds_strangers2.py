"""Seeded bugs in what is told of logs that somebody processed before: filled in, cut to whole steps, of odd
layouts.
"""

from __future__ import annotations

from seed import Seed

PROCESSED = "tests/unit/friction/test_processed_logs.py"
LAYOUTS = "tests/unit/hw/test_other_layouts.py"
REGRESSION = "tests/unit/friction/test_regression.py"
WORDS = "tests/unit/cli/test_words_of_a_linear_rig.py"

SEEDS = (
    Seed(
        "a column that was filled in by straight lines is taken as measured",
        "rtctl/friction/logs/row_faults.py",
        "hold(column, at) or drawn(column, at)",
        "hold(column, at)",
        (f"{PROCESSED}::test_a_column_that_was_filled_in_is_told_and_its_inertia_right",),
    ),
    Seed(
        "a curve goes through the value before where two straight lines go on alike",
        "rtctl/friction/logs/rows_in_turn.py",
        "return replace(found, taken=at[row], row=row, drawn=True)",
        "return replace(found, drawn=True)",
        (f"{PROCESSED}::test_a_column_that_was_filled_in_is_told_and_its_inertia_right",),
    ),
    Seed(
        "a column that was smoothed both ways is not told",
        "rtctl/friction/logs/log_checks.py",
        'any("it is of a slower" in note for note in noted)',
        "True",
        (f"{PROCESSED}::test_a_column_that_was_smoothed_both_ways_is_told",),
    ),
    Seed(
        "a torque that was cut to whole steps is taken for a rounded one",
        "rtctl/friction/logs/regression.py",
        "by = doubts(signals, late) + cut",
        "by = doubts(signals, late)",
        (f"{PROCESSED}::test_a_torque_whose_digits_were_cut_off_is_told_and_held_by_the_interval",),
    ),
    Seed(
        "whole steps are told although the log shows that they were rounded",
        "rtctl/friction/logs/whole_steps.py",
        "if found is not None and found.holds(0.0) and found.low > -HALF and found.high < HALF:",
        "if False:",
        (f"{PROCESSED}::test_a_torque_that_brakes_shows_that_it_was_rounded",),
    ),
    Seed(
        "a torque whose steps look neither cut nor rounded is taken for a rounded one",
        "rtctl/friction/logs/whole_steps.py",
        "found is not None and found.holds(0.0) and",
        "found is not None and",
        (f"{PROCESSED}::test_a_torque_whose_digits_were_cut_off_is_told_and_held_by_the_interval",),
    ),
    Seed(
        "whole steps are told where they change nothing",
        "rtctl/friction/logs/whole_steps.py",
        "if half_nm <= TOLD_CHANGE * coulomb_nm:",
        "if False:",
        (f"{PROCESSED}::test_steps_that_change_nothing_are_no_warning",),
    ),
    Seed(
        "what a log without slow rows cannot tell is not said",
        "rtctl/friction/logs/speeds_seen.py",
        "    if not lacking:\n        return ()",
        "    if lacking:\n        return ()",
        (f"{REGRESSION}::test_a_log_without_low_speeds_cannot_tell_what_is_there_and_warns_of_nothing",),
    ),
    Seed(
        "logs too short for a point each give no points, without a word",
        "rtctl/friction/logs/logs.py",
        "if {row[2] for row in rows} != {1, -1}:",
        "if False:",
        (f"{PROCESSED}::test_short_logs_are_told_for_short",),
    ),
    Seed(
        "a list in a cell is told for a row in which nothing was measured",
        "hw/playback/wrong_cells.py",
        'if cell.startswith(("[", "(")):',
        "if False:",
        (f"{LAYOUTS}::test_what_is_not_read_is_named_with_its_remedy",),
    ),
    Seed(
        "who has blocks of one stamp is told to keep a row of each",
        "hw/playback/rising.py",
        "if same > steps / 2:",
        "if False:",
        (f"{LAYOUTS}::test_what_is_not_read_is_named_with_its_remedy",),
    ),
    Seed(
        "who has a slow torque beside a quick position is told to keep the quick rows",
        "hw/playback/wrong_cells.py",
        "keep the rows of the slower one, with the other filled in",
        "fill one in and keep the rows of the other",
        (f"{LAYOUTS}::test_what_is_not_read_is_named_with_its_remedy",),
    ),
    Seed(
        "micronewton-metres are no unit",
        "hw/playback/units.py",
        '"µnm": "uN m", "μnm": "uN m", ',
        "",
        (f"{LAYOUTS}::test_what_is_not_read_is_named_with_its_remedy",),
    ),
    Seed(
        "the position of a carriage is told for a joint's angle",
        "hw/motion.py",
        'own = own.replace("joint angle", "position")',
        "pass",
        (f"{WORDS}::test_a_position_of_a_carriage_is_no_joint_angle",),
    ),
    Seed(
        "a polynomial of degree 12 has no bound of its twelfth derivative",
        "rtctl/friction/kind_polynomial.py",
        'if order < c.parameters["degree"]:',
        'if order <= c.parameters["degree"]:',
        (
            "tests/unit/friction/test_compile.py::"
            "test_a_polynomial_of_every_degree_that_a_file_may_have_is_compiled",
        ),
    ),
)
