"""Static friction of the joint in configs/mock*.toml, written down a second time: tests judge by it what the
mock gives.
"""

import numpy as np

COULOMB_NM, BREAKAWAY_NM = 0.25, 0.35
BACKWARD = 1.06


def law_nm(speed_rad_s, direction=1):
    """Magnitude over speeds >= 0, mean over a turn: a peak of two speeds, and viscous friction that thins
    out.
    """
    v = np.asarray(speed_rad_s, dtype=float)
    peak = 0.5 * np.exp(-((v / 0.06) ** 2)) + 0.5 * np.exp(-((v / 0.5) ** 2))
    viscous = 0.05 + 0.02 / (1 + (v / 2.0) ** 2)
    forward = COULOMB_NM + (BREAKAWAY_NM - COULOMB_NM) * peak + viscous * v
    return forward if direction > 0 else BACKWARD * forward
