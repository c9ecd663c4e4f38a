"""Bugs in what `rtctl check` tells of counts, scales and ranges: each was silent once."""

from __future__ import annotations

from seed import Seed

CHECK = ("tests/unit/cli/test_check_numbers.py",)
NUMBERS = "rtctl/check/verdicts_of_numbers.py"

SEEDS = (
    Seed(
        "counts that forgot the gear are believed",
        NUMBERS,
        "MOTOR_COUNTS.outcome(counts) if whole else Outcome.WARN",
        "MOTOR_COUNTS.outcome(round(counts))",
        CHECK,
    ),
    Seed(
        "counts of a tenth are believed",
        NUMBERS,
        "Band(1e-12, 400.0, 1e12, 1e13)",
        "Band(1e-12, 40.0, 1e12, 1e13)",
        CHECK,
    ),
    Seed(
        "the last digit of an angle counts for the encoder",
        NUMBERS,
        "not s.shown.counted and step < s.axis.count_rad",
        "False",
        CHECK,
    ),
    Seed(
        "a drive that counts other turns is believed",
        "hw/can/declared.py",
        '/ float(table["counts_per_turn"])',
        "/ 65536.0",
        CHECK,
    ),
    Seed(
        "ends in degrees are believed",
        "rtctl/check/verdicts_of_motion.py",
        "TRAVEL_RAD = Band(0.0, 0.0, 30.0,",
        "TRAVEL_RAD = Band(0.0, 0.0, 300.0,",
        CHECK,
    ),
    Seed(
        "a force range in kilograms is believed",
        NUMBERS,
        "RANGE_SHARE = Band(1e-12, 1.0,",
        "RANGE_SHARE = Band(1e-12, 0.1,",
        CHECK,
    ),
    Seed(
        "the end of an unsigned force is that without its zero",
        "hw/serial/declared.py",
        "abs(low - zero), abs(high - zero)",
        "abs(low), abs(high)",
        CHECK,
    ),
    Seed(
        "a unit in the sensor's matrix is believed",
        "hw/force/declared.py",
        "force_gain=gain,",
        "force_gain=1.0,",
        CHECK,
    ),
    Seed(
        "a test pulse below a step of the current is not told",
        "rtctl/check/verdicts.py",
        "    verdicts_of_device.pulse_in_steps,\n",
        "",
        CHECK,
    ),
    Seed(
        "the budget told is the one that is too small by half",
        "rtctl/check/verdicts_of_device.py",
        "(low, middle) if steps(middle) >= least else",
        "(low, middle) if steps(middle) >= 0.5 * least else",
        CHECK,
    ),
    Seed(
        "a world in degrees is believed",
        "rtctl/check/verdicts.py",
        "    verdicts_of_slips.place_of_the_world,\n",
        "",
        CHECK,
    ),
    Seed(
        "a gate in kN m is believed",
        "rtctl/check/verdicts_of_slips.py",
        "PUSH_SHARE = Band(1e-12, 0.01,",
        "PUSH_SHARE = Band(1e-12, 1e-9,",
        CHECK,
    ),
)
