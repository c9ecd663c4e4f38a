"""What the law needs to know of one axis: plant, limits, estimator, force, display. Part of `law_plan`."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hw.interface import Joint
from rtctl.check.devices_of_axis import sure_damping
from rtctl.control import take_back
from rtctl.control.flicker import blind_damping_nms_rad, blind_hz
from rtctl.control.jit import plain
from rtctl.control.proofs import stability
from rtctl.control.stability_watch import FLOOR_SHARE
from rtctl.control.velocity import kalman_gains, lowpass_alpha
from rtctl.control.virtual_mass import MASS_REST_HZ
from rtctl.control.vocabulary import DeviceVelocity, Display, VelocityMethod
from rtctl.rig_file.axis_tables import OVERSHOOT_UNTOLD, AxisTable

# a joint that goes quicker than a quarter of its limit, over the whole test, is moved by somebody
ARMING_TRAVEL_SHARE = 0.25
LIGHTEST_MOTOR = 1 / 16
"""Least share of the inertia of an elastic joint on its motor's side."""
ARMING_PART_S = 0.02
"""Length of a part of the arming test, if devices answer sooner."""
MORE_SHARE = 0.25
"""The test pulse is refused of an overshoot surely beyond the declared one and this share of what that is
beyond `OVERSHOOT_UNTOLD`: a real loop is not quite of second order."""
OFFSET_SHARE = 0.1
"""Share of the torque limit that the force may be off in power, unless the rig file says otherwise."""


def arming_ticks(lates: Sequence[stability.Between], period_s: float, part_s: float) -> int:
    """Length of a part of the test pulse, ticks: `part_s`, and no shorter than what a sample may still show
    of the part before it and the time to a fresh one, or no current seems to answer (`arming`)."""
    least = max(math.ceil(stability.late_ticks(late, period_s)) + late.sample_ticks + 1 for late in lates)
    return max(least, math.floor(part_s / period_s + 1e-9))


def fill_arming(p: np.void, a: int, axis: AxisTable, period_s: float, joint: Joint) -> None:
    """Bound of the motion in ARMING and torque of its test; needs what is known of delay and account."""
    times = period_s, float(p["arming_ticks"]) * period_s, float(p["acting_delay_s"][a])
    p["arming_travel_rad"][a], p["arming_torque_nm"][a] = gentle_pulse(
        axis, joint, times, float(p["energy_budget_j"])
    )


def gentle_pulse(
    axis: AxisTable, joint: Joint, times: tuple[float, float, float], budget_j: float
) -> tuple[float, float]:
    """Bound of the motion in ARMING, rad, and a test torque, N m, that moves even a joint without friction
    far less, and that the empty account of its port can pay for.

    `times` are the period, a part of the pulse, and how late a torque acts, s."""
    period_s, part_s, acting_s = times
    travel_rad = ARMING_TRAVEL_SHARE * axis.velocity_limit_rad_s * 4 * part_s
    # the motor of an elastic joint goes alone: whoever calls it elastic seldom says how heavy it is
    share = 1.0 if joint.motor_share == 1 else LIGHTEST_MOTOR
    # +tau and -tau take a joint without friction a quarter of the bound, and leave it at rest: the other
    # three quarters are a hand's, or the motor's alone (a t^2 is the way of +tau then -tau)
    gentle_nm = axis.inertia_kgm2 * min(1.0, 4 * share) * travel_rad / (4 * part_s**2)
    # a quarter of the budget for the motion that +tau makes, tau^2 t^2/(2 J), the rest of the 1.5 for what is
    # held and on its way: PASSIVITY is at 1.35, and what the account holds back comes and goes by the tick
    moved_nm = math.sqrt(share * axis.inertia_kgm2 * budget_j / 2) / part_s
    way_rad = take_back.OVERSPEED_FACTOR * axis.velocity_limit_rad_s * period_s
    held_nm = plain(take_back.most_torque)(
        1.25 * budget_j / (1 + acting_s / period_s), axis.torque_rate_nm_s * period_s, way_rad
    )
    return travel_rad, min(axis.arming_share * axis.torque_limit_nm, gentle_nm, moved_nm, held_nm)


def _overshoot_limit(told: float) -> float:
    """How far the current may exceed the steps of the test pulse."""
    return max(told + MORE_SHARE * (told - OVERSHOOT_UNTOLD), OVERSHOOT_UNTOLD)


def fill_axis(
    p: np.void, a: int, axis: AxisTable, period_s: float, joint: Joint, between: stability.Between
) -> None:
    """Parameters of axis `a` that follow from its tables and joint."""
    # what accounts credit and our own dampers live on: a hand behind a spring takes the rest away
    sure = p["sure_viscous_nms_rad"][a] = sure_damping(axis.viscous_nms_rad, joint)
    for name in (
        "inertia_kgm2",
        "viscous_nms_rad",
        "gear_efficiency",
        "torque_constant_nm_a",
        "lever_m",
        "axis_direction",
        "position_min_rad",
        "position_max_rad",
        "current_limit_a",
        "torque_limit_nm",
        "velocity_limit_rad_s",
    ):
        p[name][a] = getattr(axis, name)
    p["is_linear"][a] = axis.motion == "linear"
    # of a screw rad of the motor per m: the law knows no leads
    p["gear_ratio"][a] = axis.motor_ratio
    # a zero one stays: it says that moments do not count
    p["axis_direction"][a] /= math.hypot(*axis.axis_direction) or 1.0
    # 0: the window folds nothing back
    p["torque_continuous_nm"][a] = axis.torque_continuous_nm or axis.torque_limit_nm
    p["temperature_kind"][a] = axis.temperature.sensor
    p["temperature_warn_c"][a], p["temperature_trip_c"][a] = axis.temperature.warn_c, axis.temperature.trip_c
    count_rad = 2 * math.pi / axis.counts_of_turn
    p["count_rad"][a] = count_rad
    # per tick, as the gate has no clock
    p["torque_rate_nm"][a] = axis.torque_rate_nm_s * period_s
    p["force_limit_n"][a] = axis.force.limit_n
    p["force_offset_limit_nm"][a] = axis.force.offset_nm or OFFSET_SHARE * axis.torque_limit_nm
    p["current_gain_error"][a] = axis.drive.current_gain_error
    p["current_overshoot_limit"][a] = _overshoot_limit(axis.drive.current_overshoot)
    p["current_offset_nm"][a] = axis.drive.current_offset_share * axis.torque_limit_nm
    p["velocity_method"][a] = VelocityMethod[axis.velocity.method.upper()]
    p["velocity_window_ticks"][a] = axis.velocity.window
    p["velocity_band_rad"][a] = axis.velocity.band_counts * count_rad
    p["velocity_alpha"][a] = lowpass_alpha(axis.velocity.cutoff_hz, period_s)
    gain_position, gain_velocity = kalman_gains(count_rad, axis.velocity.cutoff_hz, period_s)
    p["kalman_gain_position"][a], p["kalman_gain_velocity"][a] = gain_position, gain_velocity
    p["device_velocity_kind"][a] = DeviceVelocity[axis.velocity.device.upper()]
    p["device_tolerance_rad_s"][a] = axis.velocity.device_tolerance_rad_s or 0.1 * axis.velocity_limit_rad_s
    p["force_alpha"][a] = lowpass_alpha(axis.force.lowpass_hz, period_s) if axis.force.lowpass_hz else 1.0
    p["tare_ticks"][a] = round(axis.force.tare_s / period_s)
    p["coupling_stiffness_nm_rad"][a] = axis.coupling.stiffness_nm_rad
    p["coupling_damping_nms_rad"][a] = axis.coupling.damping_nms_rad
    # b of 4.3: more would be a limit cycle of its own
    p["injected_damping_max_nms_rad"][a] = sure
    p["hold_damping_nms_rad"][a] = sure / _needed_of_own(period_s, between)
    if axis.may_show("admittance"):
        _fill_admittance(p, a, axis, period_s)


def _needed_of_own(period_s: float, between: stability.Between) -> float:
    """Damping that a damper of 1 needs of the joint: 1 however late it is, more where the current overshoots
    (docs/theory.md 2.4)."""
    return stability.damping_needed_between(0.0, 1.0, period_s, between) if between.overshoot > 0 else 1.0


def _fill_admittance(p: np.void, a: int, axis: AxisTable, period_s: float) -> None:
    """Parameters of the virtual mass and of the servo that has the joint follow it."""
    shown = axis.admittance
    p["display_kind"][a], p["display_change"][a] = Display[axis.display.upper()], axis.display_change
    p["mass_kgm2"][a], p["mass_damping_nms_rad"][a] = shown.mass_kgm2, shown.damping_nms_rad
    # without a range the mass itself bounds it: a client cannot ask for another
    p["mass_max_kgm2"][a] = shown.mass_max_kgm2 or shown.mass_kgm2
    p["mass_damping_max_nms_rad"][a] = shown.damping_max_nms_rad or shown.damping_nms_rad
    p["mass_rest_nms_rad"][a] = shown.rest_damping_nms_rad
    p["mass_blind_nms_rad"][a] = blind_damping_nms_rad(
        shown.rest_damping_nms_rad, shown.velocity_gain_nms_rad
    )
    p["mass_rest_alpha"][a] = lowpass_alpha(MASS_REST_HZ, period_s)
    p["mass_compensation"][a] = shown.compensation_share
    p["mass_forward"][a] = shown.sent_ahead(axis.inertia_kgm2)
    p["mass_forward_alpha"][a] = lowpass_alpha(shown.feedforward_lowpass_hz, period_s)
    p["mass_force_alpha"][a] = lowpass_alpha(shown.force_lowpass_hz, period_s)
    p["mass_blind_alpha"][a] = lowpass_alpha(blind_hz(shown.force_lowpass_hz), period_s)
    p["mass_force_deadband_nm"][a] = shown.force_deadband_nm
    p["servo_velocity_gain_nms_rad"][a] = shown.velocity_gain_nms_rad
    p["servo_position_gain_nm_rad"][a] = shown.position_gain_nm_rad
    p["watch_floor_nm"][a] = FLOOR_SHARE * axis.torque_limit_nm
    p["servo_velocity_alpha"][a] = lowpass_alpha(shown.velocity_lowpass_hz, period_s)


def fill_force_feedback(
    p: np.void, a: int, axis: AxisTable, period_s: float, between: stability.Between
) -> None:
    """Parameters of the local force feedback: what the coupling needs of the device is not spent twice."""
    feedback, coupling = axis.force_feedback, axis.coupling
    k_c, b_c, count_rad = coupling.stiffness_nm_rad, coupling.damping_nms_rad, float(p["count_rad"][a])
    p["force_feedback_gain"][a] = feedback.gain
    p["force_feedback_alpha"][a] = lowpass_alpha(feedback.lowpass_hz, period_s)
    p["force_feedback_deadband_nm"][a] = feedback.deadband_nm
    p["force_feedback_cap_nm"][a] = feedback.cap_share * axis.torque_limit_nm
    p["force_feedback_share"][a] = feedback.share
    needed = stability.damping_needed_between(k_c, b_c, period_s, between)  # the coupling lives on this much
    p["force_feedback_damping_nms_rad"][a] = max(0.0, float(p["sure_viscous_nms_rad"][a]) - needed)
    # dry friction that holds the joint against the encoder's steps (row `steps of the encoder`)
    p["force_feedback_reserve_nm"][a] = k_c * count_rad / 2 + b_c * count_rad / period_s
