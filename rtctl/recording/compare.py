"""What another rig file would have asked of the same motion: the same samples through two laws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hw.motion import name as own_name
from hw.motion import unit
from rtctl import pictures
from rtctl.check.law_plan import build
from rtctl.control.vocabulary import State
from rtctl.errors import ConfigError
from rtctl.recording.law_arrays import LawArrays
from rtctl.recording.reader import RecordingReader
from rtctl.recording.replay import Replay, Verdict
from rtctl.rig_file.config import LoadedConfig
from rtctl.tick import FIELD

TORQUES = (
    "coupling_torque_nm",
    "feedforward_torque_nm",
    "observer_torque_nm",
    "damping_torque_nm",
    "torque_wanted_nm",
    "torque_applied_nm",
)
SHOWN = ("position_rad", "velocity_rad_s", "hand_torque_nm", *TORQUES)


@dataclass
class Comparison:
    """Signals of the recording and of the other rig file, tick by tick; arrays of shape (n,) or (n, axes)."""

    time_s: np.ndarray
    recorded: dict[str, np.ndarray]
    other: dict[str, np.ndarray]
    axes: list[str]
    motions: Sequence[str]
    verdict: Verdict


def compare(reader: RecordingReader, other: LoadedConfig) -> Comparison:
    """Replay with the arrays of another rig file. The motion and the hand stay the recorded ones.

    Commands stay the recorded ones too, but settings that no client changed (environment, compensation)
    are the other file's.

    Raises
    ------
    ConfigError
        A rig file of another rate, number of axes, or motion of one.
    DataError, ModelError
        As `Replay`, and as `rtctl.check.law_plan.build`."""
    plan = build(other)
    # gains per tick, delays and filters of another rate would be of another rig
    if (plan.n_axes, plan.period_ns) != (reader.n_axes, int(reader.about["period_ns"])):
        raise ConfigError(
            f"{other.path}: {plan.n_axes} axes at {other.config.loop.rate_hz:g} Hz, but the recording has "
            f"{reader.n_axes} at {float(reader.about['rate_hz']):g} Hz; both must be the same"
        )
    motions = [axis.motion for axis in other.config.axis]
    if motions != list(reader.motions):  # rad would be taken for m
        raise ConfigError(
            f"{other.path}: axes are {', '.join(motions)}, but those of the recording "
            f"{', '.join(reader.motions)}; both must be the same"
        )
    # without a state: of another law there is none, and `Replay` takes the recorded start
    replay = Replay(reader, LawArrays(plan.params, plan.model, plan.command), commands_from=plan.command)
    # `state` of both: the other file's law may leave ACTIVE at another tick
    names = (*SHOWN, "state", "time_ns")
    recorded: dict[str, list[np.ndarray]] = {name: [] for name in names}
    replayed: dict[str, list[np.ndarray]] = {name: [] for name in names}
    for rows, again in replay.run():
        for name in names:
            # both are good until the next chunk only
            recorded[name].append(rows[name].copy())
            replayed[name].append(again[name].copy())
    one, two = (
        {n: np.concatenate(parts or [np.zeros(0)]) for n, parts in x.items()} for x in (recorded, replayed)
    )
    # 0 for a recording without a tick
    time_s = (one["time_ns"] - (one["time_ns"][0] if len(one["time_ns"]) else 0)) * 1e-9
    return Comparison(time_s, one, two, reader.axes, motions, replay.verdict)


def numbers(comparison: Comparison) -> dict[str, Any]:
    """RMS of each torque of both, and of their difference, N m (N where it is linear) per axis;
    time in ACTIVE, s."""
    active = int(State.ACTIVE)
    # the median: slots that were missed make a step longer
    period_s = float(np.median(np.diff(comparison.time_s))) if len(comparison.time_s) > 1 else 0.0
    found: dict[str, Any] = {
        "active_s": {
            "recorded": float((comparison.recorded["state"] == active).sum() * period_s),
            "other": float((comparison.other["state"] == active).sum() * period_s),
        }
    }
    for name in TORQUES:
        a, b = comparison.recorded[name], comparison.other[name]
        # of the difference by itself: two torques of one size may be of opposite signs
        found[name] = {"recorded": _rms(a), "other": _rms(b), "difference": _rms(b - a)}
    return found


def _rms(values: np.ndarray) -> list[float]:
    # a torque that was not measured is no torque of the law
    finite = np.where(np.isfinite(values), values, 0.0)
    rms: list[float] = np.sqrt(np.mean(finite**2, axis=0)).tolist() if len(values) else []
    return rms


def _label(name: str, motions: Sequence[str]) -> str:
    """What a signal is called on these axes, with its units."""
    own = dict.fromkeys((own_name(name, each), unit(FIELD[name].unit, each)) for each in motions)
    return "\n".join(f"{called}, {of}" for called, of in own)


def plot_comparison(comparison: Comparison, path: Path, names: tuple[str, str]) -> None:
    """Overlay of motion, hand and torques; PNG. Raises OSError."""
    shown = (
        "position_rad",
        "hand_torque_nm",
        "feedforward_torque_nm",
        "observer_torque_nm",
        "torque_applied_nm",
    )
    axes = range(len(comparison.axes))
    figure = pictures.blank(11, 2.4 * len(shown) + 1)
    panels = figure.subplots(len(shown), 1, sharex=True)
    # many more points than a picture has columns (`panels.MOST_POINTS`)
    step = max(1, len(comparison.time_s) // 20_000)
    for panel, name in zip(panels, shown, strict=True):
        for axis in axes:
            more = f" {comparison.axes[axis]}" if len(comparison.axes) > 1 else ""
            pairs = ((comparison.recorded, names[0], "-"), (comparison.other, names[1], "--"))
            # the motion is the recorded one in both
            for signals, label, style in pairs[: 1 if name == "position_rad" else 2]:
                panel.plot(
                    comparison.time_s[::step], signals[name][::step, axis], style, lw=1, label=label + more
                )
        panel.set_ylabel(_label(name, comparison.motions))
        panel.grid(alpha=0.3)
        panel.legend(loc="upper right", fontsize=7)
    panels[0].set_title(f"The same samples through two laws: {names[0]} and {names[1]}")
    panels[-1].set_xlabel("time, s")
    pictures.save(figure, path)
