"""The picture of an incident: motion, torques, timing and state on one time axis."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hw.motion import name as own_name
from hw.motion import words
from rtctl import pictures
from rtctl.control.vocabulary import State
from rtctl.recording.incident import Incident
from rtctl.recording.incident_report import motions_of, trigger_row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PANELS = (
    ("rad, rad/s", ("position_rad", "velocity_rad_s")),
    (
        "N m",
        (
            "hand_torque_nm",
            "feedforward_torque_nm",
            "observer_torque_nm",
            "torque_wanted_nm",
            "torque_applied_nm",
        ),
    ),
    ("A", ("current_a", "current_command_a")),
)


def plot_incident(incident: Incident, path: Path) -> None:
    """Write a PNG. The transition is at 0; every axis of the rig in each panel. Raises DataError."""
    ticks, motions = incident.ticks, motions_of(incident)
    zero = trigger_row(incident)
    time_ms = (ticks["time_ns"] - ticks["time_ns"][zero]) * 1e-6
    figure = pictures.blank(10, 11)
    # two more: durations, and state with faults
    panels = figure.subplots(len(_PANELS) + 2, 1, sharex=True)
    for panel, (unit, names) in zip(panels, _PANELS, strict=False):
        for name in names:
            for axis in range(ticks[name].shape[1]):
                own = own_name(name, motions[axis])
                label = f"{own}[{axis}]" if ticks[name].shape[1] > 1 else own
                # steps: between two ticks nothing is known
                panel.plot(time_ms, ticks[name][:, axis], drawstyle="steps-post", lw=1, label=label)
        panel.set_ylabel(" | ".join(dict.fromkeys(words(unit, motion) for motion in motions)))
    for name in ("wakeup_ns", "cycle_ns"):
        panels[-2].plot(time_ms, ticks[name] * 1e-3, drawstyle="steps-post", lw=1, label=name[:-3])
    panels[-2].set_ylabel("us")
    _state_panel(panels[-1], time_ms, ticks)
    for panel in panels:
        panel.axvline(0.0, color="crimson", lw=1)
        panel.grid(alpha=0.3)
        panel.legend(loc="upper left", fontsize=7)
    trigger = incident.trigger
    what = f"{trigger['from']} -> {trigger['to']}" if "to" in trigger else "end of the run"
    panels[0].set_title(
        f"{incident.about.get('rig', '')}: {what}, {trigger.get('cause', '')}, tick {trigger['tick']}"
    )
    panels[-1].set_xlabel("time from the transition, ms")
    pictures.save(figure, path)


def _state_panel(panel: Axes, time_ms: np.ndarray, ticks: np.ndarray) -> None:
    panel.plot(time_ms, ticks["state"], drawstyle="steps-post", label="state")
    panel.set_yticks([int(state) for state in State], [state.name for state in State], fontsize=7)
    seen = int(np.bitwise_or.reduce(ticks["faults"])) if len(ticks) else 0
    for bit in range(seen.bit_length()):
        if seen >> bit & 1:
            present = (ticks["faults"] >> np.uint64(bit) & np.uint64(1)).astype(bool)
            # % 10: within the states, which are ten
            panel.plot(time_ms[present], np.full(int(present.sum()), bit % 10), "|", label=f"fault bit {bit}")
