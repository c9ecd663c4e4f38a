"""The facts of a rig that a backend is made for: those of the shipped joint, and others where a test says
so.
"""

import numpy as np

from hw.interface import Rig

LEVER_M = ((0.0, 0.1, 0.0), (0.0, 0.0, 0.1), (0.1, 0.0, 0.0))


def rig(
    n_axes=1,
    period_s=1e-3,
    *,
    gear_ratio=80.0,
    gear_efficiency=0.72,
    torque_constant_nm_a=0.0134,
    encoder_counts_per_rev=160_000.0,
    lever_m=LEVER_M,
):
    """Every axis has the same gear, motor and encoder; of the levers the first `n_axes` rows count."""
    each = (gear_ratio, gear_efficiency, torque_constant_nm_a, encoder_counts_per_rev)
    return Rig(
        n_axes, period_s, *(np.full(n_axes, float(value)) for value in each), np.array(lever_m)[:n_axes]
    )
