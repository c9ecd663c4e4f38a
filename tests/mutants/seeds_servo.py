"""An identification beside ticks that come late, and its servo on a joint that is elastic and late."""

from __future__ import annotations

from seed import Seed

LATE = ("tests/unit/identify/test_late_loop.py",)
QUIET = ("tests/unit/identify/test_quiet_servo.py",)
GUARD = ("tests/unit/identify/test_travel_guard.py",)
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
    Seed(
        "the servo of identification takes every joint for a rigid one",
        "rtctl/check/speed_servo.py",
        "            joints=joints,\n",
        "",
        QUIET,
    ),
    Seed(
        "the servo of identification goes by a drive that is never late",
        "rtctl/check/speed_servo.py",
        "            delay=share * between.delay,\n",
        "",
        QUIET,
    ),
    Seed(
        "the stiffer servos of a joint are not slowed",
        "rtctl/identify/settings.py",
        "        return None if factor is None else (stiffer, calmer * factor)\n",
        "        return None if factor is None else (stiffer, calmer if stiffer > 1 else calmer * factor)\n",
        QUIET,
    ),
    Seed(
        "the guard of a quick motion leaves no room to be braked in",
        "rtctl/identify/travel_guard.py",
        "            stopped = side * end - run_on_rad(rig, abs(v))\n",
        "            stopped = side * end\n",
        GUARD,
    ),
)
