"""Bugs in what an outsider's rig files found: rows on wrong units, lags that fill up a tick."""

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
        "    verdicts_of_slips.softness,\n",
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
    Seed(
        "a lag that fills up a tick is not tried",
        "rtctl/control/proofs/stability.py",
        "    if between.lag_hz > 0 and short > 0:\n",
        "    if between.lag_hz > 0 and short > 1:\n",
        ("tests/unit/control/test_sampled_loop.py",),
    ),
)
