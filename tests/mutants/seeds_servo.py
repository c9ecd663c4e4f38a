"""An identification beside ticks that come late, and its servo on a joint that is elastic and late."""

from __future__ import annotations

from seed import Seed

LATE = ("tests/unit/identify/test_late_loop.py",)
SIGNALS = ("tests/unit/identify/test_signals.py",)

SEEDS = (
    Seed(
        "the look for cogging takes a slot that was left out for no time",
        "rtctl/identify/sweep.py",
        "            ticks = on_every_slot(ticks, motion.rig.axis)\n",
        "",
        LATE,
    ),
    Seed(
        "a measurement beside late ticks is kept",
        "rtctl/identify/points.py",
        "        if ran_late(rows, rig.period_s):\n",
        "        if False:\n",
        LATE,
    ),
    Seed(
        "a break-away beside late ticks is kept",
        "rtctl/identify/tick_readings.py",
        "    if ran_late(rows[first : seen + look_back + 1], period_s):\n",
        "    if False:\n",
        SIGNALS,
    ),
    Seed(
        "what late ticks took is put down to the joint",
        "rtctl/identify/points.py",
        "LATE if got.late > FORGIVEN else ",
        "",
        LATE,
    ),
)
