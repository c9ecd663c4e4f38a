"""Is the friction still what was learned? The host's watch over all axes: warnings, what health tells,
reasons to stop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hw.motion import words
from rtctl.friction import adaptation
from rtctl.friction import drift_state as state
from rtctl.friction.drift_recorded import told
from rtctl.friction.drift_verdict import NAME, STOPPED
from rtctl.friction.drift_watch import AxisWatch, RigWatch
from rtctl.host.exchange.rig_description import RigDescription
from rtctl.rig_file.friction_tables import DriftTable

KEEP_NS = 60_000_000_000
"""From one writing of the state to the next: what is lost when the power fails."""


CANNOT_FOLLOW = (
    "follows nothing: adapt_per_min of [axis.friction.drift] is 0 in the rig file, or the axis has no "
    "model, no force sensor or a policy without one, so that rtctl check judged the friction as learned "
    "and no other; set it, check, and start the daemon anew"
)
"""Why an axis holds the friction that was learned, after its name."""


class FrictionWatch:
    """One rig's watch.

    Parameters
    ----------
    rig
        Facts of the rig.
    params, model
        The law's arrays.
    tables
        `[axis.friction.drift]` of each axis.
    folder
        Where the last run left what it remembered, and this one does; None: nowhere."""

    def __init__(
        self,
        rig: RigDescription,
        params: np.ndarray,
        model: np.ndarray,
        tables: Sequence[DriftTable],
        folder: Path | None = None,
    ) -> None:
        self._watch = RigWatch(params, model, tables)
        self._folder, self._devices = folder, rig.devices_sha256
        self._motions = {axis.name: axis.motion for axis in rig.axes}
        names = (axis.name for axis in rig.axes)
        self._axes: dict[str, AxisWatch] = {
            name: axis for name, axis in zip(names, self._watch.axes, strict=True) if axis is not None
        }
        self._stopped: set[str] = set()
        self._asked = np.zeros(len(tables))
        self._kept_ns: int | None = None
        if folder is not None and self._axes:
            kept = state.read(folder, self._devices)
            for name, axis in self._axes.items():
                state.restore(axis, kept.get(name))
        # what was read back is on the disk already
        self._kept_strokes = self._taken

    @property
    def _taken(self) -> int:
        return sum(axis.strokes.taken for axis in self._axes.values())

    def follow(self, rows: np.ndarray) -> bool:
        """Take the next ticks, in order; True when the rig must be stopped for what they show, once for each
        time it is armed."""
        if not self._watch.follow(rows):
            return False
        stopped = {name for name, axis in self._axes.items() if axis.stopped}
        # axes that were stopped already stop nothing anew: an operator may have armed them as they are
        new, self._stopped = stopped - self._stopped, stopped
        return bool(new)

    def hindrance(self, compensation: np.ndarray) -> str:
        """Why the rig must not be armed with these shares of compensation: what it was stopped for; empty
        where it may."""
        for name, axis in self._axes.items():
            a = self._watch.axes.index(axis)
            if axis.still_too_much(self._watch.share(a, float(compensation[a]), axis.factor)):
                return (
                    f"axis {name}: {words(axis.stopped, self._motions[name])}; or ask for a smaller "
                    "compensation; or reset: it is armed as it is, and stopped again after 10 s of motion"
                )
        return ""

    def dismiss(self) -> bool:
        """An operator has seen what the rig was stopped for; False where it was stopped for nothing."""
        stopped = [axis for axis in self._axes.values() if axis.stopped]
        for axis in stopped:
            axis.stopped = ""
        return bool(stopped)

    def warnings(self) -> list[dict[str, str]]:
        """Present warnings: `name`, `axis`, `text`."""
        found = []
        for name, axis in self._axes.items():
            bound = adaptation.beyond(axis.factor, axis.found, axis.bounds) if axis.bounds else ""
            for kind, text in ((NAME, axis.warning), (STOPPED, axis.stopped), (adaptation.BOUND, bound)):
                if text:
                    found.append(
                        {
                            "name": kind,
                            "axis": name,
                            "text": f"axis {name}: {words(text, self._motions[name])}",
                        }
                    )
        return found

    def status(self) -> list[dict[str, Any]]:
        """For `health`: a map for each axis that is watched."""
        return [
            {
                "axis": name,
                **told(axis),
                "followed": axis.factor if axis.bounds else None,
                "adapting": axis.following if axis.bounds else None,
            }
            for name, axis in self._axes.items()
        ]

    def adapt(self, a: int | None, *, on: bool) -> str:
        """Have axis `a`, or with None every axis that may, follow what is seen, or hold its factor where it
        is.

        Returns why not, empty where it is done; nothing is changed then."""
        asked = self._watch.axes if a is None else self._watch.axes[a : a + 1]
        may = [axis for axis in asked if axis is not None and axis.bounds is not None]
        for axis in may:
            axis.following = on
        return "" if may else CANNOT_FOLLOW

    def adapting(self, a: int) -> bool | None:
        """Whether axis `a` follows what is seen; None where it may not."""
        axis = self._watch.axes[a]
        return None if axis is None or axis.bounds is None else axis.following

    def changes(self) -> np.ndarray | None:
        """What the law is to be asked for: change of the learned friction that each axis' feed-forward goes
        by; None: as before."""
        # as a change, so that a command of zeros asks for the friction that was learned
        asked = np.array([0.0 if axis is None else axis.factor - 1.0 for axis in self._watch.axes])
        if (asked == self._asked).all():
            return None
        self._asked = asked
        return asked

    def to_keep(self, now_ns: int | None = None) -> Callable[[], None] | None:
        """What writes the state, for a thread that may wait for a disk; None while there is nothing new, or
        it is too early.

        `now_ns` is the loop's time; None: at once."""
        taken = self._taken
        if self._folder is None or taken == self._kept_strokes:
            return None
        if now_ns is not None:
            if self._kept_ns is None:  # the first minute counts from the first stroke, not from the epoch
                self._kept_ns = now_ns
            if now_ns - self._kept_ns < KEEP_NS:
                return None
            self._kept_ns = now_ns
        axes = {
            name: state.packed(axis)
            for name, axis in self._axes.items()
            # an axis that was not moved has nothing to remember
            if len(axis.strokes.table) or axis.factor != 1.0
        }
        return partial(self._write, taken, self._folder, axes)

    def _write(self, taken: int, folder: Path, axes: dict[str, Any]) -> None:
        state.write(folder, self._devices, axes)
        self._kept_strokes = taken  # else the disk is asked again in a minute


class FrictionNews:
    """Tells when a warning of the friction appears and when it goes, over all calls."""

    def __init__(self, watch: FrictionWatch | None) -> None:
        self._watch = watch
        self._present: dict[tuple[str, str], dict[str, str]] = {}

    def changes(self) -> list[tuple[str, dict[str, Any]]]:
        """Kind (`warning` or `warning_cleared`) and warning, of what changed since the last call."""
        if self._watch is None:
            return []
        before = self._present
        self._present = now = {(one["name"], one["axis"]): one for one in self._watch.warnings()}
        appeared = [("warning", one) for which, one in now.items() if which not in before]
        return appeared + [("warning_cleared", one) for which, one in before.items() if which not in now]
