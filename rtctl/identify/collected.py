"""What came of one point so far, and when to give it up."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.presliding import Ramp
from rtctl.identify.motion import SLIP_RAD
from rtctl.identify.tick_readings import Measurement

DISCARDS_PER_MEASUREMENT = 3
"""More tries than that in vain, and a point is given up; as many in vain as not, and another servo is tried
while there is one."""
IN_VAIN = 6
"""After so many tries in a row without a measurement, the point is given up."""


class UnsteadyError(DataError):
    """A point that cannot be measured: it is left out, and the others go on."""


FORGIVEN = 20
"""So many tries of a point that a late host or loop spoilt count for nothing; then the machine is too busy
for it."""


@dataclass
class Collected:
    """Measurements of one point, and how many tries were thrown away."""

    measurements: list[Measurement] = field(default_factory=list)
    discarded: int = 0
    discarded_before: int = 0
    """Those with the servos before this one."""
    in_vain: int = 0
    """Tries since the last one that gave something."""
    forgiven: int = 0
    """Tries that a late host or loop spoilt, and that count for nothing."""
    late: int = 0
    """Tries and measurements that were thrown away because host or loop was late."""
    servo: int = 0
    """How many other servos were tried."""
    ramps: list[Ramp] = field(default_factory=list)
    """Beginnings of the slow break-away ramps, for the presliding length."""
    slip_rad: float = SLIP_RAD
    """Displacement that ends a ramp."""
    starts: list[int] = field(default_factory=list)
    """How many measurements there were when each place was reached: those in between are of one place."""

    def add(self, measurement: Measurement) -> None:
        """Keep a measurement."""
        self.measurements.append(measurement)
        self.in_vain = 0

    def discard(self, *, late: bool = False) -> None:
        """Count a try that gave nothing; `late`: not because of the joint, as host or loop was late."""
        self.late += late
        if late and self.forgiven < FORGIVEN:
            self.forgiven += 1
            return
        self.discarded += 1
        self.in_vain += 1

    def hopeless(self, wanted: int, *, last: bool) -> bool:
        """True after too many tries in vain, in a row or in all; `last`: there is no other servo to try."""
        # sooner where another servo is left: it may be quick where this one only wastes the time of a person
        return self.in_vain >= IN_VAIN or self.discarded > (DISCARDS_PER_MEASUREMENT if last else 1) * wanted

    def begin_anew(self) -> None:
        """Forget what was measured with the servo before: what passes where most does not is no sample of the
        friction."""
        self.measurements.clear()
        self.starts.clear()
        self.discarded_before += self.discarded
        self.in_vain = self.discarded = 0
        self.servo += 1

    @property
    def weakest_nm(self) -> float:
        """Torque at the place where it was least in size against the motion's direction, N m, signed."""
        torque = np.array([one.torque_nm for one in self.measurements])
        # a place that gave nothing is none
        inner = [start for start in sorted(set(self.starts)) if 0 < start < len(torque)]
        places = np.array([part.mean() for part in np.split(torque, inner)])
        # along the mean's sign: a place where the torque is of the other sign is weaker than one of 0
        return float(places[np.argmin(places * np.sign(torque.mean()))])
