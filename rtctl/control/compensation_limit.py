"""How far the friction feed-forward may go: the one formula of cap and gate, for the law, the margins and the
report.

Plain functions of numbers or arrays, without Numba: `control.feedforward` compiles them for the law, the
proofs call them on whole curves (docs/theory.md 5.5). N m, N m s/rad and shares."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from rtctl.control.vocabulary import Policy

Value = TypeVar("Value", float, np.ndarray)
"""A number in the law, an array in the proofs."""

FORCE_GATED = (int(Policy.HYBRID), int(Policy.INTENT), int(Policy.STOP_GATED))
"""Policies whose torque goes to zero with the hand's; the others are capped below the least dry friction,
too."""

GATED = (int(Policy.HYBRID), int(Policy.STOP_GATED))
"""Policies multiplied by the gate; INTENT is proportional to the hand's torque already."""


FACTOR_LEAST, FACTOR_MOST = 0.7, 1.1
"""Factors of the learned friction between which a feed-forward may follow the friction that is seen
(docs/theory.md 5.10)."""


def is_force_gated(policy: int) -> bool:
    """True for policies whose torque goes to zero with the hand's."""
    # plain numbers: compiled code looks into no enumeration
    return policy in FORCE_GATED


def feedforward_limit(
    friction_nm: Value,
    viscous_nm: Value,
    gain: float,
    viscous_gain: float,
    fade: Value | float,
    cap_nm: float,
    load_nm: Value | float = 0.0,
) -> Value:
    """Most torque the feed-forward can give where the model says `friction_nm`, N m, >= 0; NaN stays NaN.

    Notes
    -----
    ``min((kappa (Fhat - b_v v) + kappa_v b_v v + load) fade, cap)``, not below 0: kappa acts on the Coulomb
    and Stribeck part, kappa_v on the viscous part `viscous_nm`; `load_nm` is the share wanted of what the
    load adds; `fade` is 1 within the trained range."""
    # the viscous part by itself: the coupling is proved with the damping that `viscous_gain` leaves of it
    wanted = (gain * (friction_nm - viscous_nm) + viscous_gain * viscous_nm + load_nm) * fade
    # NumPy's: of numbers and of arrays, and NaN passes both
    most: Value = np.maximum(np.minimum(wanted, cap_nm), 0.0)
    return most


def cap_in_force(force_gated: bool, cap_nm: float, ungated_cap_nm: float) -> float:
    """Cap of a policy, N m: the rig file's, and without a force gate at most kappa times the least dry
    friction."""
    # nobody's hand closes the gate of the others: of a wrong sign they must not move a joint by themselves
    return cap_nm if force_gated else min(cap_nm, ungated_cap_nm)


def ungated_cap(gain: float, least_dry_nm: float) -> float:
    """What a policy without a force gate may give, N m: kappa times the least dry friction of the curve."""
    return gain * least_dry_nm
