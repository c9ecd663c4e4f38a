"""Torque that comes back with every turn of the motor: how much there is, and how to average it out.

A gear's ripple has the period 2 pi / gear ratio of the joint (`--ripple-per-turn` where it is another). A
mean over whole periods does not see it; nor does one over places whose phases are even. What it does to the
test of a steady motion depends on how large it is, so it is measured once, after the warm-up."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

HARMONICS = 3
MATTERS_SHARE = 0.03
"""Share of the torque below which a ripple disturbs no test of a steady motion and counts as none."""
SURE = 1.5
"""Factor on the ripple measured: it need not be the same at every speed and place."""
WHOLE_S = 2.0
"""Longest window of two periods."""


@dataclass(frozen=True)
class Ripple:
    """A ripple of the joint.

    Attributes
    ----------
    period_rad
        Travel of the joint in one period; 0: none is expected.
    amplitude_nm
        Sum of its harmonics' amplitudes times their numbers, so that 2 pi amplitude / period bounds its
        slope, N m; 0: too small to matter."""

    period_rad: float = 0.0
    amplitude_nm: float = 0.0

    def change_nm(self, travel_rad: float) -> float:
        """Most by which it can change the torque over a travel."""
        if self.period_rad <= 0.0:
            return 0.0
        # from crest to trough at most, and over a short way no more than its slope makes
        return SURE * self.amplitude_nm * min(2.0, 2.0 * math.pi * travel_rad / self.period_rad)

    @property
    def slope_nm_rad(self) -> float:
        """Most by which it changes the torque per travel."""
        return SURE * self.amplitude_nm * 2.0 * math.pi / self.period_rad if self.period_rad > 0.0 else 0.0

    def two_periods_s(self, speed_rad_s: float, least_s: float) -> float | None:
        """Length of the shortest window of an even number of periods that is no shorter than `least_s`.

        None when that is too long, or when there is no ripple that matters."""
        if self.amplitude_nm <= 0.0:
            return None
        pair_s = 2.0 * self.period_rad / speed_rad_s
        # pairs, since two halves are compared phase by phase
        whole_s = math.ceil(least_s / pair_s) * pair_s
        return whole_s if whole_s <= WHOLE_S else None

    def whole_window_s(self, window_s: float, windows: int, speed_rad_s: float) -> float:
        """Window length near `window_s` of which so many in a row are whole periods, where they are about one
        or more."""
        if self.period_rad <= 0.0:
            return window_s
        periods = math.floor(windows * window_s * speed_rad_s / self.period_rad + 0.5)
        return periods * self.period_rad / (windows * speed_rad_s) if periods else window_s

    def travel_to(self, position_rad: float, phase_share: float, direction: int) -> float:
        """Travel in `direction` to the next position of a phase (share of a period), less than a period."""
        if self.period_rad <= 0.0:
            return 0.0
        return (phase_share * self.period_rad - position_rad) * direction % self.period_rad


def measured(position_rad: np.ndarray, torque_nm: np.ndarray, period_rad: float) -> Ripple:
    """Ripple in the torque of an even motion over some periods, by least squares on its harmonics beside a
    line.

    Parameters
    ----------
    position_rad, torque_nm : array, shape (n,)
        Consecutive ticks over at least two periods."""
    angle = 2.0 * math.pi * position_rad / period_rad
    # a line beside them: friction that drifts along the way is no ripple
    columns = [np.ones_like(angle), position_rad - np.mean(position_rad)]
    for n in range(1, HARMONICS + 1):
        columns += [np.cos(n * angle), np.sin(n * angle)]
    found, *_ = np.linalg.lstsq(np.column_stack(columns), torque_nm, rcond=None)
    sizes = np.hypot(found[2::2], found[3::2])
    # by their numbers: a harmonic is as much steeper, and slopes are what a test of steadiness meets
    amplitude = float(sizes @ np.arange(1, HARMONICS + 1))
    matters = SURE * amplitude > MATTERS_SHARE * abs(float(np.mean(torque_nm)))
    return Ripple(period_rad, amplitude if matters else 0.0)
