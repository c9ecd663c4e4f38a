"""Is the motor as warm as it was when its friction was learned? Otherwise a warning, never a fault.

Grease thins as it warms: friction learned on a cold gearbox is too high for a warm one. The daemon cannot
know by how much, so it says so and goes on; `rtctl identify` measures it again."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from rtctl.host.exchange.rig_description import RigDescription

NAME = "TEMPERATURE"

MARGIN_C = 5.0
"""Beyond the learned range by this much is too far. Dry friction of a greased gearbox moves by a percent or
two per kelvin, about what the model itself errs."""

RETURN_C = 1.0
"""A warning goes only this much nearer, so that a motor at the bound does not flicker."""


def temperature_warnings(
    rig: RigDescription, row: np.void | np.ndarray, warned: Collection[str] = ()
) -> list[dict[str, str]]:
    """Warnings of one tick: one per axis whose motor is outside the range its friction was learned at.

    Parameters
    ----------
    row
        One tick. A temperature of 0 (no sensor) or NaN says nothing.
    warned
        Names of the axes that are warned of already: they are until `RETURN_C` nearer.

    Returns
    -------
    list of dict
        `name` ("TEMPERATURE"), `axis` (name), `text`."""
    found = []
    for axis, value in zip(rig.axes, np.ravel(row["temperature_c"]).tolist(), strict=True):
        # 0 is what a field holds that no device writes
        if axis.trained_c is None or value == 0.0:
            continue
        low, high = axis.trained_c
        margin = MARGIN_C - (RETURN_C if axis.name in warned else 0.0)
        if value < low - margin or value > high + margin:
            text = (
                f"axis {axis.name}: friction was learned at {low:.0f}-{high:.0f} degC, the motor is at "
                f"{value:.0f}: expect the compensation to be off"
            )
            found.append({"name": NAME, "axis": axis.name, "text": text})
    return found


class TemperatureWatch:
    """Tells when a warning appears and when it goes, over all calls."""

    def __init__(self, rig: RigDescription) -> None:
        self._rig = rig
        self._present: dict[str, dict[str, str]] = {}

    @property
    def present(self) -> list[dict[str, str]]:
        """The warnings that have been told and not taken back."""
        return list(self._present.values())

    def now(self, row: np.void) -> list[dict[str, str]]:
        """Warnings of a tick after the last one that was followed: a motor at the bound does not flicker."""
        return temperature_warnings(self._rig, row, self._present)

    def changes(self, row: np.void) -> list[tuple[str, dict[str, Any]]]:
        """Kind (`warning` or `warning_cleared`) and warning, of what changed up to this tick."""
        before = self._present
        now = {one["axis"]: one for one in self.now(row)}
        self._present = now
        appeared = [("warning", one) for axis, one in now.items() if axis not in before]
        return appeared + [("warning_cleared", one) for axis, one in before.items() if axis not in now]
