"""What a model says of friction that grows with the torque through the gear (docs/theory.md 8.10)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np

from rtctl.control.records import LOAD_CELLS

LOOP_MOST = 0.5
"""Most torque that the compensation of load may add for each N m that goes through the gear: `rtctl check`
refuses more."""


COEFFICIENTS = (
    "outside",
    "motor",
    "outside_peak",
    "motor_peak",
    "outside_square_per_nm",
    "motor_square_per_nm",
)
"""Those of the load, in N m per N m; the squares per N m more."""

IN_LAW = (*COEFFICIENTS, "most_nm")
"""What the law's record has by name; beside them stands the fall with speed, as a table."""


def added_nm(
    of: Mapping[str, float], fall: np.ndarray, outside_nm: np.ndarray, motor_nm: np.ndarray
) -> np.ndarray:
    """What the load adds, N m: `control.load_friction.load_magnitude` for arrays; `of` has the coefficients
    `IN_LAW` by name."""
    most = of["most_nm"]
    # beyond what was measured friction is taken to rise no further: the squares would run away
    e, m = (np.clip(torque, -most, most) for torque in (outside_nm, motor_nm))
    against = e * m < 0
    square = np.where(against & (np.abs(e) < np.abs(m)), of["outside_square_per_nm"] * e**2, 0.0)
    square += np.where(against & (np.abs(e) > np.abs(m)), of["motor_square_per_nm"] * m**2, 0.0)
    peak = np.abs(of["outside_peak"] * e - of["motor_peak"] * m) + square
    return np.asarray(np.abs(of["outside"] * e - of["motor"] * m) + fall * peak)


def peak_left(speed: np.ndarray, first: float, power: float, share: float, second: float) -> np.ndarray:
    """Share of the peak that is left at each speed: (1 - share) exp(-(v / first)^power) + share exp(-(v /
    second)^power)."""
    v = np.asarray(speed)
    return np.asarray(
        (1 - share) * np.exp(-((v / first) ** power)) + share * np.exp(-((v / second) ** power))
    )


@dataclass(frozen=True)
class Load:
    """Coefficients of `learn.load_terms`, all >= 0: N m of friction per N m of the hand's and of the motor's
    torque.

    `outside` and `motor` hold at every speed; what ends in `_peak`, and the squares, which belong to one
    direction of the power each, fall with speed as `peak_left` says."""

    outside: float
    motor: float
    outside_peak: float
    motor_peak: float
    outside_square_per_nm: float
    motor_square_per_nm: float
    stribeck_rad_s: float
    stribeck_power: float
    most_nm: float
    """Largest torque that was measured, N m: greater ones add no more."""
    doubt_share: float
    """Most that what the load adds may be off by, share of it, beside what the curve without load may be."""
    second_share: float = 0.0
    """Share of the peak that falls at the second speed; 0: there is one speed."""
    second_rad_s: float = 1.0

    def added_nm(self, speed: np.ndarray, outside_nm: np.ndarray, motor_nm: np.ndarray) -> np.ndarray:
        """What the load adds, N m, at each speed (rad/s, >= 0) and pair of torques of one sign:
        `control.load_friction` for arrays."""
        return added_nm(self.body(), self.fall(speed), outside_nm, motor_nm)

    def fall(self, speed: np.ndarray) -> np.ndarray:
        """Share of the peak that is left at each speed, rad/s, >= 0."""
        return peak_left(
            speed, self.stribeck_rad_s, self.stribeck_power, self.second_share, self.second_rad_s
        )

    def share(self, torque_nm: float) -> float:
        """Most friction that one more N m of both torques adds at torques up to `torque_nm`, N m per N m."""
        return self.motor_share(torque_nm) + self._outside_share(torque_nm)

    def motor_share(self, torque_nm: float) -> float:
        """The motor's part of it."""
        most = min(torque_nm, self.most_nm)
        return self.motor + self.motor_peak + 2 * self.motor_square_per_nm * most

    def _outside_share(self, torque_nm: float) -> float:
        most = min(torque_nm, self.most_nm)
        return self.outside + self.outside_peak + 2 * self.outside_square_per_nm * most

    def most_added_nm(self, torque_nm: float) -> float:
        """Bound of what torques up to `torque_nm` add at any speed, N m."""
        return self.share(torque_nm) * min(torque_nm, self.most_nm)

    @property
    def sure_share(self) -> float:
        """Share of what the load adds that is surely there."""
        return max(0.0, 1.0 - self.doubt_share)

    def fill(self, row: np.void) -> None:
        """Fill the fields `load_` of a `MODEL` record whose trained range is known; the doubt is of the
        proofs, not of the law."""
        for name in IN_LAW:
            row[f"load_{name}"] = getattr(self, name)
        # both directions share one table of the fall
        fastest = float(row["speed_max_rad_s"].max())
        row["load_cells_s_rad"] = LOAD_CELLS**4 / fastest
        # even over the fourth root: it falls near standstill, and a root costs the law less than a power
        row["load_fall"] = self.fall(np.linspace(0.0, 1.0, LOAD_CELLS + 1) ** 4 * fastest)

    def body(self) -> dict[str, float]:
        """As the model file has it."""
        return asdict(self)
