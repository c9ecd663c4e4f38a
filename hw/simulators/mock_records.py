"""The two records of the simulated rig: what it is (parameters) and where it is (state).

Both are one-row structured arrays; per-axis fields have shape `(n_axes, ...)`. The state is the whole
truth: copying the array copies the rig, its noise generator included."""

from __future__ import annotations

import math
from enum import IntEnum
from functools import cache
from typing import Any

import numpy as np

from hw.encoder import ENCODER_STATE
from hw.fault_script import FAULT_STREAM, fill_schedule
from hw.generator import seed_words
from hw.interface import BackendError, Options, Rig
from hw.scripted_faults import memory_fields, schedule_fields
from hw.simulators.mock_effects import (
    effect_fields,
    effect_state_fields,
    fill_effects,
    fill_timing,
    take_numbers,
)
from hw.simulators.mock_force_filter import fill_force_filter, force_filter_fields, force_filter_state_fields

SINES = 4
"""Most components of the hand's sum of sines."""

GRIPS = 8
"""Most intervals in which the hand holds the tip."""

DELAY_LINE = 17
"""Length of the line of commanded currents: delays of 0 to 16 periods."""

SUBSTEP_S = 100e-6
"""Longest sub-step of the plant: 3.5e-6 speed error at 100 us against 1 us (`coupled_step`)."""


class Hand(IntEnum):
    """What the hand's wanted position does."""

    NONE = 0
    REST = 1
    SINES = 2
    TRIANGLE = 3
    PUSH = 4


@cache
def params_dtype(n_axes: int) -> np.dtype[np.void]:  # longer than 50 lines: one table of fields
    """Parameters of a simulated rig of `n_axes` axes."""
    axis = (n_axes,)
    return np.dtype(
        [
            ("period_s", "<f8"),
            ("substeps", "<i8"),  # per period
            ("time_to_live_ticks", "<i8"),  # periods a current is held without a new one
            ("estop_from_s", "<f8"),
            ("estop_to_s", "<f8"),
            ("temperature_c", "<f8"),
            # velocity sensors
            ("velocity_sensor", "<i8"),  # 1: there are some
            ("velocity_share", "<f8"),  # of what is new that their filter takes over in one period
            ("velocity_scale", "<f8"),
            ("velocity_bias_rad_s", "<f8"),
            ("velocity_noise_rad_s", "<f8"),
            ("velocity_resolution_rad_s", "<f8"),
            # force sensor
            ("force_resolution_n", "<f8"),
            ("force_range_n", "<f8"),
            ("force_noise_n", "<f8"),
            ("force_drift_n", "<f8"),  # step of the random walk per period
            ("force_bias_n", "<f8", (3,)),
            ("force_crosstalk", "<f8", (3, 3)),  # measured = matrix @ true
            ("tip_per_joint", "<f8", (3, n_axes)),  # tip force = matrix @ joint torque
            # its moments, and what is mounted on it (hw.simulators.mock_tip)
            ("moment_sensor", "<i8"),  # 1: there are moments
            ("moment_resolution_nm", "<f8"),
            ("moment_range_nm", "<f8"),
            ("moment_noise_nm", "<f8"),
            ("moment_bias_nm", "<f8", (3,)),
            ("force_contact_m", "<f8", (3,)),  # where the hand holds the tip, from the sensor's origin
            ("tip_kg", "<f8"),
            ("tip_center_m", "<f8", (3,)),
            ("gravity_m_s2", "<f8", (3,)),
            ("axis_direction", "<f8", (n_axes, 3)),
            # motor, gear, sensors of each axis
            ("inertia_kgm2", "<f8", axis),
            ("torque_per_ampere", "<f8", axis),
            ("current_max_a", "<f8", axis),
            ("current_noise_a", "<f8", axis),
            ("current_bias_a", "<f8", axis),
            ("current_resolution_a", "<f8", axis),
            ("torque_delay_ticks", "<i8", axis),
            ("ripple_nm", "<f8", axis),
            ("ripple_per_rad", "<f8", axis),  # phase of the gear mesh per link angle
            ("count_rad", "<f8", axis),
            ("encoder_offset", "<f8", axis),  # .5 rounds, 0 truncates
            ("encoder_bits", "<i8", axis),  # width of the counter; 0: endless
            # friction
            ("coulomb_nm", "<f8", axis),
            ("breakaway_nm", "<f8", axis),
            ("stribeck_rad_s", "<f8", axis),
            ("stribeck_exponent", "<f8", axis),
            ("second_share", "<f8", axis),  # of the peak, gone at second_rad_s instead; 0: none
            ("second_rad_s", "<f8", axis),
            ("viscous_nms_rad", "<f8", axis),
            ("thinning_nms_rad", "<f8", axis),  # viscous friction besides, halved at thinning_rad_s; 0: none
            ("thinning_rad_s", "<f8", axis),
            ("bristle_stiffness_nm_rad", "<f8", axis),
            ("bristle_damping_nms_rad", "<f8", axis),
            ("bristle_max_nm", "<f8", axis),  # highest break-away torque anywhere: the bristle holds no more
            ("elastic_share", "<f8", axis),  # z_ba / z_ss of the elasto-plastic model; negative: LuGre
            ("friction_scale_positive", "<f8", axis),
            ("friction_scale_negative", "<f8", axis),
            ("modulation_share", "<f8", axis),
            ("modulation_per_rad", "<f8", axis),
            # hand
            ("hand_kind", "<i8", axis),
            ("hand_stiffness_nm_rad", "<f8", axis),
            ("hand_damping_nms_rad", "<f8", axis),
            ("hand_inertia_kgm2", "<f8", axis),
            ("hand_start_s", "<f8", axis),
            ("hand_center_rad", "<f8", axis),
            ("hand_amplitude_rad", "<f8", axis),
            ("hand_speed_rad_s", "<f8", axis),
            ("hand_hold_s", "<f8", axis),
            ("hand_rest_s", "<f8", axis),
            ("hand_sine_rad", "<f8", (n_axes, SINES)),
            ("hand_sine_rad_s", "<f8", (n_axes, SINES)),
            ("grip_count", "<i8", axis),  # 0: always holds
            ("grip_from_s", "<f8", (n_axes, GRIPS)),
            ("grip_to_s", "<f8", (n_axes, GRIPS)),
            *force_filter_fields(),
            *effect_fields(n_axes),
            *schedule_fields(),
        ]
    )


@cache
def state_dtype(n_axes: int) -> np.dtype[np.void]:
    """State of a simulated rig: the truth behind the sensors."""
    axis = (n_axes,)
    return np.dtype(
        [
            ("started", "<i8"),
            ("first_tick", "<i8"),
            ("tick", "<i8"),  # grid slot the plant has been advanced to
            ("sensed_tick", "<i8"),  # slot that the sensors were read at last
            ("sample_count", "<i8"),
            ("rng", "<u8", (4,)),
            ("normal_spare", "<f8"),
            ("normal_spare_ready", "<i8"),
            ("force_drift_n", "<f8", (3,)),
            ("tip_weight_n", "<f8", (3,)),
            ("held_ticks", "<i8"),  # periods since the newest current came
            ("current_line_a", "<f8", (n_axes, DELAY_LINE)),  # [axis, 0] is the newest command
            ("current_a", "<f8", axis),  # true motor current
            ("motor_torque_nm", "<f8", axis),
            ("position_rad", "<f8", axis),
            ("velocity_rad_s", "<f8", axis),
            ("velocity_filtered_rad_s", "<f8", axis),  # by the velocity sensor
            ("bristle_rad", "<f8", axis),
            ("friction_torque_nm", "<f8", axis),  # opposes motion: same sign as velocity when sliding
            ("hand_torque_nm", "<f8", axis),
            ("hand_position_rad", "<f8", axis),  # where the hand wants the joint
            ("hand_velocity_rad_s", "<f8", axis),
            ("encoder", "<i8", (n_axes, ENCODER_STATE)),  # of the counters of finite width
            *force_filter_state_fields(n_axes),
            *effect_state_fields(n_axes),
            *memory_fields(n_axes),
        ]
    )


def plant_records(options: Options, rig: Rig) -> tuple[np.ndarray, np.ndarray]:
    """Parameters and initial state of the rig that `options` (dumped `MockOptions`) describe.

    Raises
    ------
    BackendError
        If a per-axis table has neither one entry nor one per axis, or the levers depend on each other."""
    params = np.zeros(1, params_dtype(rig.n_axes))
    state = np.zeros(1, state_dtype(rig.n_axes))
    p = params[0]
    p["period_s"] = rig.period_s
    # a period of whole steps gets no step more for its rounding
    p["substeps"] = options["substeps"] or max(1, math.ceil(rig.period_s / SUBSTEP_S - 1e-9))
    for name in ("time_to_live_ticks", "estop_from_s", "estop_to_s", "temperature_c"):
        p[name] = options[name]
    fill_timing(p, options["timing"])
    _fill_force(p, options["force"], rig)
    if options["velocity"] is not None:
        _fill_velocity(p, options["velocity"], rig.period_s)
    for axis, table in enumerate(_per_axis(options, "axis", rig.n_axes)):
        _fill_axis(p, axis, table, rig)
        _fill_friction(p, axis, table["friction"])
        fill_effects(p, state[0], axis, table)
        state[0]["position_rad"][axis] = table["start_position_rad"]
    for axis, table in enumerate(_per_axis(options, "hand", rig.n_axes)):
        _fill_hand(p, axis, table)
    state["rng"] = seed_words(options["seed"])
    # a stream of its own: what a fault draws does not change the noise
    state["fault_rng"] = seed_words(options["seed"] ^ FAULT_STREAM)
    fill_schedule(params, options["faults"], rig)
    return params, state


def _per_axis(options: Options, name: str, n_axes: int) -> list[Any]:
    tables = list(options[name])
    if len(tables) == 1:
        return tables * n_axes
    if len(tables) != n_axes:
        raise BackendError(
            f"mock: {name} has {len(tables)} tables; give one for all, or {n_axes}, one per axis"
        )
    return tables


def _fill_force(p: np.void, table: Options, rig: Rig) -> None:
    p["force_resolution_n"] = table["resolution_n"]
    p["force_range_n"] = table["range_n"]
    p["force_noise_n"] = table["noise_n"]
    # steps of a random walk add up by their squares
    p["force_drift_n"] = table["drift_n_sqrt_s"] * math.sqrt(rig.period_s)
    p["force_bias_n"] = table["bias_n"]
    fill_force_filter(p, table, rig.period_s)
    p["force_crosstalk"] = table["crosstalk"]
    for name in ("tip_kg", "tip_center_m", "gravity_m_s2"):
        p[name] = table[name]
    if rig.axis_direction is not None:
        p["axis_direction"] = rig.axis_direction
    # the hand holds the tip beside the origin: its force turns the joints by that arm as well
    levers = rig.lever_m
    if table["moment"] is not None:
        p["moment_sensor"], p["force_contact_m"] = 1, table["moment"]["contact_m"]
        for name in ("resolution_nm", "range_nm", "noise_nm", "bias_nm"):
            p["moment_" + name] = table["moment"][name]
        levers = levers + np.cross(p["axis_direction"], p["force_contact_m"])
    p["tip_per_joint"] = inverse = np.linalg.pinv(levers)
    if not np.allclose(levers @ inverse, np.eye(rig.n_axes), atol=1e-9):
        raise BackendError(
            f"mock: lever_m {rig.lever_m.tolist()}: no force at the tip gives these joints independent "
            "torques; at most three axes with levers in different directions can be simulated"
        )


def _fill_velocity(p: np.void, table: Options, period_s: float) -> None:
    p["velocity_sensor"] = 1
    # expm1: 1 - exp loses its digits behind a long lag
    p["velocity_share"] = -math.expm1(-period_s / table["lag_s"]) if table["lag_s"] else 1.0
    for name in ("scale", "bias_rad_s", "noise_rad_s", "resolution_rad_s"):
        p["velocity_" + name] = table[name]


def _fill_axis(p: np.void, axis: int, table: Options, rig: Rig) -> None:
    take_numbers(p, axis, table)
    nominal = rig.gear_ratio[axis] * rig.gear_efficiency[axis] * rig.torque_constant_nm_a[axis]
    p["torque_per_ampere"][axis] = nominal * table["torque_scale"]
    p["ripple_per_rad"][axis] = rig.gear_ratio[axis] * table["ripple_order"]
    p["count_rad"][axis] = 2 * math.pi / rig.encoder_counts_per_rev[axis]
    p["encoder_offset"][axis] = 0.5 if table["encoder_rounds"] else 0.0


def _fill_friction(p: np.void, axis: int, table: Options) -> None:
    take_numbers(p, axis, table)
    # below 0: LuGre, whose bristles slide a little under any load (`plastic_share`)
    p["elastic_share"][axis] = table["elastic_share"] if table["model"] == "elasto_plastic" else -1.0
    p["friction_scale_positive"][axis] = table["scale_positive"]
    p["friction_scale_negative"][axis] = table["scale_negative"]
    # of all places and both directions: the plant holds a bristle by one number
    highest = table["breakaway_nm"] * max(table["scale_positive"], table["scale_negative"])
    p["bristle_max_nm"][axis] = highest * (1 + abs(table["modulation_share"]))
    p["modulation_per_rad"][axis] = 2 * math.pi / table["modulation_period_rad"]


def _fill_hand(p: np.void, axis: int, table: Options) -> None:
    kinds = {"none": Hand.NONE, "rest": Hand.REST, "triangle": Hand.TRIANGLE, "push": Hand.PUSH}
    p["hand_kind"][axis] = kinds.get(table["kind"], Hand.SINES)
    take_numbers(p, axis, table, "hand_")
    sines = [[table["amplitude_rad"], table["frequency_hz"]]] if table["kind"] == "sine" else table["sines"]
    for k, (amplitude_rad, frequency_hz) in enumerate(sines):
        p["hand_sine_rad"][axis, k] = amplitude_rad
        p["hand_sine_rad_s"][axis, k] = 2 * math.pi * frequency_hz
    p["grip_count"][axis] = len(table["grips_s"])
    for k, (from_s, to_s) in enumerate(table["grips_s"]):
        p["grip_from_s"][axis, k] = from_s
        p["grip_to_s"][axis, k] = to_s
