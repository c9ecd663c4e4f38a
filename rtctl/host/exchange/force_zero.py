"""The zero of the force sensor, kept from run to run: a hand that pulls while a daemon starts, or while it
tares, is known by the zero of before.

A hand that is taken for zero moves the joint once it is gone, as a hand would. No law sees that. So nothing
is armed with a zero further from the last accepted one than a hand may pull, until somebody says that nobody
touches the device (decision 0129)."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hw.motion import words
from rtctl import state_file
from rtctl.host.exchange.rig_description import RigDescription

NAME = "force-zero.json"
MOST_BYTES = 1 << 20

HAND_SHARE = 0.25
"""A joint that is shown more force than this share of `axis.force.offset_nm`, by the zero that was accepted
last, has a hand on it."""

WALK_SHARE = 0.5
"""How far zeros may walk, of `axis.force.offset_nm`, from the one that somebody vouched for, or the first
one, by steps that are each small enough. What light pulls add up to stays below FORCE_OFFSET's bound."""

REMEDY = "if nobody touches the device, the sensor has moved: say so, `rtctl tare --hands-off`"

AGAIN_NS = 5_000_000_000
"""A disk that did not take the zero is asked again after so long."""

# beyond it a file was spoilt: no sensor shows N or N m of this size
_MOST = 1e9


class ForceZero:
    """One rig's zero, as the law has it, and as it was last accepted.

    Parameters
    ----------
    rig
        Facts of the rig; without its `params` nothing is known of the force, and everything accepted.
    folder
        Where the last run left the zero it accepted, and this one does; None: nowhere.
    wall_ns
        Wall-clock time: it only dates what is kept."""

    def __init__(
        self, rig: RigDescription, folder: Path | None = None, wall_ns: Callable[[], int] = time.time_ns
    ) -> None:
        self._rig, self._folder, self._wall_ns = rig, folder, wall_ns
        self._ticks = np.zeros(rig.n_axes) if rig.params is None else rig.params[0]["tare_ticks"].copy()
        self._limits = (
            np.full(rig.n_axes, math.inf)
            if rig.params is None
            else HAND_SHARE * rig.params[0]["force_offset_limit_nm"]
        )
        # NaN: nothing is known, and a first zero is accepted whatever it is
        self._accepted = np.full((rig.n_axes, 6), math.nan)  # force and moment
        self._vouched = self._accepted.copy()
        self._dates = [""] * rig.n_axes
        self._zero, self._screw = np.zeros((2, rig.n_axes, 6))
        self._by_word = 0
        self._others = False  # the accepted zero is one of other devices, or of other options
        self._seen, self._lost = 0, False
        self._taring = bool((self._ticks > 0).any())
        self._news = self._written = 0  # zeros that were accepted here; the one on the disk
        self._offered = 0, 0  # which one was given to be written, and when
        if folder is not None:
            # of other devices too: a new sensor, or the same one mounted anew, is what a hand is taken for,
            # and the other way round
            devices, kept = state_file.read_whoevers(folder / NAME, MOST_BYTES)
            self._others = devices != rig.devices_sha256
            self._take_up(kept)

    def _take_up(self, kept: dict[str, Any]) -> None:
        for a, axis in enumerate(self._rig.axes):
            told = kept.get(axis.name)
            zero, date = _read(told)
            if isinstance(told, dict) and zero is not None:
                self._accepted[a], self._dates[a] = zero, date
                # of a file of an earlier version: the zero itself
                self._vouched[a] = _numbers(told.get("vouched")) or zero

    def follow(self, state: np.void | None) -> None:
        """Take over what the law knows after the newest ticks (a `STATE` record); None: it is not known."""
        if state is None or not (self._ticks > 0).any():
            self._lost, self._taring = True, False
            return
        self._screw = state["screw"].copy()
        self._taring = bool((state["tare_count"] < self._ticks).any())
        # nothing new: `_seen` counts from 1, so that 0 is "no tare yet"
        if self._taring or (self._seen == state["tare_seen"] + 1 and (self._zero == state["tare"]).all()):
            return
        self._seen = int(state["tare_seen"]) + 1
        self._zero = state["tare"].copy()
        # the law has carried out the very tare that somebody vouched for
        said = 0 < self._by_word <= state["tare_seen"]
        # used up: the next tare is judged again
        self._by_word = 0 if said else self._by_word
        if said or not self.refusal():
            date = datetime.fromtimestamp(self._wall_ns() * 1e-9, UTC).isoformat(timespec="seconds")
            first = np.isnan(self._vouched).any(axis=1)
            self._vouched[first | said] = self._zero[first | said]
            self._accepted, self._dates = self._zero.copy(), [date] * self._rig.n_axes
            self._others = False
            # counted, not a flag: while one is written another may be accepted
            self._news += 1

    def accept_next(self, count: int) -> None:
        """Somebody said that nobody touches the device: what is tared by the request of this number is the
        zero, wherever it is."""
        self._by_word = count
        if self._lost:
            self._accepted, self._vouched = np.full((2, *self._accepted.shape), math.nan)

    def taring(self, asked: int) -> bool:
        """Whether the law still averages, or has not begun the tare of the request of this number."""
        # 0: no tare was ever seen, so that none is awaited
        return self._taring or not (self._lost or self._seen in (0, asked + 1))

    def moved_nm(self) -> np.ndarray:
        """How far the zero is from the accepted one at each joint, N m; 0 where nothing is known."""
        return self._from_nm(self._accepted)

    def _from_nm(self, other: np.ndarray) -> np.ndarray:
        # as torque at the joint, by the present levers: a zero that moved along no lever moves nobody
        moved = (self._screw * (self._zero - other)).sum(axis=1)
        return np.where(np.isnan(other).any(axis=1) | (self._seen == 0), 0.0, moved)

    def refusal(self) -> str:
        """Why the rig must not be armed with this zero; empty where it may."""
        for a, moved in enumerate(self.moved_nm()):
            # not `>`: a zero of NaN is refused
            if not abs(moved) <= self._limits[a]:
                zero, before = self._screw[a] @ self._zero[a], self._screw[a] @ self._accepted[a]
                return words(
                    f"axis {self._rig.axes[a].name}: the force sensor was tared at {zero:.3g} N m, and at "
                    f"{before:.3g} {self._when(a)}; further apart than {self._limits[a]:.3g}: a hand pulled "
                    f"while it was tared, and the joint would follow; hands off, `rtctl tare`; {REMEDY}",
                    self._rig.axes[a].motion,
                )
        walked_most = self._limits * (WALK_SHARE / HAND_SHARE)
        for a, walked in enumerate(self._from_nm(self._vouched)):
            if not abs(walked) <= walked_most[a]:
                return words(
                    f"axis {self._rig.axes[a].name}: the force sensor's zero has walked {walked:.3g} N m "
                    f"in small steps since somebody vouched for it, more than {walked_most[a]:.3g}: light "
                    f"pulls may have been taken for zero; hands off, `rtctl tare`; {REMEDY}",
                    self._rig.axes[a].motion,
                )
        return ""

    def pull(self, row: np.void) -> str:
        """Why the force shown says that a hand is on the device; empty where it says none."""
        # by the accepted zero, not by the present one: that may hold a hand already
        shown = row["hand_torque_nm"] + self.moved_nm()
        for axis, torque, limit in zip(self._rig.axes, shown, self._limits, strict=True):
            # not `>`: a force of NaN counts as a hand
            if self._rig.params is not None and not abs(torque) <= limit:
                return words(
                    f"axis {axis.name}: the force sensor shows {torque:.3g} N m, more than {limit:.3g}: a "
                    f"hand on the device would be taken for zero, and pull the joint once it is gone; hands "
                    f"off, then tare; {REMEDY}",
                    axis.motion,
                )
        return ""

    def to_keep(self, now_ns: int | None = None) -> Callable[[], None] | None:
        """What writes the accepted zero, for a thread that may wait for a disk; None while there is nothing
        new, or it was given lately.

        `now_ns` is the loop's time; None: at once."""
        news = self._news
        if self._folder is None or self._written == news:
            return None
        if now_ns is not None:
            offered, at_ns = self._offered
            if offered == news and now_ns - at_ns < AGAIN_NS:
                return None
            self._offered = news, now_ns
        axes = {
            axis.name: {
                "zero": self._accepted[a].tolist(),
                "vouched": self._vouched[a].tolist(),
                "date": self._dates[a],
            }
            for a, axis in enumerate(self._rig.axes)
            # an axis that is not tared has none, and a zero in its place would be accepted by the next run
            if self._ticks[a] > 0
        }
        return partial(self._write, news, self._folder / NAME, axes)

    def _write(self, news: int, file: Path, axes: dict[str, Any]) -> None:
        state_file.write(file, self._rig.devices_sha256, axes)
        self._written = news

    def _when(self, a: int) -> str:
        """When the accepted zero of an axis was taken: the wall clock may have been set since."""
        age_h = (self._wall_ns() * 1e-9 - datetime.fromisoformat(self._dates[a]).timestamp()) / 3600.0
        age = f"{age_h / 24.0:.1f} days" if age_h >= 48.0 else f"{age_h:.1f} hours"
        told = f"on {self._dates[a]}" + (f", {age} ago" if age_h >= 0.0 else "")
        return told + (" with other devices, options or loop rate" if self._others else "")


def _read(kept: object) -> tuple[list[float] | None, str]:
    """One axis' zero and its date; None unless all of it is there and can be one."""
    zero, date = (_numbers(kept.get("zero")), kept.get("date")) if isinstance(kept, dict) else (None, None)
    if zero is None or not isinstance(date, str):
        return None, ""
    try:
        dated = datetime.fromisoformat(date).tzinfo is not None
    except ValueError:
        return None, ""
    return (zero, date) if dated else (None, "")


def _numbers(kept: object) -> list[float] | None:
    """A force and a moment; None where they can be none."""
    if not isinstance(kept, list) or len(kept) != 6:
        return None
    # to Python true is a number; NaN is within no bound
    if not all(isinstance(x, int | float) and not isinstance(x, bool) and abs(x) <= _MOST for x in kept):
        return None
    return [float(x) for x in kept]
