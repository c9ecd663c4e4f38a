"""Tests of what the numbers of encoder, drive and force sensor come to: a gear that is missing in the counts,
a calibration in another unit.

None of them refuses what a lab may have: a wrong unit of these is mostly within what other rigs have
(docs/decisions/0172-numbers-are-held-against-those-of-the-devices.md)."""

from __future__ import annotations

import math

from rtctl.check.verdict import Outcome, Subject, Verdict
from rtctl.check.verdicts_of_units import Band, judged

MOTOR_COUNTS = Band(1e-12, 400.0, 1e12, 1e13)
"""Counts of a turn of the motor: from 100 lines. A coarser one is told: mostly the gear is missing."""

STEP_SHARE = Band(1e-12, 0.5, 1.5, 10.0)
"""Step of the position that a device shows over a count: coarser, and the proofs of the encoder's steps speak
of another encoder; finer, and a drive that counts is told another one."""

RANGE_SHARE = Band(1e-12, 1.0, 300.0, 1e12)
"""Range of the force sensor over the force of the motor at the handle."""

END_SHARE = Band(0.0, 0.0, 1.0, 10.0)
"""Range of the sensor over the largest force that its numbers can show: above 1 a clipped force is never seen
as one."""

RANGE_STEPS = Band(1.0, 200.0, 1e10, 1e12)
"""Steps of the force within the sensor's range: from 8 bits on."""

FORCE_GAIN = Band(1e-12, 0.3, 3.0, 1e12)
"""Force shown for a newton of the sensor: by cross-talk and the lever of a tool it is about 1."""


def counts_of_the_motor(s: Subject) -> list[Verdict]:
    """An encoder at the motor has a whole number of counts per turn of it, and not a few."""
    table = s.table
    geared = table.lead_m > 0 if table.motion == "linear" else table.gear_ratio > 1
    # at the link counts and gear say nothing of one another
    if not geared or "link" in (table.drive.encoder, s.joint.encoder):
        return []
    counts = table.encoder_counts_per_rev / table.gear_ratio
    # half a count of the link is rounded away where the number is written, and digits of the gear
    whole = abs(counts - round(counts)) <= 0.5 / table.gear_ratio + 5e-5 * counts
    outcome = MOTOR_COUNTS.outcome(counts) if whole else Outcome.WARN
    link = "screw" if table.motion == "linear" else "link"
    told = (
        f"encoder_counts_per_rev: {table.encoder_counts_per_rev:g} are meant per turn of the {link}: lines x "
        f"4 x gear_ratio ({table.gear_ratio:g}), for an encoder at the motor; right as it is for one at the "
        f"{link}, which says nothing of the motor's turn"
    )
    right = outcome == Outcome.PASS
    return [
        s.row(
            "encoder counts of a motor's turn",
            f"{counts:.6g}",
            f"from {MOTOR_COUNTS.low:g}, whole",
            outcome,
            "encoder_counts_per_rev over gear_ratio" if right else told,
            MOTOR_COUNTS.low / counts,
            "" if right else f"{s.where}.{told}",
        )
    ]


def step_of_the_device(s: Subject) -> list[Verdict]:
    """What a drive or board shows of the position, against what the rig file says of the encoder."""
    step = s.shown.step_rad[0] if s.shown.step_rad else 0.0
    # a number with a floating point, or with digits beyond what the encoder resolves
    if step == 0 or (not s.shown.counted and step < s.axis.count_rad):
        return []
    counts = s.axis.count_rad / step * s.table.encoder_counts_per_rev
    return judged(
        s,
        "step of the device over an encoder count",
        step / s.axis.count_rad,
        "",
        STEP_SHARE,
        "what the device's scale of the position comes to",
        f"encoder_counts_per_rev: {s.table.encoder_counts_per_rev:g} is said, and the device, by its own "
        f"options, shows {counts:.8g}: one of the two, or gear_ratio, is wrong",
    )


def range_of_the_force(s: Subject) -> list[Verdict]:
    """The motor is stronger than the sensor can feel, or weaker by far."""
    lever = math.hypot(*s.table.lever_m)
    if not s.axis.force_sensor or lever == 0:
        return []
    limit_n, force_n = s.table.force.limit_n, s.table.torque_limit_nm / lever
    return judged(
        s,
        "range of the force sensor over the motor's force",
        limit_n / force_n,
        "",
        RANGE_SHARE,
        f"force.limit_n over torque_limit_nm at the handle, {force_n:.3g} N",
        f"force.limit_n: {limit_n:g} is meant in N, as the sensor's data sheet has it (5 kg are 49 N, 10 lbf "
        "44.5 N); a hand that holds against the motor reaches its end",
    )


def numbers_of_the_force(s: Subject) -> list[Verdict]:
    """Steps and ends of the numbers that the force comes in, against its range; and its matrix."""
    shown, limit_n = s.shown, s.table.force.limit_n
    remedy = "force.limit_n: {} or the sensor's own scale (counts_per_n, scale) is in another unit than N"
    rows = []
    if shown.force_most_n > 0:
        rows += judged(
            s,
            "range of the force sensor over what its numbers show",
            limit_n / shown.force_most_n,
            "",
            END_SHARE,
            f"force.limit_n over {shown.force_most_n:.4g} N, where the numbers end",
            remedy.format(f"a force clipped there is never seen as clipped at {limit_n:g} N; this,"),
        )
    if shown.force_step_n > 0:
        rows += judged(
            s,
            "steps of the force within its range",
            limit_n / shown.force_step_n,
            "",
            RANGE_STEPS,
            f"force.limit_n over steps of {shown.force_step_n:.3g} N",
            remedy.format(f"{limit_n:g} N"),
        )
    if shown.force_gain > 0:
        rows += judged(
            s,
            "force shown for a newton of the sensor",
            shown.force_gain,
            "",
            FORCE_GAIN,
            "longest row of the sensor's matrix",
            "force: the sensor's options.matrix turns and mirrors axes, and a unit does not belong there "
            "(9.81, .102: kg; 4.45, .225: lbf): a scale is counts_per_n",
        )
    return rows
