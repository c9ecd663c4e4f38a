"""Records of the effects a joint may have beyond the plain one: their fields, and how the options fill them.

All zeros is the plain joint. Code that sets fields of the parameters itself finds their meaning here; what is
off costs a comparison per period."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from hw.interface import Options
from hw.kept_readings import kept_field

ELEMENTS = 16
"""Most elements of the Maxwell-slip model."""

WAVES = 8
"""Most waves of the dry friction over position, and of the torque ripple."""

POINTS = 16
"""Most points of a drift's script."""

SIDES = 2
"""Motor side and link side."""


def effect_fields(n_axes: int) -> list[tuple[Any, ...]]:
    """Parameters of the effects."""
    axis = (n_axes,)
    return [
        # timing of the whole device
        ("sample_every_ticks", "<i8"),  # above 1: a fresh sample only so often
        ("transport_delay_ticks", "<f8"),  # of the current, on top of torque_delay_ticks; 16 together at most
        # Maxwell-slip elements instead of the one bristle; shares of the joint's dry friction and of its
        # stiffness
        ("element_count", "<i8", axis),  # 0: one bristle
        ("element_strength", "<f8", (n_axes, ELEMENTS)),
        ("element_stiffness", "<f8", (n_axes, ELEMENTS)),
        # elastic joint: two masses
        ("joint_stiffness_nm_rad", "<f8", axis),  # 0: rigid
        ("joint_damping_nms_rad", "<f8", axis),
        ("link_inertia_share", "<f8", axis),  # of inertia_kgm2; the rest is the motor's
        ("link_viscous_share", "<f8", axis),  # of viscous_nms_rad
        ("link_dry_share", "<f8", axis),  # of the dry friction, its bristles included
        ("encoder_at_link", "<f8", axis),  # 1: it turns with the link, 0: with the motor
        ("current_lag_s", "<f8", axis),  # time constant of the current loop; 0: none
        # (amplitude, waves per turn of the link, phase rad): share of the dry friction; N m at the motor side
        ("friction_wave_count", "<i8", axis),
        ("friction_wave", "<f8", (n_axes, WAVES, 3)),
        ("ripple_wave_count", "<i8", axis),
        ("ripple_wave", "<f8", (n_axes, WAVES, 3)),
        # load-dependent friction (hw.simulators.mock_load)
        ("load_kind", "<i8", axis),  # 0: none
        ("load_outside", "<f8", axis),
        ("load_motor", "<f8", axis),
        ("load_outside_peak", "<f8", axis),
        ("load_motor_peak", "<f8", axis),
        ("load_outside_square_nm", "<f8", axis),  # 1 / (N m)
        ("load_motor_square_nm", "<f8", axis),
        # drift (hw.simulators.mock_drift)
        ("drift_count", "<i8", axis),
        ("drift_s", "<f8", (n_axes, POINTS)),
        ("drift_dry", "<f8", (n_axes, POINTS)),  # factor of the dry friction
        ("drift_viscous", "<f8", (n_axes, POINTS)),
        ("warm_count", "<i8", axis),
        ("warm_s", "<f8", (n_axes, POINTS)),
        ("warm_c", "<f8", (n_axes, POINTS)),
        ("dry_per_c", "<f8", axis),
        ("viscous_per_c", "<f8", axis),
        ("drift_reference_c", "<f8", axis),  # temperature at which the factors are 1
    ]


def effect_state_fields(n_axes: int) -> list[tuple[Any, ...]]:
    """State of the effects. `bristle_rad` is the motor side's; with elements, that of one bristle of equal
    torque."""
    axis = (n_axes,)
    return [
        ("joint_twist_rad", "<f8", axis),  # motor side minus link side
        ("joint_twist_rate_rad_s", "<f8", axis),
        ("link_bristle_rad", "<f8", axis),
        ("link_friction_nm", "<f8", axis),  # the link side's part of friction_torque_nm
        ("element_nm", "<f8", (n_axes, SIDES, ELEMENTS)),  # torque of each element
        ("dry_factor", "<f8", axis),  # drift of the friction as it is now
        ("viscous_factor", "<f8", axis),
        ("sampled_slot", "<i8"),  # of a slow device: 1 + number of its newest sample, and what it showed
        ("sampled_estop", "<i8"),
        kept_field("sampled", n_axes),
    ]


def take_numbers(p: np.void, axis: int, table: Options, prefix: str = "") -> None:
    """Write every number of a table into the parameter that has its name behind the prefix, if there is
    one."""
    for name, value in table.items():
        if isinstance(value, int | float) and prefix + name in (p.dtype.names or ()):
            p[prefix + name][axis] = value


def fill_timing(p: np.void, table: Options) -> None:
    """Write [device.options.timing] into the parameters."""
    p["sample_every_ticks"] = table["sample_every_ticks"]
    p["transport_delay_ticks"] = table["transport_delay_ticks"]


def fill_effects(p: np.void, state: np.void, axis: int, table: Options) -> None:
    """Write the effects of one [[device.options.axis]] into the parameters, and where they begin into the
    state."""
    state["dry_factor"][axis] = state["viscous_factor"][axis] = 1.0
    if table["friction"]["model"] == "gms":
        fill_elements(p, axis, table["friction"]["elements"])
    lag_s = table["current_loop"]["time_constant_s"] if table["current_loop"] else 0.0
    if table["current_loop"] and table["current_loop"]["bandwidth_hz"]:
        lag_s = 1.0 / (2.0 * math.pi * table["current_loop"]["bandwidth_hz"])
    p["current_lag_s"][axis] = lag_s
    if table["elastic"]:
        _fill_elastic(p, axis, table["elastic"])
    if table["waves"]:
        _fill_waves(p, axis, "friction_wave", table["waves"]["friction"])
        _fill_waves(p, axis, "ripple_wave", table["waves"]["ripple"])
        more = sum(abs(share) for share, _, _ in table["waves"]["friction"])
        p["bristle_max_nm"][axis] *= 1.0 + more / (1.0 + abs(p["modulation_share"][axis]))
    if table["load"]:
        p["load_kind"][axis] = 1
        take_numbers(p, axis, table["load"], "load_")
    if table["drift"]:
        _fill_drift(p, axis, table["drift"])


def fill_elements(p: np.void, axis: int, count: int) -> None:
    """Give the axis `count` Maxwell-slip elements: equally stiff, sliding one after the other at equal
    distances.

    Element i of N slides at the share i / N of the longest deflection and holds 2 i / (N (N + 1)) of the dry
    friction; the last one slides at 2 N / (N + 1) F / sigma0."""
    places = np.arange(1, count + 1)
    p["element_count"][axis] = count
    p["element_strength"][axis, :count] = places / places.sum()
    p["element_stiffness"][axis, :count] = 1.0 / count


def _fill_elastic(p: np.void, axis: int, table: Options) -> None:
    p["joint_stiffness_nm_rad"][axis] = table["stiffness_nm_rad"]
    p["joint_damping_nms_rad"][axis] = table["damping_nms_rad"]
    take_numbers(p, axis, table)
    p["encoder_at_link"][axis] = 1.0 if table["encoder"] == "link" else 0.0


def _fill_waves(p: np.void, axis: int, name: str, waves: Sequence[tuple[float, ...]]) -> None:
    p[name + "_count"][axis] = len(waves)
    for k, wave in enumerate(waves):
        p[name][axis, k] = wave


def _fill_drift(p: np.void, axis: int, table: Options) -> None:
    p["drift_count"][axis] = len(table["points"])
    for k, (at_s, dry, viscous) in enumerate(table["points"]):
        p["drift_s"][axis, k], p["drift_dry"][axis, k], p["drift_viscous"][axis, k] = at_s, dry, viscous
    p["warm_count"][axis] = len(table["temperature"])
    for k, (at_s, celsius) in enumerate(table["temperature"]):
        p["warm_s"][axis, k], p["warm_c"][axis, k] = at_s, celsius
    take_numbers(p, axis, table)
    p["drift_reference_c"][axis] = table["reference_c"]
