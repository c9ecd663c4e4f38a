"""Seeded bugs of files that were read once more: what is printed, kept or taken on is not what is so."""

from __future__ import annotations

from seed import Seed

ROUNDED = (
    "tests/unit/test_rounded.py::"
    "test_what_is_printed_is_on_the_side_that_passes_and_as_near_as_its_digits_say"
)

SEEDS = (
    Seed(
        "a bound that is printed to be kept above is rounded below it",
        "rtctl/rounded.py",
        "digits, ROUND_CEILING)",
        "digits, ROUND_FLOOR)",
        (ROUNDED,),
    ),
    Seed(
        "energy that a hand may be given is told rounded down",
        "rtctl/check/verdicts_of_friction.py",
        "{up(sure.given_most_j * 1e3)}",
        "{down(sure.given_most_j * 1e3)}",
        (
            "tests/unit/cli/test_check_friction.py::"
            "test_the_shipped_mock_passes_every_row_and_says_what_a_hand_can_be_given",
        ),
    ),
    Seed(
        "a short carriage is told to identify at 0 m/s",
        "rtctl/identify/session.py",
        "{down(0.98 * fastest_rad_s(motion))}",
        "{0.98 * fastest_rad_s(motion):.2f}",
        ("tests/unit/identify/test_session.py::test_a_short_carriage_is_told_a_speed_that_fits_too",),
    ),
    Seed(
        "slopes beyond the speed that is asked about count",
        "rtctl/friction/kind_cubic.py",
        "            if start < speed_max:\n",
        "            if True:\n",
        (
            "tests/unit/friction/test_tables.py::"
            "test_what_lies_beyond_the_speed_that_is_asked_about_tells_nothing_of_it",
        ),
    ),
    Seed(
        "how a run ended is lost with the ticks that a slow disk has dropped",
        "rtctl/recording/recorder.py",
        "if self._last is not None and (events or len(commands)):",
        "if False:",
        ("tests/unit/recording/test_recorder.py::test_a_slow_disk_drops_ticks_but_never_holds_up_the_giver",),
    ),
    Seed(
        "a setting that nobody here knows is passed over by a resume",
        "rtctl/identify/dataset_files.py",
        "if not isinstance(settings, dict) or not settings.keys() <= ours:",
        "if False:",
        (
            "tests/unit/identify/test_dataset.py::"
            "test_a_setting_of_a_later_version_is_told_and_not_passed_over",
        ),
    ),
)
