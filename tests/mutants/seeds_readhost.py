"""Seeded bugs that a strict reading of host, client, command line and recordings found."""

from __future__ import annotations

from seed import Seed

UNREAD = ("tests/unit/cli/test_unread_options.py",)

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
        'partition(".")[0] == "pydantic":',
        'partition(".")[0] == "":',
        ("tests/unit/cli/test_last_words.py",),
    ),
    Seed(
        "a disk that hangs at the end is waited for twice: systemd kills first",
        "rtctl/recording/recorder.py",
        "patience_s = 0.0 if self._ending else END_S",
        "patience_s = END_S",
        ("tests/unit/recording/test_rare_recordings.py",),
    ),
)
