"""Tests of an admittance: what one encoder count and one step of the force send through its gains, and how
fast it hunts about a count."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rtctl.check.admittance_figures import calming_hunt, creeping_of, hunting_of, loop_of
from rtctl.check.verdict import Outcome, Subject, Verdict
from rtctl.check.verdicts_of_loop import still_rad_s
from rtctl.friction.guarantee import holding_friction_nm, holds_flicker
from rtctl.rounded import up

if TYPE_CHECKING:
    from rtctl.control.proofs.admittance_loop import AdmittanceLoop
    from rtctl.rig_file.sensor_tables import ForceSensorTable

NOISE_LEAST = 0.02
"""Torque of one count or step, as a share of the torque limit, that is none to feel even where no friction
holds the joint."""

NOISE_MOST = 0.1
"""Torque of one count through the velocity gain, as a share of the torque limit, from which on an axis is
refused."""

LEAST_SHARE = 0.005
"""Dry friction that a refusal asks for, as a share of the torque limit, where less would do."""

RESOLUTION_SHARE = 0.01
"""Share of a force sensor's range that its step is taken for where the rig file does not say."""


def steps(s: Subject) -> list[Verdict]:
    """Torque that one encoder count and one step of the force make through the gains."""
    count, force = count_torque_nm(s), force_step_torque_nm(s)
    quiet = NOISE_LEAST * s.axis.torque_limit_nm
    # a joint without friction feels 2 % of its limit at least
    held = max(s.axis.guarantee.floor_nm, s.axis.dry_friction_nm, quiet)
    most = NOISE_MOST * s.axis.torque_limit_nm
    rows = []
    for name, jump, key in (
        (
            "admittance, one encoder count",
            count,
            "a finer encoder, or less velocity_gain_nms_rad or velocity_lowpass_hz",
        ),
        ("admittance, one step of the force", force, "less force_lowpass_hz, or more mass_kgm2"),
    ):
        # felt as roughness from `held` on, and refused only where it is a tenth of the motor
        outcome = Outcome.PASS if jump <= held else Outcome.WARN if jump <= most else Outcome.FAIL
        meaning = (
            "torque that it makes through the gains; bound: the dry friction that holds the joint, or 2 % "
            "of the torque limit"
        )
        if outcome != Outcome.PASS:
            meaning += f" (refused from {most:.3g} N m, a tenth of the torque limit): {key}"
        bound = max(held, most)
        refusal = (
            f"{s.where}.admittance.velocity_gain_nms_rad: axis {s.axis.name}: "
            f"{s.table.admittance.velocity_gain_nms_rad:g} makes {jump:.3g} N m of it ({name}), the bound "
            f"is {bound:.3g} N m: {key}"
        )
        use = jump / held
        rows.append(
            s.row(
                name,
                f"{jump:.3g} N m",
                f"<= {held:.3g} N m",
                outcome,
                meaning,
                use,
                refusal if outcome == Outcome.FAIL else "",
            )
        )
    return rows


def hunting(s: Subject) -> list[Verdict]:
    """What the joint does within a count the servo does not see, and what it makes of an edge between two is
    a step: how fast does the joint hunt?"""
    loop = loop_of(s.axis, s.table, s.joint, s.period_s)
    held = holds_flicker(s.table, s.axis.guarantee, s.joint.dry_share)
    found, bound = hunting_of(loop, held), still_rad_s(s)
    # the loop is linear in the count: what is found of one counts for every encoder
    speed = found.counts_1_s * s.axis.count_rad
    outcome = Outcome.PASS if speed <= bound else Outcome.FAIL
    kept = (
        "a flicker among counts is not answered"
        if held
        else "nobody says that dry friction holds the joint (dry_friction_nm)"
    )
    meaning = f"most that the counts of the encoder keep it moving; {kept}"
    if outcome == Outcome.FAIL:
        meaning += f": with a {found.at}: {_hunts_remedy(s, loop, held, bound)}"
        if loop.bristle_nm_rad > 0 and s.axis.guarantee.may_be_shorter:
            outcome = Outcome.NOT_PROVED
            meaning += f"; {s.axis.guarantee.length_in_doubt}"
    refusal = (
        f"{s.where}.encoder_counts_per_rev: axis {s.axis.name}: {s.table.encoder_counts_per_rev:g} counts: "
        f"{meaning}"
    )
    return [
        s.row(
            "admittance, hunting about a count",
            f"{speed:.3g} rad/s RMS",
            f"<= {bound:g} rad/s",
            outcome,
            meaning,
            speed / bound,
            refusal if outcome == Outcome.FAIL else "",
        )
    ]


def creeping(s: Subject) -> list[Verdict]:
    """A joint that creeps crosses edges before a flicker among counts is held: how fast does it ring there,
    as long as it creeps?"""
    # then `hunting` judges it: nothing is held, and no flicker comes before a hold
    if not holds_flicker(s.table, s.axis.guarantee, s.joint.dry_share):
        return []
    found = creeping_of(loop_of(s.axis, s.table, s.joint, s.period_s))
    speed, bound = found.counts_1_s * s.axis.count_rad, still_rad_s(s)
    outcome = Outcome.PASS if speed <= bound else Outcome.NOT_PROVED
    meaning = (
        "how fast a joint may ring between the counts of its encoder while it creeps, as servo and leaning "
        "hand wind up against its friction"
    )
    if outcome != Outcome.PASS:
        # a percent more: the figure is printed with three digits
        counts = 1.01 * s.table.encoder_counts_per_rev * speed / bound
        meaning += f": with a {found.at}: encoder_counts_per_rev = {counts:.3g} passes"
    return [
        s.row(
            "admittance, creep among counts",
            f"{speed:.3g} rad/s RMS",
            f"<= {bound:g} rad/s",
            outcome,
            meaning,
            speed / bound,
        )
    ]


def _hunts_remedy(s: Subject, loop: AdmittanceLoop, held: bool, bound: float) -> str:
    """What passes: friction that is said to be there, damping at rest, or more counts."""
    most, ways = bound / s.axis.count_rad, []
    # what just holds would be printed as what does not
    needed = max(1.05 * holding_friction_nm(s.table, s.joint.dry_share), LEAST_SHARE * s.axis.torque_limit_nm)
    if not held and math.isfinite(needed) and hunting_of(loop, True).counts_1_s <= most:
        ways.append(f"dry_friction_nm = {needed:.2g}, if the joint surely has as much")
    elif held and (damping := calming_hunt(loop, most)) > 0:
        ways.append(f"admittance.rest_damping_nms_rad = {up(damping)}")
    counts = s.table.encoder_counts_per_rev * hunting_of(loop, held).counts_1_s / most
    ways.append(f"encoder_counts_per_rev = {counts * 1.01:.3g}")
    return ", or ".join(ways)


def count_torque_nm(s: Subject) -> float:
    """Torque of one count, N m: K_v alpha Delta/(n T) + K_p Delta, alpha of the velocity's low-pass over n
    ticks."""
    from rtctl.control.velocity import lowpass_alpha

    a, span = s.table.admittance, s.period_s * s.axis.sample_ticks
    pulse = lowpass_alpha(a.velocity_lowpass_hz, span) * s.axis.count_rad / span
    return a.velocity_gain_nms_rad * pulse + a.position_gain_nm_rad * s.axis.count_rad


def moment_step_nm(sensor: ForceSensorTable) -> float:
    """Step of the moments of a force sensor, N m; 0 where they do not count."""
    return (sensor.resolution_nm or RESOLUTION_SHARE * sensor.limit_nm) if sensor.moments else 0.0


def force_step_torque_nm(s: Subject) -> float:
    """Torque of one step of the force sensor in the tick it comes, N m.

    Notes
    -----
    With tau the step as a hand torque behind the low-passes: the mass gains v = T tau/(m + b_v T), and (K_v +
    K_p T) v is sent, and of what is sent ahead the share of J v/T - tau that its low-pass lets through."""
    from rtctl.control.velocity import lowpass_alpha

    a, T, force = s.table.admittance, s.period_s, s.table.force
    step = (force.resolution_n or RESOLUTION_SHARE * force.limit_n) * math.hypot(*s.table.lever_m)
    # an axis that goes by moments alone has no lever, and is stepped all the same
    step = max(step, s.moment_step_nm if any(s.table.axis_direction) else 0.0)
    alpha = lowpass_alpha(a.force_lowpass_hz, T) * lowpass_alpha(force.lowpass_hz, T)
    gain = a.velocity_gain_nms_rad + a.position_gain_nm_rad * T
    torque = alpha * step
    speed = T * torque / (a.mass_kgm2 + a.damping_nms_rad * T)
    ahead = a.sent_ahead(s.table.inertia_kgm2) * lowpass_alpha(a.feedforward_lowpass_hz, T)
    return gain * speed + ahead * abs(s.table.inertia_kgm2 * speed / T - torque)
