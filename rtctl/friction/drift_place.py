"""What the law's record says of a joint's place, for arrays: `rtctl.control.place_friction` over many rows at
once."""

from __future__ import annotations

import math

import numpy as np

from rtctl.control.records import CONSERVATIVE_CELLS, PLACE_ORDERS, PLACE_SEGMENTS


def of_place(row: np.void, branch: int, speed: np.ndarray, position: np.ndarray) -> np.ndarray:
    """What place adds to the friction of one direction, N m, at speeds (rad/s, >= 0) and positions (rad);
    0 for a model without place."""
    found = np.zeros_like(speed)
    orders = min(int(row["place_orders"][branch]), PLACE_ORDERS)
    if orders < 1:
        return found
    n = min(int(row["n_segments"][branch]), PLACE_SEGMENTS)
    knot = row["knot_rad_s"][branch][: n + 1]
    # held at the ends of what was taught, as the law does
    u = np.clip(speed, knot[0], knot[n])
    j = np.clip(np.searchsorted(knot[:n], u, side="right") - 1, 0, n - 1)
    h = u - knot[j]
    angle = 2.0 * math.pi * float(row["place_turns_per_rad"]) * position
    for order in range(1, orders + 1):
        for wave, at in ((np.cos(order * angle), 2 * order - 2), (np.sin(order * angle), 2 * order - 1)):
            c = row["place_coefficient"][branch][j, at]
            found += wave * _cubic(c, h)
    return found


def of_conservative(row: np.void, position: np.ndarray) -> np.ndarray:
    """Torque that place alone exerts on the joint, N m, positive along +x; 0 without one."""
    turns = float(row["conservative_per_rad"]) * position
    at = (turns - np.floor(turns)) * CONSERVATIVE_CELLS
    # a share of a turn that rounds to 1 is in the last cell; NaN stays NaN by its share of the cell
    j = np.minimum(np.nan_to_num(at).astype(int), CONSERVATIVE_CELLS - 1)
    return _cubic(row["conservative"][j], at - j)


def _cubic(c: np.ndarray, h: np.ndarray) -> np.ndarray:
    return np.asarray(c[:, 0] + h * (c[:, 1] + h * (c[:, 2] + h * c[:, 3])))
