"""The learned friction curve over its points, as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rtctl import pictures
from rtctl.friction.learn import report_measured_range
from rtctl.friction.learn.report_figures import speak
from rtctl.friction.model import Branch, FrictionModel
from rtctl.friction.points import FrictionPoints

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw(model: FrictionModel, points: FrictionPoints, path: str | Path) -> None:
    """Draw points, learned curve, tube and support vectors of both directions (PNG, PDF or SVG).

    Raises
    ------
    DataError
        When the file cannot be written."""
    figure = pictures.blank(7.2, 4.6)
    plot = figure.subplots()
    for sign, branch in zip((1, -1), model.branches, strict=True):
        speed, friction_nm = points.branch(sign)
        _draw_branch(plot, branch, sign, speed, friction_nm)
    plot.axhline(0, color="black", linewidth=0.5)
    plot.axvline(0, color="black", linewidth=0.5)
    plot.set_xlabel("velocity [rad/s]")
    plot.set_ylabel("friction overcome [N m]")
    plot.set_title(f"Learned friction of rig {model.rig}: {model.kind}, one curve per direction")
    plot.legend(fontsize="small")
    plot.grid(visible=True, alpha=0.3)
    speak(figure, model.motion)
    pictures.save(figure, path)


def _draw_branch(plot: Axes, branch: Branch, sign: int, speed: np.ndarray, friction_nm: np.ndarray) -> None:
    names = (lambda text: text) if sign > 0 else (lambda _: None)  # each label once
    v = np.linspace(0, branch.speed_max_rad_s, 1000)
    curve, epsilon = branch.magnitude(v), branch.hyper_parameters.get("epsilon_nm")
    if epsilon is not None:  # a formula has no tube
        plot.fill_between(
            sign * v,
            sign * (curve - epsilon),
            sign * (curve + epsilon),
            alpha=0.2,
            color="tab:blue",
            label=names(f"epsilon tube, {1e3 * epsilon:.3g} mN m at v > 0"),
        )
    if branch.band is not None:
        wide = branch.band.at(v)
        outer = np.concatenate([curve - wide, [np.nan], curve + wide])
        label = names("95 % band, of what was held out")
        at_both = sign * np.concatenate([v, [np.nan], v])
        plot.plot(at_both, sign * outer, ":", color="tab:blue", linewidth=1, label=label)
    plot.plot(sign * speed, sign * friction_nm, ".", color="tab:gray", label=names("points"))
    report_measured_range.draw(plot, sign * v, sign * curve, speed, label=names("learned friction"))
    at = branch.support_vectors
    if not len(at):
        return
    plot.plot(
        sign * at,
        sign * branch.magnitude(at),
        "o",
        markerfacecolor="none",
        color="tab:red",
        label=names(f"support vectors, {len(at)} at v > 0"),
    )
