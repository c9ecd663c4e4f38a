"""What `rtctl check` says of one axis, line by line: label, figure with unit, and note."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rtctl.rounded import down, up

if TYPE_CHECKING:
    from rtctl.check.stability_report import AxisReport
    from rtctl.friction.margins import FrictionFigures


def _admittance_lines(axis: AxisReport) -> list[tuple[str, str, str]]:
    """Label, figure and note of an axis that is displayed as an admittance."""
    one, loop = axis.admittance, axis.loop
    # an axis that shows an impedance alone has neither
    if one is None or loop is None:
        return []
    return [
        (
            "virtual mass m",
            f"{loop.mass_kgm2:.4g} kg m^2",
            (f"up to {loop.mass_max_kgm2:g} while it runs; " if loop.mass_max_kgm2 > loop.mass_kgm2 else "")
            + f"least that passes {up(one.mass_min_kgm2)}",
        ),
        ("virtual damping b_v", f"{loop.virtual_damping_nms_rad:.4g} N m s/rad", ""),
        (
            "velocity gain K_v",
            f"{loop.velocity_gain_nms_rad:.4g} N m s/rad",
            f"position gain K_p {loop.position_gain_nm_rad:.4g} N m/rad",
        ),
        (
            "stiffest hand that passes",
            f"{down(one.hand_stiffness_max_nm_rad, 4)} N m/rad",
            f"in any linear world; in free motion {down(one.hand_stiffness_max_free_nm_rad, 4)}; the box has "
            f"{loop.box.stiffness_nm_rad:g}",
        ),
        (
            "least mass without lag",
            f"{up(one.mass_min_continuous_kgm2, 4)} kg m^2",
            "J K_v/(b + K_v): passive with any hand",
        ),
    ]


def axis_lines(axis: AxisReport) -> list[tuple[str, str, str]]:
    """Label, figure with unit, and note of every line of one axis."""
    shown = _admittance_lines(axis)  # first: an axis that may show both has the lines of both
    if not axis.impedance:  # nothing of a coupling is felt there
        shown += _friction_lines(axis.friction) if axis.friction else []
        return shown + (_account_lines(axis) if axis.compensates else [])
    from rtctl.check.verdicts_of_loop import between_text

    exact, paper = axis.sampled_data_margin_nms_rad, axis.adams_hannaford_margin_nms_rad  # proved; known
    lines = [
        ("coupling stiffness k_c", f"{axis.stiffness_nm_rad:.4g} N m/rad", ""),
        ("coupling damping b_c", f"{axis.damping_nms_rad:.4g} N m s/rad", between_text(axis)),
        ("guaranteed device damping b", f"{axis.device_damping_nms_rad:.4g} N m s/rad", _source(axis)),
        (
            "sampled-data margin",
            f"{exact:+.4g} N m s/rad",
            f"k_c up to {down(axis.sampled_data_k_max_nm_rad, 4)} at this b_c",
        ),
        (
            "Adams-Hannaford margin",
            f"{paper:+.4g} N m s/rad",
            f"as in the papers; k_c up to {down(axis.adams_hannaford_k_max_nm_rad, 4)} at this b_c",
        ),
    ]
    lines += _friction_lines(axis.friction) if axis.friction else []
    lines += _account_lines(axis) if axis.compensates else []
    felt, k_e = axis.felt_stiffness_nm_rad, axis.environment_stiffness_nm_rad
    lines += [
        (
            "encoder count",
            f"{axis.count_rad:.4g} rad",
            f"asks {axis.quantisation_torque_nm:.3g} N m of dry friction",
        ),
        (
            "recommended coupling",
            f"{down(axis.recommended_stiffness_nm_rad, 4)} N m/rad",
            f"with b_c = {down(axis.recommended_damping_nms_rad, 4)} N m s/rad",
        ),
        (
            "ring on the coupling, hand off",
            f"{axis.ring_hz:.3g} Hz",
            f"damping ratio {axis.ring_damping_ratio:.3g}",
        ),
        ("torque of an empty account", f"{axis.empty_account_torque_nm:.4g} N m", _account(axis)),
    ]
    if felt is not None:  # a wall or a detent has no one stiffness
        lines.append(("felt stiffness", f"{felt:.4g} N m/rad", f"of {k_e:.4g} in the virtual environment"))
    return shown + lines


def _account(axis: AxisReport) -> str:
    """What bounds the torque that the energy account can pay for, and what would raise it to the limit."""
    # nothing is lost: no remedy is to be named
    if axis.empty_account_torque_nm >= axis.torque_limit_nm:
        return "all of the limit can be taken back in time"
    # inf: no slope brings it, as the gate is no quicker than a tick
    needed = axis.torque_rate_needed_nm_s
    remedy = f"torque_rate_nm_s = {up(needed, 4)}" if math.isfinite(needed) else "a larger passivity.budget_j"
    return f"of {axis.torque_limit_nm:.4g}, the rest against what the hand puts in; all with {remedy}"


def _source(axis: AxisReport) -> str:
    """Where the guaranteed damping comes from."""
    found = axis.friction
    share = (
        ""
        if axis.motor_share == 1
        else f", of {axis.total_damping_nms_rad:.4g} behind and before the joint's spring"
    )
    if found is None:
        return f"viscous_nms_rad of the rig file; no friction model{share}"
    # None: the velocity limit lies within the trained range
    beyond = found.beyond_damping_nms_rad
    # the least of three decides, and is named: somebody is to measure just that one better
    if axis.total_damping_nms_rad < min(found.secant_damping_nms_rad, math.inf if beyond is None else beyond):
        return f"viscous_nms_rad of the rig file: all that damps small motions{share}"
    if beyond is not None and beyond < found.secant_damping_nms_rad:
        return f"beyond the trained range; within it {found.secant_damping_nms_rad:.4g}{share}"
    return f"secant damping with feed-forward, least at {found.secant_speed_rad_s:.3g} rad/s{share}"


def _account_lines(axis: AxisReport) -> list[tuple[str, str, str]]:
    """What the account of the compensation rests on."""
    # what the law counts on, not what was measured: spreads and doubts are in it
    sure = axis.guarantee
    return [
        ("presliding length", f"{sure.length_rad * 1e3:.4g} mrad", sure.length_source),
        ("  credited to the bristles", f"{sure.credited_rad * 1e3:.4g} mrad", "1.5 times it and two spreads"),
        (
            "bank of the compensation",
            f"{sure.bank_j * 1e3:.3g} mJ",
            f"a hand is given at most {up(sure.given_most_j * 1e3)} mJ",
        ),
        (
            "push that is helped at rest",
            f"{sure.intent_nm:.3g} N m",
            f"by a hand, with all of it (intent_nm); {sure.gate_nm:.3g} N m opens the gate (gate_nm)",
        ),
    ]


def _friction_lines(found: FrictionFigures) -> list[tuple[str, str, str]]:
    two, capped = found.two_line_margin_nm, found.two_line_capped_margin_nm
    local = found.slope_damping_nms_rad  # of the curve alone, at one speed
    return [
        (
            "two-line margin",
            f"{two:+.4g} N m",
            "whatever the feed-forward's sign errors (a force gate excludes most)",
        ),
        ("  capped below dry friction", f"{capped:+.4g} N m", ""),
        ("least local damping", f"{local:+.4g} N m s/rad", "below 0 stick-slip needs the hand's damping"),
        (
            "least friction, lower bound",
            f"{found.friction_floor_nm:.4g} N m",
            f"model error {found.error_max_nm:.3g} N m",
        ),
        (
            "most feed-forward",
            f"{found.feedforward_max_nm:.4g} N m",
            f"share that surely passes {down(found.gain_max)}",
        ),
    ]
