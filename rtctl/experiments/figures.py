"""Pictures of the experiments, as PNG bytes. Every axis carries its unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rtctl import pictures
from rtctl.experiments.statistics import Estimate
from rtctl.friction.learn.report_figures import speak

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 10.0


def label(plot: Axes, x: str, y: str, title: str = "") -> None:
    """Name both axes with their units."""
    plot.set(xlabel=x, ylabel=y, title=title)
    plot.grid(visible=True, alpha=0.3)


Lines = Mapping[str, tuple[np.ndarray, np.ndarray]]
"""Name of each line -> (x, y)."""


def png(figure: Figure, motion: str) -> bytes:
    """The picture, its labels in the units of this motion."""
    speak(figure, motion)
    return pictures.png(figure)


def stacked(panels: Sequence[tuple[str, Lines]], motion: str, height: float = 2.4) -> bytes:
    """Draw panels above each other over one axis of time; each is (y label with unit, lines)."""
    # .6 inches for the legend and the axis below
    figure = pictures.blank(WIDTH, height * len(panels) + 0.6)
    plots = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for plot, (y, lines) in zip(plots, panels, strict=True):
        for name, (at, value) in lines.items():
            plot.plot(at, value, linewidth=0.9, label=name)
        label(plot, "", y)
    plots[-1].set_xlabel("time [s]")
    # each line once, though every panel has it: by its name, in the order of the first panel
    named = {
        name: handle for plot in plots for handle, name in zip(*plot.get_legend_handles_labels(), strict=True)
    }
    figure.legend(named.values(), named.keys(), loc="outside upper center", ncols=4, fontsize="small")
    return png(figure, motion)


def bars(groups: Mapping[str, Mapping[str, Estimate]], x: str, motion: str, scale: float = 1.0) -> bytes:
    """Draw horizontal bars with confidence intervals, one panel per group: group -> bar -> estimate."""
    # every group has the same bars: one list of names serves all panels
    names = list(next(iter(groups.values())))
    figure = pictures.blank(WIDTH, 0.9 + 0.3 * len(names))
    plots = figure.subplots(1, len(groups), sharey=True, squeeze=False)[0]
    colours = [f"C{k % 10}" for k in range(len(names))]  # by place: a bar has one colour in all panels
    for plot, (title, group) in zip(plots, groups.items(), strict=True):
        means = [scale * group[name].mean for name in names]
        halves = [scale * group[name].half for name in names]
        plot.barh(
            range(len(names)), means, xerr=halves, capsize=2, color=colours, error_kw={"linewidth": 0.8}
        )
        plot.set_yticks(range(len(names)), names)
        label(plot, x, "", title)
    # the first bar at the top, as in the tables; the axis is shared, so once
    plots[0].invert_yaxis()
    return png(figure, motion)
