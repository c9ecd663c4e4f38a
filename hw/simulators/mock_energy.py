"""Energy stored in the simulated joint: moving masses, bent bristles and elements, the twisted joint."""

from __future__ import annotations

import numpy as np


def stored_j(state: np.ndarray, params: np.ndarray, axis: int) -> np.ndarray:
    """Energy of one axis in each row of `state`, J; `params` is the one row they belong to. Without the
    hand's.

    Bristles of one-bristle models and of the elements are springs of their own; the drift of friction,
    modulation and load change what they may hold, not their stiffness."""
    p = params[0]
    v = state["velocity_rad_s"][..., axis]
    stiffness, elastic = (
        float(p["bristle_stiffness_nm_rad"][axis]),
        float(p["joint_stiffness_nm_rad"][axis]) > 0,
    )
    link = float(p["link_inertia_share"][axis]) if elastic else 0.0
    dry = float(p["link_dry_share"][axis]) if elastic else 0.0
    inertia = float(p["inertia_kgm2"][axis])
    # the state has the velocity of the link, and of the motor what it has more
    motor_v = v + state["joint_twist_rate_rad_s"][..., axis]
    total = 0.5 * inertia * ((1.0 - link) * motor_v**2 + link * v**2)
    # nil where the joint is rigid: its twist stays 0
    total = total + 0.5 * float(p["joint_stiffness_nm_rad"][axis]) * state["joint_twist_rad"][..., axis] ** 2
    for side, share in ((0, 1.0 - dry), (1, dry)):
        if share > 0.0:
            total = total + _bent_j(state, p, axis, side, share * stiffness)
    return np.asarray(total)


def _bent_j(state: np.ndarray, p: np.void, axis: int, side: int, stiffness: float) -> np.ndarray:
    count = int(p["element_count"][axis])
    if count == 0:
        name = "bristle_rad" if side == 0 else "link_bristle_rad"
        return np.asarray(0.5 * stiffness * state[name][..., axis] ** 2)
    # the state has torques of elements: of each the energy is F^2 / 2 k
    each = stiffness * p["element_stiffness"][axis, :count]
    return np.asarray((0.5 * state["element_nm"][..., axis, side, :count] ** 2 / each).sum(axis=-1))
