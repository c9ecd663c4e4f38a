"""Seeded bugs of failures of the system that nobody had tried: a zero of other devices, an upgrade at any
moment, what is asked for again."""

from __future__ import annotations

from seed import Seed

ZERO = "tests/unit/host/test_force_zero.py::test_a_zero_of_other_devices_judges_too_and_is_said_to_be_one"
FILE = "rtctl/host/exchange/force_zero.py"

SEEDS = (
    Seed(
        "a zero of other devices says nothing, and the first one passes unjudged",
        FILE,
        "self._take_up(kept)\n",
        "self._take_up({} if self._others else kept)\n",
        (ZERO,),
    ),
    Seed(
        "a zero that was accepted stays one of other devices",
        FILE,
        "            self._others = False\n",
        "",
        (ZERO,),
    ),
    Seed(
        "an experiment that is resumed does not know what was reported",
        "rtctl/experiments/kept_runs.py",
        "if not (resume and there.exists()):",
        "if True:",
        (
            "tests/unit/experiments/test_kept_runs.py::"
            "test_what_was_reported_is_where_a_start_with_resume_begins_and_another_one_does_not",
        ),
    ),
)
