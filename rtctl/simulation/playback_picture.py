"""Figure of a playback report: the torques over time, and the learned curve among the friction samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hw.motion import words
from rtctl import pictures
from rtctl.simulation.playback_figures import Judged, Learned
from rtctl.simulation.playback_interaction import Trace


def save_plot(path: Path, learned: Learned, evaluated: Judged, signals: Trace | None, motion: str) -> None:
    """Write a PNG in the units of this motion. Without a hand torque there is no `signals`, and the friction
    alone is shown."""
    figure = pictures.blank(11, 4 if signals is None else 8)
    axes = figure.subplots(1 if signals is None else 2, 1, squeeze=False)[:, 0]
    if signals is not None:
        top = axes[0]
        top.plot(signals.time_s, signals.hand_nm, label="hand, as recorded", linewidth=0.8)
        top.plot(signals.time_s, signals.feedforward_nm, label="feed-forward of the model", linewidth=0.8)
        top.plot(signals.time_s, signals.left_nm, label="what is left", linewidth=0.8)
        top.plot(signals.time_s, signals.inertial_nm, label="of it inertia", linewidth=0.8, linestyle="--")
        effort = words("torque, N m", motion)
        top.set(xlabel="time in the log, s", ylabel=effort, title=Path(evaluated.log.source).name)
        top.grid(visible=True, alpha=0.3)
        top.legend(loc="upper right")
    bottom = axes[-1]
    for name, samples in (("trained on", learned.logs[0].samples), ("judged on", evaluated.samples)):
        bottom.plot(samples.velocity_rad_s, samples.friction_nm, ".", markersize=3, alpha=0.5, label=name)
    for direction, branch in zip((1, -1), learned.model.branches, strict=True):
        # without 0, where friction has two values
        v = direction * np.linspace(0, branch.speed_max_rad_s, 400)[1:]
        bottom.plot(v, direction * learned.model.magnitude(v), "k", label="model" if direction > 0 else None)
    bottom.set(xlabel=words("velocity, rad/s", motion), ylabel=words("friction, N m", motion))
    bottom.grid(visible=True, alpha=0.3)
    bottom.legend(loc="upper left")
    pictures.save(figure, path)
