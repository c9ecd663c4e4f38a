"""How much delay the proof of a coupling covers: what the measured delay is compared with while the rig runs.

Pure functions of numbers, at the start of a run; symbols as in `stability`.

A first-order lag of tau behind the delay is counted as a delay of tau: that asks at least as much damping
as the lag does, to within 2 % (over a grid in the tests), and the two are hard to tell apart in what a
sampled current shows.

What is covered beyond the declared delay is a delay that stays: that it goes on to vary by the declared
jitter would ask for up to 1.7 times the damping by the bound of `sampled_loop.varying_peaks`, and stop boards
with a clock of their own for every tick without a sample (decision 0180)."""

from __future__ import annotations

from functools import lru_cache

from rtctl.control.proofs.stability import Between, damping_needed_between, damping_needed_sampled_data

MOST_TICKS = 20.0
"""Longest delay that is looked at, periods: what a rig file may declare."""

RESOLUTION_TICKS = 0.002
"""A fiftieth of what a test pulse resolves (`current_answer.TOLERANCE_TICKS`)."""


@lru_cache(maxsize=256)
def delay_covered_ticks(
    b: float, k_c: float, b_c: float, T: float, declared_ticks: float, sample_ticks: int = 1
) -> float:
    """Largest delay up to which this coupling stays proven, periods; never less than the declared one.

    Parameters
    ----------
    b : float
        Guaranteed damping of the device, N m s/rad.
    declared_ticks : float
        Delay the rig file declares. Where the coupling is not even proven there, that is another test's to
        refuse; here the declared delay is what a measured one may not exceed.
    sample_ticks : int
        Ticks between two fresh samples, n. The delay that is returned has their age in it, n - 1; without it,
        it is covered by the proof of held samples, too (docs/theory.md 2.6).

    Notes
    -----
    Past its least value, in the first quarter of a period, the damping needed rises with the delay, so the
    bound is found by halving."""

    def passes(delta: float) -> bool:
        # the bound that `rtctl check` refuses by, from above: a sweep of its own lay 2 % below it at 20 ticks
        if not damping_needed_sampled_data(k_c, b_c, T, delta) <= b:  # NaN passes nothing
            return False
        # a delay of n - 1 ticks is no held sample: a damper acts in one tick of n, and asks for more
        held = Between(delay=max(delta - sample_ticks + 1, 0.0), sample_ticks=sample_ticks)
        return sample_ticks == 1 or damping_needed_between(k_c, b_c, T, held) <= b

    low, high = declared_ticks, max(MOST_TICKS, declared_ticks)
    if not passes(low):
        return low
    if passes(high):
        return high
    while high - low > RESOLUTION_TICKS:  # what is returned passes: `low`
        middle = 0.5 * (low + high)
        low, high = (middle, high) if passes(middle) else (low, middle)
    return low
