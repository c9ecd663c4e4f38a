"""Bugs in how help with friction ends beyond the trained range."""

from __future__ import annotations

from seed import Seed

ROLL_OFF = ("tests/unit/friction/test_roll_off.py",)

SEEDS = (
    Seed(
        "the law ends help over speed more steeply than a late drive bears",
        "rtctl/check/law_plan.py",
        "ending = rolled_off(learned, axis, T, between, taken_damping(axis.viscous_nms_rad, joint))",
        "ending = learned",
        ROLL_OFF,
    ),
    Seed(
        "the check judges another end of the help than the law's",
        "rtctl/friction/margins.py",
        "    model = rolled_off(model, axis, T, between, taken_nms_rad)\n",
        "",
        ROLL_OFF,
    ),
    Seed(
        "the end of the help is taken for as late as its samples are",
        "rtctl/friction/roll_off.py",
        "late_ticks(between, period_s) + 1.0",
        "between.sample_ticks",
        ROLL_OFF,
    ),
    Seed(
        "a motor on its gear may swing by the end of the help",
        "rtctl/friction/roll_off.py",
        "late_s, on_a_gear)",
        "late_s, math.inf)",
        ROLL_OFF,
    ),
    Seed(
        "a light joint may swing by the end of the help",
        "rtctl/friction/roll_off.py",
        "min(MOTOR_SHARE * axis.inertia_kgm2 / late_s, on_a_gear)",
        "on_a_gear",
        ROLL_OFF,
    ),
    Seed(
        "help goes on where friction still falls at the end of its range",
        "rtctl/friction/roll_off.py",
        "if by_place or any(map(_falls, model.branches)):",
        "if by_place:",
        ROLL_OFF,
    ),
)
