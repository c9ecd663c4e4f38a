"""A position that loses counts the faster the joint goes: above the highest frequency of an encoder or its
counter."""

from __future__ import annotations

import numpy as np

from rtctl.friction.logs.balance import Balance, Fit

SHARES = np.linspace(0.05, 1.0, 20)
"""Shares of the largest speed by which the true one is larger there, that are tried."""

BETTER = 0.8
"""What it may leave over, RMS, of what friction that bends over speed leaves: that makes no inertia grow with
speed."""


def lost_counts(balance: Balance, plain: Fit) -> tuple[str, Fit] | None:
    """The motion read as quicker the faster it is: w = v (1 + k q), q = (v/V)^2, and so an acceleration a
    (1 + 3 k q)."""
    v, a = balance.velocity, balance.acceleration
    # V of docs/theory.md 9.5; a quantile, since one spike of a velocity would make all the rest slow
    largest = max(float(np.quantile(np.abs(v), 0.99)), 1e-300)
    # 1 at most: beyond the quantile are spikes, which would bend everything
    q = np.minimum((v / largest) ** 2, 1.0)

    def read(share: float) -> Fit:
        # by the chain rule: w = v + k v^3/V^2, so dw/dt = a (1 + 3 k q)
        return balance.fit(
            motion=np.column_stack([a * (1 + 3 * share * q), v * (1 + share * q), balance.direction])
        )

    fits = [read(float(share)) for share in SHARES]
    best = int(np.argmin([fit.rest for fit in fits]))
    # friction that bends is what it must beat: both make a torque that grows with speed
    bent = balance.fit(added=np.column_stack([v * q, v * np.abs(v)]))
    if fits[best].rest > BETTER * bent.rest or not (fits[best].inertia > 0 and fits[best].coulomb > 0):
        return None
    return (
        "the joint looks heavier the faster it goes, as where counts of the position are lost at speed: "
        f"were it {100 * SHARES[best]:.0f} % faster at {largest:.3g} rad/s than the position says, "
        f"{100 * fits[best].rest / balance.spread:.2g} % of the torque is left over instead of "
        f"{100 * plain.rest / balance.spread:.2g} %; look at the highest frequency of encoder, filter and "
        "counter, or move slower",
        fits[best],
    )
