"""The balance of torques on the sliding rows of logs, fitted with or without further causes
(`rtctl.friction.logs.balance_faults`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtctl.friction.logs.offsets import offset_columns
from rtctl.friction.logs.other_readings import PEAK_SHARE
from rtctl.friction.logs.regressors import Regressors

ROWS_ALIKE = 5
"""Rows that say the same: they are a tenth of a period of the cut-off apart."""

VISCOUS_LEAST = 0.1
"""Most that viscous friction may come out negative, as torque at the usual speed, share of Coulomb
friction."""


@dataclass(frozen=True)
class Fit:
    """A least-squares fit of the balance: inertia, viscous and Coulomb friction, the added coefficients, what
    is left over (RMS)."""

    inertia: float
    viscous: float
    coulomb: float
    added: np.ndarray
    rest: float

    def is_joint(self, speed_rad_s: float) -> bool:
        """Whether these are parameters of a joint that goes at that speed, RMS: a part of a log that hardly
        tells them has any."""
        return (
            self.inertia > 0
            and self.coulomb > 0
            and self.viscous * speed_rad_s > -VISCOUS_LEAST * self.coulomb
        )


@dataclass(frozen=True)
class Balance:
    """Sliding rows of the logs; `external_nm` None where only one torque is mapped. Arrays of one length."""

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    direction: np.ndarray
    torque: np.ndarray
    external: np.ndarray | None
    nuisance: np.ndarray
    log: np.ndarray
    time_s: np.ndarray
    signals: Regressors

    @classmethod
    def of(cls, signals: Regressors) -> Balance:
        """The sliding rows of `signals`."""
        rows, offset = signals.sliding, offset_columns(signals)
        return cls(
            signals.position_rad[rows],
            signals.velocity_rad_s[rows],
            signals.acceleration_rad_s2[rows],
            signals.direction[rows],
            signals.torque_nm[rows],
            None if signals.external_nm is None else signals.external_nm[rows],
            np.hstack([offset.logs, offset.drift, signals.besides])[rows],
            signals.log[rows],
            signals.time_s[rows],
            signals,
        )

    @property
    def motion(self) -> np.ndarray:
        """Acceleration, velocity and direction, (n, 3)."""
        return np.column_stack([self.acceleration, self.velocity, self.direction])

    @property
    def spread(self) -> float:
        """RMS of the torque about the offset of its log."""
        # a share of the torque is no offset: it is part of what is to be explained
        offsets = self.nuisance[:, : self.nuisance.shape[1] - self.signals.besides.shape[1]]
        # a spring explains nothing of the joint: beside a strong one all that is left over would be little
        torque = (self.signals.torque_nm - self.signals.place_nm)[self.signals.sliding]
        centred = torque - offsets @ np.linalg.lstsq(offsets, torque, rcond=None)[0]
        return float(np.sqrt(np.mean(centred**2)))

    @property
    def speed(self) -> float:
        """RMS of the velocity."""
        return float(np.sqrt(np.mean(self.velocity**2)))

    # as `fit`, but of the rows themselves: what is left over is looked at row by row, and not only by its
    # size
    def residual(self) -> np.ndarray:
        """What the plain fit leaves over on each row, N m."""
        matrix = np.hstack([self.motion, self.nuisance])
        scale = np.sqrt((matrix**2).mean(axis=0))
        scale[scale == 0] = 1.0
        return np.asarray(
            self.torque - matrix / scale @ np.linalg.lstsq(matrix / scale, self.torque, rcond=1e-9)[0]
        )

    def bends(self) -> np.ndarray:
        """Columns of friction that bends over speed, (n, 2)."""
        v = self.velocity
        # no largest speed: a spike of the velocity would stretch the peak over all of them
        usual = PEAK_SHARE * float(np.quantile(np.abs(v), 0.95))
        return np.column_stack([v * np.abs(v), self.direction * np.exp(-np.abs(v) / max(usual, 1e-12))])

    def own_acceleration(self) -> np.ndarray:
        """What of the acceleration the other columns do not have."""
        others = np.column_stack([self.velocity, self.direction, self.nuisance])
        return np.asarray(
            self.acceleration - others @ np.linalg.lstsq(others, self.acceleration, rcond=1e-9)[0]
        )

    def inertia(self) -> tuple[float, float]:
        """Inertia and its standard error, kg m^2, of rows of which one in `ROWS_ALIKE` is independent of the
        others."""
        own = self.own_acceleration()
        found = self.fit()
        # rows a tenth of a period apart repeat each other: counted one by one the error would be less than
        # half of what it is
        free = max(len(own) / ROWS_ALIKE, 1.0)
        return found.inertia, found.rest / max(float(own.std()) * np.sqrt(free), 1e-300)

    def fit(
        self,
        torque: np.ndarray | None = None,
        added: np.ndarray | None = None,
        motion: np.ndarray | None = None,
        rows: np.ndarray | slice = slice(None),
    ) -> Fit:
        """Fit the balance: of another torque, with added columns (n, k), another reading of the motion (n,
        3), on some rows."""
        motion = self.motion if motion is None else motion
        more = np.zeros((len(motion), 0)) if added is None else added
        matrix = np.hstack([motion, more, self.nuisance])[rows]
        wanted = (self.torque if torque is None else torque)[rows]
        scale = np.sqrt((matrix**2).mean(axis=0))
        scale[scale == 0] = 1.0
        # a direction that is not told gets nothing, instead of a refusal: a part of a log may have columns
        # alike
        found = np.linalg.lstsq(matrix / scale, wanted, rcond=1e-9)[0] / scale
        rest = wanted - matrix @ found
        k = 3 + more.shape[1]
        return Fit(
            float(found[0]), float(found[1]), float(found[2]), found[3:k], float(np.sqrt(np.mean(rest**2)))
        )
