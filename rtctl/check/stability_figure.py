"""A region for every axis as a picture: couplings that are provably passive, or virtual masses that are
stable, and the rig file's."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hw.motion import words
from rtctl import pictures
from rtctl.check.admittance_figure import draw_axis
from rtctl.check.stability_report import AxisReport, Report
from rtctl.control.proofs import stability

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_CURVE_POINTS = 120
"""Couplings of a curve: a delay that varies, or old samples, are searched for at each."""


def draw(report: Report, path: str | Path) -> None:
    """Draw the region of passive couplings of each axis to a PNG, PDF or SVG file.

    Raises
    ------
    DataError
        When the file cannot be written."""
    n = len(report.axes)
    figure = pictures.blank(6.4, 4.6 * n)
    for axis, plot in zip(report.axes, np.atleast_1d(figure.subplots(n, 1)), strict=True):
        if axis.admittance is not None:
            draw_axis(plot, axis)
        else:
            _draw_axis(plot, axis, report.period_s)
    verdict = "passes" if report.ok else "REFUSED"
    couplings = any(axis.admittance is None for axis in report.axes)
    what = "Passive couplings" if couplings else "Stable virtual masses"
    figure.suptitle(f"{what} of rig {report.rig}: {report.path.name} {verdict}")
    pictures.save(figure, path)


def _draw_axis(plot: Axes, axis: AxisReport, T: float) -> None:
    b, between = axis.device_damping_nms_rad, axis.between
    # 1e-6: a joint without damping has an empty region, not an axis of no length
    widest = max(b, axis.damping_nms_rad, 1e-6) * 1.1
    b_c = np.linspace(0, widest, _CURVE_POINTS)
    exact = np.array([stability.k_max_between(b, value, T, between) for value in b_c])
    paper = np.array([stability.k_max_adams_hannaford(b, value, T) for value in b_c])
    plot.fill_between(b_c, 0, exact, alpha=0.25, color="tab:green", label="provably passive")
    plot.plot(
        b_c,
        exact,
        color="tab:green",
        label=f"exact sampled data, {axis.delay_ticks:.3g} ticks of delay (gates)",
    )
    plot.plot(b_c, paper, color="tab:gray", linestyle="--", label="Adams-Hannaford / Llewellyn (report)")
    colour = "black" if axis.ok else "tab:red"
    plot.plot(axis.damping_nms_rad, axis.stiffness_nm_rad, "o", color=colour, label="this rig file", zorder=3)
    plot.plot(
        axis.recommended_damping_nms_rad,
        axis.recommended_stiffness_nm_rad,
        "x",
        color="tab:blue",
        label="recommended",
        zorder=3,
    )
    plot.set_ylim(0, 1.15 * max(float(paper.max()), float(exact.max()), axis.stiffness_nm_rad, 1e-3))
    plot.set_xlim(0, widest)
    plot.set_xlabel(words("coupling damping b_c [N m s/rad]", axis.motion))
    plot.set_ylabel(words("coupling stiffness k_c [N m/rad]", axis.motion))
    damping = words(f"{b:.4g} N m s/rad", axis.motion)
    plot.set_title(
        f"axis {axis.name}: T = {1e3 * T:g} ms, guaranteed device damping b = {damping}", fontsize="small"
    )
    plot.legend(fontsize="small")
    plot.grid(visible=True, alpha=0.3)
