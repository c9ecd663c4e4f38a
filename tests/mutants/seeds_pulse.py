"""The shape of a current loop: what a file that does not say is proved for, and what many pulses tell."""

from __future__ import annotations

from seed import Seed

SHAPE = "tests/unit/identify/test_current_shape.py"
LOOP = "tests/unit/control/test_overshooting_loop.py"
ROWS = "tests/unit/cli/test_check_own_loops.py"

SEEDS = (
    Seed(
        "a current loop of which the file says nothing is taken for one of first order",
        "rtctl/rig_file/axis_tables.py",
        "default=OVERSHOOT_UNTOLD,",
        "default=0.0,",
        (f"{LOOP}::test_a_file_that_does_not_say_is_proved_for_what_the_test_pulse_lets_pass",),
    ),
    Seed(
        "nobody tells how a coupling passes behind a loop of first order",
        "rtctl/check/verdicts_of_loop.py",
        "{pair}{of_first_order(s)}",
        "{pair}",
        (f"{ROWS}::test_a_coupling_that_a_loop_of_first_order_bears_is_told_how_to_say_that_it_is_one",),
    ),
    Seed(
        "a ringing answer counts with its sign",
        "rtctl/control/proofs/sampled_loop.py",
        "found = (-1) ** begun * left + 2 * ",
        "found = left + 0 * ",
        (f"{LOOP}::test_where_shares_are_squared_an_answer_of_both_signs_counts_by_its_size",),
    ),
    Seed(
        "of all shapes that may be the best one is declared",
        "rtctl/identify/current_shape.py",
        "possible = tuple(fits[i] for i in range(first, last + 1))",
        "possible = (best,)",
        (f"{SHAPE}::test_what_is_declared_is_what_the_coupling_bears_least_of_all_that_may_be",),
    ),
    Seed(
        "a loop of another kind is told as one that overshoots",
        "rtctl/identify/current_shape.py",
        "    if surely and beyond > ",
        "    if False and beyond > ",
        (f"{SHAPE}::test_the_shape_is_told_and_the_range_holds_the_overshoot",),
    ),
    Seed(
        "a stop by somebody else does not end the pulses",
        "rtctl/identify/pulses.py",
        '        if int(last["epoch"]) > self._epoch:\n',
        "        if False:\n",
        (f"{SHAPE}::test_a_stop_by_somebody_else_ends_the_pulses",),
    ),
    Seed(
        "held samples are judged as a loop's answer",
        "rtctl/control/current_overshoot.py",
        "    if p.proof_age_ticks[axis] > 0:\n",
        "    if p.proof_age_ticks[axis] < 0:\n",
        ("tests/acceptance/test_foreign_rigs.py::test_certified_rigs_of_another_make_rest_in_every_hand",),
    ),
)
