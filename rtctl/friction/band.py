"""The band of a learned curve: within it lies, of a session that was not learned from, 95 % of what is
measured."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

LEVEL = 0.95
"""Share of a held-out session that the band is for."""


@dataclass(frozen=True)
class Band:
    """Half width about the curve, N m, by regions of speed: region i lies below `edges_rad_s[i]`, the last
    above them all.

    `way`, of `learn.hold_out.WAYS` or "place", says what was held out together, `units` how many of them,
    `errors` how many held-out errors the widths are from, both directions together. `slowest_rad_s` is the
    slowest speed there is a point of: what the curve is below it nothing was learned of, and the band says
    nothing of."""

    edges_rad_s: tuple[float, ...]
    half_width_nm: tuple[float, ...]
    way: str
    units: int
    errors: int
    slowest_rad_s: float = 0.0

    @property
    def is_whole(self) -> bool:
        """Whether the edges rise, and there is one half width more than edges."""
        edges = self.edges_rad_s
        return len(self.half_width_nm) == len(edges) + 1 and bool((np.diff(edges) > 0).all())

    def at(self, speed: np.ndarray) -> np.ndarray:
        """Half width at each speed >= 0, N m."""
        # an edge belongs to the region below it, as where the errors were shared out
        return np.asarray(self.half_width_nm)[np.searchsorted(self.edges_rad_s, speed)]

    @property
    def widest_nm(self) -> float:
        """Largest half width, N m."""
        return max(self.half_width_nm)

    def holds(self, speed: np.ndarray, error_nm: np.ndarray) -> np.ndarray:
        """Whether each error (curve minus measurement, N m) at its speed lies within the band."""
        inside: np.ndarray = np.abs(error_nm) <= self.at(speed)
        return inside

    def widened(self, by_nm: float) -> Band:
        """The band about another curve that is off the first by `by_nm` at most."""
        return replace(self, half_width_nm=tuple(half + by_nm for half in self.half_width_nm))
