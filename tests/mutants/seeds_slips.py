"""Bugs in the rows on wrong units that an outsider's rig files found."""

from __future__ import annotations

from seed import Seed

CHECK = ("tests/unit/cli/test_check_plausibility.py",)

SEEDS = (
    Seed(
        "a presliding length in degrees is believed",
        "rtctl/check/verdicts.py",
        "    verdicts_of_slips.presliding,\n",
        "",
        CHECK,
    ),
    Seed(
        "a coupling in N m per degree is believed",
        "rtctl/check/verdicts.py",
        "    verdicts_of_slips.stretch,\n",
        "",
        CHECK,
    ),
    Seed(
        "a delay in seconds is believed",
        "rtctl/check/verdicts.py",
        "    verdicts_of_slips.delay,\n",
        "",
        CHECK,
    ),
)
