"""Seeded bugs that a strict reading of host, client, command line and recordings found."""

from __future__ import annotations

from seed import Seed

RARE = "tests/unit/recording/test_rare_recordings.py"
UNREAD = ("tests/unit/cli/test_unread_options.py::test_only_what_stands_on_the_command_line_is_refused",)

SEEDS = (
    Seed(
        "an option that no campaign reads is taken without a word",
        "rtctl/cli/unread.py",
        "if name in unread and",
        "if False and",
        UNREAD,
    ),
    Seed(
        "a rig that no daemon runs is said to have no late ticks, exit code 0",
        "rtctl/cli/doctor_watch.py",
        "    if not before:\n        raise NoReplyError(",
        "    if not before:\n        return\n        raise NoReplyError(",
        ("tests/unit/doctor/test_doctor_watch.py",),
    ),
    Seed(
        "Ctrl-C while pydantic makes a model goes nowhere",
        "rtctl/cli/__init__.py",
        'partition(".")[0] == "pydantic"\n',
        'partition(".")[0] == ""\n',
        (
            "tests/unit/cli/test_last_words.py::test_ctrl_c_where_it_would_go_nowhere_or_be_fatal_is_said_again",
        ),
    ),
    Seed(
        "a rig file that was edited while the start compiled is recorded as what ran",
        "rtctl/recording/setup.py",
        "if hashlib.sha256(text).hexdigest() == loaded.sha256:",
        "if True:",
        (f"{RARE}::test_a_rig_file_that_was_edited_since_it_was_read_is_not_recorded_as_what_ran",),
    ),
    Seed(
        "a disk that hangs at the end is waited for twice: systemd kills first",
        "rtctl/recording/recorder.py",
        "patience_s = 0.0 if self._ending else END_S",
        "patience_s = END_S",
        (f"{RARE}::test_a_disk_that_hangs_at_the_end_is_no_success",),
    ),
)
