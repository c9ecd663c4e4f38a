"""Pictures of whole recordings: the usual panels of one, and two runs on top of each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from string import ascii_uppercase
from typing import TYPE_CHECKING, Any

import numpy as np

from hw.motion import name as own_name
from hw.motion import unit
from rtctl import pictures
from rtctl.control.vocabulary import State
from rtctl.errors import DataError
from rtctl.recording.overview import names_of_faults
from rtctl.tick import FIELD, FIELDS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TORQUES = (
    "hand_torque_nm",
    "feedforward_torque_nm",
    "observer_torque_nm",
    "coupling_torque_nm",
    "torque_applied_nm",
)
PANELS: tuple[tuple[str, ...], ...] = (
    ("position_rad", "proxy_position_rad"),
    ("velocity_rad_s",),
    TORQUES,
    ("assistance_share",),
    ("energy_hand_j", "energy_port_j"),
    ("cycle_ns", "wakeup_ns"),
    ("state",),
)
# many more than a picture has columns: with more it becomes slow, not finer
MOST_POINTS = 20_000
DURATIONS = ("wakeup_ns", "cycle_ns")


@dataclass
class Run:
    """Ticks to be shown: rows in order, names of the axes, what to call it, and the motion of each axis;
    rotary, if nobody says."""

    label: str
    rows: np.ndarray
    axes: list[str]
    motions: Sequence[str] = ()

    def motion(self, axis: int) -> str:
        """Whether an axis is rotary or linear, by its number."""
        return self.motions[axis] if axis < len(self.motions) else "rotary"

    @property
    def time_s(self) -> np.ndarray:
        """Time since its first tick, s."""
        times: np.ndarray = (self.rows["time_ns"] - self.rows["time_ns"][0]) * 1e-9
        return times

    def between(self, from_s: float, to_s: float) -> Run:
        """Only the ticks of this time. Raises DataError when there is none."""
        time_s = self.time_s if len(self.rows) else np.zeros(0)
        # both ends belong to it: `--to` the last tick's time keeps that tick
        kept = self.rows[(time_s >= from_s) & (time_s <= to_s)]
        if len(kept) == 0:
            raise DataError(f"{self.label}: has no tick between {from_s:g} and {to_s:g} s")
        return replace(self, rows=kept)

    def at_work(self) -> np.ndarray:
        """Rows in ACTIVE with full authority."""
        rows: np.ndarray = self.rows[
            (self.rows["state"] == int(State.ACTIVE)) & (self.rows["authority"] >= 1.0)
        ]
        return rows


def chosen_panels(fields: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    """One panel per field. Raises DataError for a name no tick has; without any, the usual panels."""
    # before anything is drawn: a picture of the known half would pass for all
    for name in fields:
        if name not in FIELD:
            raise DataError(
                f"{name!r} is no field of the tick; there are: {', '.join(item.name for item in FIELDS)}"
            )
    return tuple((name,) for name in fields) if fields else PANELS


def plot_runs(runs: Sequence[Run], path: Path, fields: Sequence[str] = ()) -> None:
    """Write a PNG of one run, or of several on one time axis. Raises DataError."""
    panels = [
        (names, units) for names in chosen_panels(fields) for units in _units(names[0], runs)
    ]  # one for each unit: rad and m have no scale in common
    # in the legends, too: names of files would hide what is drawn
    letters = [f"{letter}: " if len(runs) > 1 else "" for letter in ascii_uppercase[: len(runs)]]
    figure = pictures.blank(11, 1.9 * len(panels) + 1)
    places = np.atleast_1d(figure.subplots(len(panels), 1, sharex=True))
    for place, (names, its_unit) in zip(places, panels, strict=True):
        for k, (run, letter) in enumerate(zip(runs, letters, strict=True)):
            _draw(place, run, names, its_unit, "-" if k == 0 else "--", letter)
        place.set_ylabel(its_unit)
        place.grid(alpha=0.3)
        # a fixed corner: the best one is looked for among all points, which takes seconds
        place.legend(loc="upper right", fontsize=7, ncols=len(runs))
        if names == ("state",):
            place.set_yticks([int(state) for state in State], [state.name for state in State], fontsize=6)
    places[0].set_title(", ".join(letter + run.label for run, letter in zip(runs, letters, strict=True)))
    places[-1].set_xlabel("time, s")
    pictures.save(figure, path)


def _units(name: str, runs: Sequence[Run]) -> list[str]:
    """Units that a field has on the axes of these runs, each once."""
    # over all runs: the second may have an axis of a motion that the first has not
    motions = [run.motion(i) for run in runs for i in range(len(run.axes))]
    found = [_unit(name, motion) for motion in motions] if FIELD[name].shape == "axis" else []
    return list(dict.fromkeys(found)) or [_unit(name, "rotary")]


def _unit(name: str, motion: str) -> str:
    return "us" if name in DURATIONS else unit(FIELD[name].unit, motion)


def _draw(place: Axes, run: Run, names: tuple[str, ...], its_unit: str, style: str, letter: str) -> None:
    # each so many-th, not a mean: a spike may be missed, but none is made smaller
    step = max(1, len(run.rows) // MOST_POINTS)
    time_s = run.time_s[::step]
    for name in names:
        values = run.rows[name].reshape(len(run.rows), -1)[::step] * (1e-3 if name in DURATIONS else 1.0)
        of_axes = FIELD[name].shape == "axis"
        for i in range(values.shape[1]):
            motion = run.motion(i) if of_axes else "rotary"
            # it has a panel of its own unit
            if _unit(name, motion) != its_unit:
                continue
            label = own_name(name.removesuffix("_ns"), motion)
            if values.shape[1] > 1:
                label += f" {run.axes[i]}" if of_axes else f" {'xyz'[i]}"
            place.plot(time_s, values[:, i], style, lw=1, label=letter + label)


def figures(run: Run) -> dict[str, Any]:
    """Numbers of a run: duration, time at work, RMS torques while at work, energies, timing, faults."""
    rows, work = run.rows, run.at_work()
    # from first to last tick: that is one period less than there are ticks
    seconds = float(run.time_s[-1]) if len(rows) else 0.0
    # by the ticks themselves, which begin where `--from` says
    period_s = seconds / max(len(rows) - 1, 1)
    out: dict[str, Any] = {
        "ticks": len(rows),
        "seconds": seconds,
        "work_s": len(work) * period_s,
        "missed_ticks": int(rows["missed_ticks"][-1] - rows["missed_ticks"][0]) if len(rows) else 0,
        # all that were there at any time
        "faults": names_of_faults(int(np.bitwise_or.reduce(rows["faults"])) if len(rows) else 0),
    }
    for name in TORQUES:
        out[f"{name}_rms"] = _rms(work[name])
    out["velocity_rad_s_rms"] = _rms(work["velocity_rad_s"])
    for name in DURATIONS:
        key = name.removesuffix("_ns")
        out[f"{key}_us_p50"], out[f"{key}_us_p99"] = (
            (np.percentile(rows[name], [50, 99]) * 1e-3).tolist() if len(rows) else (0.0, 0.0)
        )
    return out


def _rms(values: np.ndarray) -> list[float]:
    if len(values) == 0:
        return []
    # a torque that was not measured is NaN: as 0 it would make the mean of the others smaller
    finite = np.isfinite(values)
    count = finite.sum(axis=0)
    square = np.square(values, where=finite, out=np.zeros(values.shape)).sum(axis=0)
    rms: list[float] = np.sqrt(np.where(count, square / np.maximum(count, 1), np.nan)).tolist()
    return rms
