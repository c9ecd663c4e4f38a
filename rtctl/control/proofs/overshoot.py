"""A current loop that overshoots, as one of first order that is later and stronger.

A loop of second order lets more of a vibration pass than one of first order of the same bandwidth, and lets
it pass later. Every proof here has a first-order lag, so the loop is judged as one that is worse; overshoots
of up to .35 of a step were compared."""

from __future__ import annotations

import math

LATER, LATER_BY_SHARE = 1.3, 1.5
"""Delay besides the lag, in time constants of the bandwidth: the first, and the second for each share of
overshoot. The least that would do is .89 of 4 %, 1.38 of 10 %, 1.54 of 25 %, 1.77 of 37 % (decision 0172)."""


def peak_gain(share: float) -> float:
    """Largest gain over all frequencies of a second-order loop that overshoots a step by so much, 1 at
    least."""
    if share <= 0:
        return 1.0
    ratio = damping_ratio(share)
    # from a damping ratio of .71 on no frequency passes enlarged
    return 1 / (2 * ratio * math.sqrt(1 - ratio * ratio)) if ratio < math.sqrt(0.5) else 1.0


def damping_ratio(share: float) -> float:
    """Damping ratio of a second-order loop that overshoots a step by `share` of it, above 0 and below 1."""
    log = math.log(share)
    return -log / math.hypot(math.pi, log)


def later_s(share: float, bandwidth_hz: float) -> float:
    """Delay, s, that a loop of this bandwidth (-3 dB) has besides a first-order lag of it; 0 without
    overshoot, or without a lag.

    Notes
    -----
    docs/theory.md 2.19: found by comparing alias sums of both, no proof."""
    if share <= 0 or bandwidth_hz <= 0:
        return 0.0
    return (LATER + LATER_BY_SHARE * share) / (2 * math.pi * bandwidth_hz)
