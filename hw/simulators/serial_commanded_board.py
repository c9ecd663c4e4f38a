"""What simulated boards of any language do with the command in force: hold it, let it grow old, let go."""

from __future__ import annotations

import numpy as np

from hw.serial.frame import Status


class CommandedBoard:
    """The command in force of a board for `n_axes`, which lets go `time_to_live` of its cycles after its last
    command."""

    def __init__(self, n_axes: int, time_to_live: int) -> None:
        self.n_axes, self._time_to_live = n_axes, time_to_live
        # one row like the command record of `Board`: what the simulation asks of it
        self.command = np.zeros(1, [("sequence", "<i8"), ("torque_mode", "<i8")])
        self._value, self._enable = np.zeros(n_axes), False
        self.age, self.sequence = 1000, 0  # no command yet: older than any time to live
        self.estop = self.drive_fault = False
        self.force_missing = self.temperature_missing = self.velocity_missing = self.moment_missing = False

    def hold(self) -> None:
        """Torque-free until the next command."""
        self._enable = False
        self._value[:] = 0.0

    def begin_cycle(self, cycles: int = 1) -> None:
        """Let `cycles` of the board's own clock pass: commands grow old."""
        self.age = min(self.age + cycles, 1000)
        if self.age >= self._time_to_live:
            self.hold()

    @property
    def enabled(self) -> bool:
        """Whether the power stage drives the motor."""
        return self._enable and not (self.estop or self.drive_fault)

    @property
    def output(self) -> np.ndarray:
        """Value in force, A or N m, shape (n_axes,); zero unless enabled."""
        return self._value.copy() if self.enabled else np.zeros(self.n_axes)

    @property
    def status(self) -> Status:
        """Status word: enabled, emergency stop, fault of the drive."""
        return Status(int(self.enabled) + 2 * int(self.estop) + 4 * int(self.drive_fault))

    def identity_packet(self) -> bytes:
        """Empty: such a board tells no identity."""
        return b""
