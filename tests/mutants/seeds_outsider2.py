"""Seeded bugs in what an outsider who checked issue 17 again found (decision 0154)."""

from __future__ import annotations

from seed import Seed

UNITS = "tests/unit/hw/test_units_of_attributes.py"
SENTENCES = "tests/unit/friction/test_sentences.py"
PLAYBACK = "tests/unit/test_playback_doubts.py"
POINTS = "tests/unit/friction/test_points_check.py"

SEEDS = (
    Seed(
        "a unit that an HDF5 file keeps beside a column is not heard",
        "hw/playback/matlab_hdf.py",
        "return Table(reader.found, units_beside(reader.found, reader.spelt, between) | reader.units)",
        "return Table(reader.found)",
        (f"{UNITS}::test_a_torque_of_which_the_file_says_another_unit_is_refused",),
    ),
    Seed(
        "an error that has a reason is one of another session",
        "rtctl/friction/learn/report_sentences.py",
        "if times > AGREES and told:",
        "if False:",
        (f"{SENTENCES}::test_the_page_confronts_its_headline_with_test_points_that_contradict_it",),
    ),
    Seed(
        "points that are missing speak against a model",
        "rtctl/friction/learn/report_judge.py",
        "if one.rmse_nm is not None)",
        "if one)",
        (f"{SENTENCES}::test_points_that_are_missing_do_not_speak_against_a_model",),
    ),
    Seed(
        "what sessions differ by is scatter",
        "rtctl/friction/logs/points_check.py",
        "found += parts if",
        "found += [rows] if",
        (f"{POINTS}::test_what_sessions_differ_by_is_no_scatter",),
    ),
    Seed(
        "an inertia that turns blur is taken in silence",
        "rtctl/simulation/playback_doubts.py",
        "if _is_blurred(inertia, found.inertia_kgm2)",
        "if _is_blurred(dry, found.coulomb_nm)",
        (f"{PLAYBACK}::test_an_inertia_that_turns_blur_is_told_where_nobody_gave_one",),
    ),
    Seed(
        "a log in mN m is judged beside those in N m",
        "rtctl/simulation/playback_job.py",
        "*learned.warnings, *doubts",
        "*learned.warnings, *doubts[:0]",
        (f"{PLAYBACK}::test_a_log_in_another_unit_than_those_that_friction_is_of_is_told",),
    ),
)
