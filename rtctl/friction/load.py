"""What a model says of friction that grows with the torque through the gear (docs/theory.md 8.10)."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields

import numpy as np

LOOP_MOST = 0.5
"""Most torque that the compensation of load may add for each N m that goes through the gear: `rtctl check` refuses more."""


@dataclass(frozen=True)
class Load:
    """Coefficients of `learn.load_terms`, all >= 0: N m of friction per N m of the hand's and of the motor's torque.

    `outside` and `motor` hold at every speed; what ends in `_peak`, and the squares, which belong to one direction of the power
    each, fall with speed as exp(-(v / stribeck_rad_s)^stribeck_power).
    """

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

    def added_nm(self, speed: np.ndarray, outside_nm: np.ndarray, motor_nm: np.ndarray) -> np.ndarray:
        """What the load adds, N m, at each speed (rad/s, >= 0) and pair of torques of one sign: `control.load_friction` for arrays."""
        e, m = (np.clip(torque, -self.most_nm, self.most_nm) for torque in (outside_nm, motor_nm))
        against = e * m < 0
        square = np.where(against & (np.abs(e) < np.abs(m)), self.outside_square_per_nm * e**2, 0.0)
        square += np.where(against & (np.abs(e) > np.abs(m)), self.motor_square_per_nm * m**2, 0.0)
        peak = np.abs(self.outside_peak * e - self.motor_peak * m) + square
        fall = np.exp(-((np.asarray(speed) / self.stribeck_rad_s) ** self.stribeck_power))
        return np.asarray(np.abs(self.outside * e - self.motor * m) + fall * peak)

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

    @classmethod
    def of(cls, row: np.void) -> Load | None:
        """The load of a `MODEL` record, which knows no doubt; None where it has none."""
        names = [one.name for one in fields(cls) if one.name != "doubt_share"]
        values = {name: float(row[f"load_{name}"]) for name in names}
        return cls(**values, doubt_share=0.0) if values["most_nm"] > 0 else None

    @property
    def sure_share(self) -> float:
        """Share of what the load adds that is surely there."""
        return max(0.0, 1.0 - self.doubt_share)

    def fill(self, row: np.void) -> None:
        """Fill the fields `load_` of a `MODEL` record; the doubt is of the proofs, not of the law."""
        for name, value in self.body().items():
            if name != "doubt_share":
                row[f"load_{name}"] = value

    def body(self) -> dict[str, float]:
        """As the model file has it."""
        return asdict(self)
