"""Seeded bugs of friction points: their levels of speed, signs and sessions, and those that are bad."""

from __future__ import annotations

from seed import Seed

SCORING = "tests/unit/friction/test_honest_scoring.py"

BETWEEN = ("tests/unit/friction/test_between_speeds.py",)

SEEDS = (
    Seed(
        "two points have a noise that is no number",
        "rtctl/friction/learn/grids.py",
        "/ 0.6745 if len(size) else 0.0,",
        "/ 0.6745,",
        ("tests/unit/friction/test_foretold.py",),
    ),
    Seed(
        "a formula of more numbers than the first sessions have points refuses the whole fit",
        "rtctl/friction/learn/foretold.py",
        "except (FailedFitError, UnidentifiableError):",
        "except FailedFitError:",
        ("tests/unit/friction/test_foretold.py",),
    ),
    Seed(
        "the ends of a session held out tell where it lies",
        "rtctl/friction/learn/hold_out.py",
        "whole = 2 * measured.sum(axis=1) >= measured.any(axis=0).sum()",
        "whole = measured.any(axis=1)",
        BETWEEN,
    ),
    Seed(
        "what a curve does between the speeds of sessions is not looked at",
        "rtctl/friction/learn/search.py",
        'None if level is None else folds_of(points, directions, "speed")',
        "None",
        BETWEEN,
    ),
    Seed(
        "curves are compared by what their sessions differ by",
        "rtctl/friction/learn/score.py",
        "[less_shared(*one) for one in known]",
        "[one for one, _ in known]",
        BETWEEN,
    ),
    Seed(
        "a machine may lie at one of its sessions",
        "rtctl/friction/learn/ladder.py",
        "train(one, data.speed, data.learned_nm(), data.weight)",
        "train(one, data.speed, data.friction_nm, data.weight)",
        BETWEEN,
    ),
    Seed(
        "repeats of one nominal speed vouch for each other",
        "rtctl/friction/points.py",
        "if not starts or one > LEVEL_WIDTH * starts[-1]:",
        "if not starts or one > starts[-1]:",
        ("tests/unit/friction/test_folds.py",),
    ),
    Seed(
        "the viscous slope is that between repeats of one speed",
        "rtctl/friction/learn/fit.py",
        "level_starts(speed)[-4:][0])",
        "np.unique(speed)[-4:][0])",
        ("tests/unit/friction/test_folds.py",),
    ),
    Seed(
        "repeats of a speed are sorted by friction before their scatter is asked for",
        "rtctl/friction/logs/points_check.py",
        "rows = np.sort(points.rows_of(direction))",
        "rows = points.rows_of(direction)",
        ("tests/unit/friction/test_points_check.py",),
    ),
    Seed(
        "points in columns of our names are believed",
        "rtctl/cli/fit.py",
        "    fit_points.tell_doubts(measured, known=plan.loaded is not None",
        "    (lambda *a, **b: None)(measured, known=plan.loaded is not None",
        ("tests/unit/cli/test_fit_points.py",),
    ),
    Seed(
        "sessions of one file are one log",
        "rtctl/friction/logs/other_programs.py",
        "if 0 < over.sum() <= RESTARTS_SHARE",
        "if 0 > over.sum() <= RESTARTS_SHARE",
        ("tests/unit/cli/test_fit_points.py",),
    ),
    Seed(
        "friction without a sign is told like one with an offset",
        "rtctl/friction/points.py",
        "if any(np.array_equal(against, direction == one) for one in (1, -1)):",
        "if False:",
        ("tests/unit/friction/test_points.py",),
    ),
    Seed(
        "a bad point makes its neighbours bad",
        "rtctl/friction/outliers.py",
        "return _contradicted(speed, friction, ~bad) if bad.any() else (expected, bad)",
        "return expected, bad",
        (f"{SCORING}::test_a_bad_point_makes_none_of_its_neighbours_bad",),
    ),
    Seed(
        "two bad points of fifty are how the joint is",
        "rtctl/friction/outliers.py",
        "math.ceil(MOST_SHARE * len(rows))",
        "int(0.03 * len(rows))",
        (f"{SCORING}::test_two_bad_points_of_50_are_mistakes",),
    ),
    Seed(
        "columns of a screw cannot be judged",
        "rtctl/cli/fit_judge.py",
        '    "lead_m",\n',
        "",
        ("tests/unit/cli/test_fit_judge.py::test_columns_of_a_screw_are_judged_as_they_were_learned",),
    ),
)
