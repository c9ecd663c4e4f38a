"""Tests of an admittance: what one encoder count and one step of the force send through its gains."""

from __future__ import annotations

import math

from rtctl.check.verdict import Outcome, Subject, Verdict
from rtctl.friction.guarantee import holds_flicker

NOISE_LEAST = 0.02
"""Torque of one count or step, as a share of the torque limit, that is none to feel even where no friction holds the joint."""

NOISE_MOST = 0.1
"""Torque of one count through the velocity gain, as a share of the torque limit, from which on an axis is refused."""

RESOLUTION_SHARE = 0.01
"""Share of a force sensor's range that its step is taken for where the rig file does not say."""


def steps(s: Subject) -> list[Verdict]:
    """Torque that one encoder count and one step of the force make through the gains."""
    count, force = count_torque_nm(s), force_step_torque_nm(s)
    quiet = NOISE_LEAST * s.axis.torque_limit_nm
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
        outcome = Outcome.PASS if jump <= held else Outcome.WARN if jump <= most else Outcome.FAIL
        meaning = "torque that it makes through the gains; bound: the dry friction that holds the joint, or 2 % of the torque limit"
        if jump == count and quiet < jump <= held:
            outcome, meaning = held_by_bristles(s, meaning)
        if outcome != Outcome.PASS:
            meaning += f" (refused from {most:.3g} N m, a tenth of the torque limit): {key}"
        bound = max(held, most)
        refusal = (
            f"{s.where}.admittance.velocity_gain_nms_rad: axis {s.axis.name}: {s.table.admittance.velocity_gain_nms_rad:g} makes {jump:.3g} "
            f"N m of it ({name}), the bound is {bound:.3g} N m: {key}"
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


def held_by_bristles(s: Subject, meaning: str) -> tuple[Outcome, str]:
    """What a count means that only dry friction holds: within its bristles that is a spring, and the law must not answer a flicker."""
    bent = s.axis.guarantee.length_rad / s.axis.count_rad
    if bent <= 1:
        return Outcome.PASS, meaning
    springs = f"{meaning}; its bristles bend over {bent:.3g} counts, and are a spring so far"
    if holds_flicker(s.table, s.axis.guarantee, s.joint.dry_share):
        return Outcome.PASS, f"{springs}: a flicker, which the law does not answer"
    return Outcome.NOT_PROVED, f"{springs}: may shake on it: a finer encoder, or less position_gain_nm_rad"


def count_torque_nm(s: Subject) -> float:
    """Torque of one count, N m: K_v alpha Delta/(n T) + K_p Delta, alpha of the velocity's low-pass over n ticks."""
    from rtctl.control.velocity import lowpass_alpha

    a, span = s.table.admittance, s.period_s * s.axis.sample_ticks
    pulse = lowpass_alpha(a.velocity_lowpass_hz, span) * s.axis.count_rad / span
    return a.velocity_gain_nms_rad * pulse + a.position_gain_nm_rad * s.axis.count_rad


def force_step_torque_nm(s: Subject) -> float:
    """Torque of one step of the force sensor in the tick it comes, N m.

    Notes
    -----
    With tau the step as a hand torque behind the low-passes: the mass gains v = T tau/(m + b_v T), and (K_v + K_p T) v is sent, and
    of what is sent ahead the share of J v/T - tau that its low-pass lets through.
    """
    from rtctl.control.velocity import lowpass_alpha

    a, T, force = s.table.admittance, s.period_s, s.table.force
    lever = math.hypot(*s.table.lever_m)
    step = (force.resolution_n or RESOLUTION_SHARE * force.limit_n) * lever
    alpha = lowpass_alpha(a.force_lowpass_hz, T) * lowpass_alpha(force.lowpass_hz, T)
    gain = a.velocity_gain_nms_rad + a.position_gain_nm_rad * T
    torque = alpha * step
    speed = T * torque / (a.mass_kgm2 + a.damping_nms_rad * T)
    ahead = a.sent_ahead(s.table.inertia_kgm2) * lowpass_alpha(a.feedforward_lowpass_hz, T)
    return gain * speed + ahead * abs(s.table.inertia_kgm2 * speed / T - torque)
