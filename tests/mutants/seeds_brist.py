"""Seeded bugs of the judge on MuJoCo's joints (`tests/foreign_engine`)."""

from __future__ import annotations

from seed import Seed

ENGINE = "tests/unit/test_foreign_engine.py"

SEEDS = (
    Seed(
        "a run of MuJoCo's that diverged is judged",
        "tests/foreign_engine/sound.py",
        "for i, one in enumerate(d.warning) if one.number]",
        "for i, one in enumerate(d.warning) if one.number < 0]",
        (f"{ENGINE}::test_a_run_that_diverged_is_refused_by_name",),
    ),
)
