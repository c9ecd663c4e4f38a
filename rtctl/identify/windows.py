"""How long runs and windows are, in time and travel."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rtctl.identify.motion import LOOK_S, Motion
from rtctl.identify.travel_guard import SPARE_S

# one count is then a twelfth of the way; less, and the speed of a window is the encoder's
COUNTS_PER_WINDOW = 12
WINDOW_MAX_S = 2.0
STEADY_RAD, STEADY_MIN_S, STEADY_MAX_S = 0.004, 0.1, 1.0
"""The steady-state test looks at the time for this travel (dry friction settles over a distance), within
bounds."""
STEADY_LENGTHS = 2.5
"""The travel of the steady-state test in presliding lengths, where that is longer."""


@dataclass(frozen=True)
class Allowance:
    """How a motion at a speed is judged: over which window, and what a ripple alone may do to it.

    `travel_rad` is what must have been travelled before; `pairs`: the window is an even number of periods of
    the ripple."""

    window_s: float
    pairs: bool
    travel_rad: float = 0.0
    change_nm: float = 0.0
    speed_share: float = 0.0

    @classmethod
    def of(cls, motion: Motion, speed_rad_s: float) -> Allowance:
        """For a speed of this joint."""
        length_s, pairs = steady_window(motion, speed_rad_s)
        ripple, unevenness = motion.ripple, motion.cogging.slope_nm_rad / motion.rig.stiffness_nm_rad
        if pairs or ripple.amplitude_nm <= 0.0:
            return cls(length_s, pairs, speed_share=unevenness)
        # too slow for whole periods: the window sees a slope that it cannot tell from a drift
        share = ripple.slope_nm_rad / motion.rig.stiffness_nm_rad
        change = ripple.change_nm(speed_rad_s * length_s)
        return cls(length_s, pairs, 3.0 * settle_rad(motion), change, share + unevenness)


def per_place(motion: Motion) -> int:
    """Measurements taken at one place."""
    return -(-motion.settings.measurements // motion.settings.spots)  # rounded up


def window_s(motion: Motion, speed_rad_s: float) -> float:
    """Length of one measurement: as set, but enough counts, and no more than half of the travel left.

    Those of one place together are whole periods of the gear's ripple where they are long enough for one."""
    wanted = max(motion.settings.window_s, COUNTS_PER_WINDOW * motion.rig.count_rad / speed_rad_s)
    # before the bounds: of a travel that is too short for whole periods the places have to average
    wanted = motion.ripple.whole_window_s(wanted, per_place(motion), speed_rad_s)
    room = motion.high_rad - motion.low_rad - run_up_rad(motion, speed_rad_s)
    return min(wanted, WINDOW_MAX_S, max(0.5 * room / speed_rad_s, 0.02))


def settle_rad(motion: Motion) -> float:
    """Travel over which dry friction settles."""
    # a length that was measured goes before what most joints have, where it is longer
    return max(STEADY_RAD * motion.rig.radian, STEADY_LENGTHS * motion.presliding_rad)


def steady_window(motion: Motion, speed_rad_s: float) -> tuple[float, bool]:
    """Length of the steady-state test's window (s), and whether it is an even number of periods of the
    ripple."""
    short_s = min(max(settle_rad(motion) / speed_rad_s, STEADY_MIN_S), STEADY_MAX_S)
    pairs_s = motion.ripple.two_periods_s(speed_rad_s, short_s)
    return pairs_s or short_s, pairs_s is not None


def steady_s(motion: Motion, speed_rad_s: float) -> float:
    """Length of the steady-state test's window."""
    return steady_window(motion, speed_rad_s)[0]


def run_up_rad(motion: Motion, speed_rad_s: float) -> float:
    """Travel of a run beside its measurements: speeding up, becoming steady, stopping."""
    up = speed_rad_s**2 / (2 * motion.acceleration_rad_s2)
    return up + (steady_s(motion, speed_rad_s) + 2 * LOOK_S) * speed_rad_s + motion.stopping_rad(speed_rad_s)


def fastest_rad_s(motion: Motion) -> float:
    """Highest speed at which the travel leaves room for a run with a window of 20 ms."""
    travel = motion.high_rad - motion.low_rad
    # v^2/a + b v = travel, solved for v; .04: a window, and as much room
    b = STEADY_MIN_S + 2 * LOOK_S + SPARE_S + 0.04
    root = math.sqrt(b * b + 4 * travel / motion.acceleration_rad_s2)
    return 0.5 * motion.acceleration_rad_s2 * (root - b)
