"""The zero of a force sensor under observation: its mean over the first samples, as the daemon takes it
before arming."""

from __future__ import annotations

import numpy as np


class Tare:
    """Mean of the first `samples` forces, N, shape (3,); nobody may touch the device meanwhile.

    Attributes
    ----------
    offset_n : ndarray or None
        What to take off, once there were enough samples; NaN in a component that was not finite. None for
        good when `samples` is 0."""

    def __init__(self, samples: int) -> None:
        self.samples = samples
        self.offset_n: np.ndarray | None = None
        self._sum_n, self._seen = np.zeros(3), 0

    def take(self, force_n: np.ndarray) -> None:
        """One fresh sample, untared."""
        # the first ones only: a zero that went on following would hide a hand
        if self._seen >= self.samples:
            return
        self._sum_n += force_n
        self._seen += 1
        if self._seen == self.samples:
            self.offset_n = self._sum_n / self.samples

    def applied(self, force_n: np.ndarray) -> np.ndarray:
        """The force less the offset, where there is one."""
        return force_n if self.offset_n is None else force_n - self.offset_n

    def note(self, i: int) -> dict[str, float | None]:
        """What a report says beside component `i`: what was taken off, None before; nothing where none is."""
        if not self.samples:
            return {}
        return {"tare": None if self.offset_n is None else float(self.offset_n[i])}
