"""Seeded bugs of what a kelvin changes (`rtctl.friction.learn.warmth`), of waves that the low-pass
weakens, and of a change of the friction."""

from __future__ import annotations

from seed import Seed

WARMTH = "rtctl/friction/learn/warmth.py"
SESSIONS = "tests/unit/friction/test_temperature_of_sessions.py"

WAVES = "tests/unit/friction/test_waves.py"

CHANGE = "tests/unit/friction/test_drift_change.py"

SEEDS = (
    Seed(
        "a joint that slides seldom one way is told nothing",
        "rtctl/friction/drift_strokes.py",
        "kept[np.flatnonzero(way)[-KEPT_STROKES:]] = True",
        "kept[-2 * KEPT_STROKES :] = True",
        ("tests/unit/friction/test_drift_window.py",),
    ),
    Seed(
        "sessions at their own temperatures count row by row",
        WARMTH,
        "_blocks(points)[kept], told",
        "np.arange(len(kept)), told",
        (f"{SESSIONS}::test_two_sessions_tell_no_error_and_say_so",
         f"{SESSIONS}::test_the_truth_lies_within_two_standard_errors_of_few_sessions"),
    ),
    Seed(
        "five sessions know their spread as well as many do",
        WARMTH,
        "t.ppf(norm.cdf(2), max(freedom, 1.0)) / 2",
        "1.0",
        (f"{SESSIONS}::test_the_truth_lies_within_two_standard_errors_of_few_sessions",),
    ),
    Seed(
        "the warmth of a point is in the curve that goes through it",
        WARMTH,
        "points.friction_nm[kept], _blocks",
        "points.friction_nm[kept] - curve, _blocks",
        (f"{SESSIONS}::test_a_curve_that_goes_through_few_points_takes_no_warmth_away",),
    ),
    Seed(
        "oil that thins is dry friction that falls",
        WARMTH,
        "for part in (dry, viscous)]",
        "for part in (dry, 0 * viscous)]",
        (f"{SESSIONS}::test_oil_that_thins_is_not_dry_friction_that_falls",),
    ),
    Seed(
        "what waves and motion have in common is known",
        "rtctl/friction/logs/other_readings.py",
        "offset.drift, signals.besides]",
        "offset.drift]",
        (f"{WAVES}::test_what_waves_and_motion_have_in_common_is_in_the_interval",),
    ),
    Seed(
        "the pitch of waves is as it was found first",
        "rtctl/friction/logs/waves.py",
        "for which in range(6)]",
        "for which in range(4)]",
        (f"{WAVES}::test_waves_quicker_than_the_low_pass_are_taken_out_as_it_leaves_them",),
    ),
    Seed(
        "strokes on the border of a change stay for the whole window",
        "rtctl/friction/drift_change.py",
        "strokes.border = BORDER",
        "strokes.border = 0",
        (f"{CHANGE}::test_a_factor_is_not_between_what_was_and_what_is",),
    ),
)  # fmt: skip
