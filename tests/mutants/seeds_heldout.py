"""Seeded bugs of what one session says of the next, and of the choice beside the best rung."""

from __future__ import annotations

from seed import Seed

FORETOLD, OVER = "tests/unit/friction/test_foretold.py", "tests/unit/friction/test_over_best.py"

SEEDS = (
    Seed(
        "one session foretells the next as if its stretches were alike",
        "rtctl/friction/learn/bands.py",
        'held_out(points, sides, scores, apart=folds != "log")',
        "held_out(points, sides, scores)",
        (f"{FORETOLD}::test_what_stretches_of_one_session_differ_by_is_expected_of_the_next",),
    ),
    Seed(
        "a log of which no point is used counts as a session",
        "rtctl/friction/learn/hold_out.py",
        'points.columns["log"][points.rows_of(direction)]',
        'points.columns["log"][points.direction == direction]',
        (f"{FORETOLD}::test_a_log_of_which_no_point_is_used_is_no_session",),
    ),
    Seed(
        "the best rung judges itself by the points that chose it",
        "rtctl/friction/learn/over_best.py",
        "np.delete(theirs[name], at).sum()",
        "theirs[name].sum()",
        (f"{OVER}::test_the_best_of_equals_is_the_best_by_luck_and_not_on_other_points",),
    ),
    Seed(
        "the interval of the choice takes each point for one of its own",
        "rtctl/friction/learn/over_best.py",
        "return 0.5 * of_mean(squares[0] - squares[1], blocks)",
        "return 0.5 * of_mean(squares[0] - squares[1], np.arange(len(blocks)))",
        (f"{OVER}::test_the_interval_holds_the_ratio_of_two_and_goes_by_blocks",),
    ),
    Seed(
        "the page counts the sessions of one fold as one",
        "rtctl/friction/learn/nested.py",
        "for one in np.unique(session)]",
        "for one in np.unique(session)[:1]]",
        ("tests/unit/friction/test_nested.py::test_sessions_that_share_a_fold_are_told_one_by_one",),
    ),
)
