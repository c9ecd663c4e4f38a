"""Figures of a report, as PNG bytes: the learned curves, their residuals, the ladder."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hw.motion import speed_scale, words
from rtctl import pictures
from rtctl.friction.band import Band
from rtctl.friction.learn import report_measured_range
from rtctl.friction.learn.report_evidence import EXTRA_COLUMNS, Errors, Evidence, Learned, interval_nm

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIDES = {1: "positive direction", -1: "negative direction"}
_COLOURS = {1: "tab:blue", -1: "tab:orange"}


def curves(evidence: Evidence, family: str) -> bytes:
    """Draw points, curve, tube and support vectors of one family: each direction, whole range and low
    speeds."""
    figure = pictures.blank(10, 7.2)
    plots = figure.subplots(2, 2, squeeze=False)
    bands = [branch.band if family == evidence.chosen else None for branch in evidence.model.branches]
    for row, one, band in zip(plots, evidence.of(family), bands, strict=True):
        speed, friction_nm = evidence.points.branch(one.direction)
        # a direction may end below what is low speed for both
        ends = {
            "whole range": float(speed.max()),
            "low speed": min(float(speed.max()), evidence.boundary_rad_s),
        }
        for plot, (part, end) in zip(row, ends.items(), strict=True):
            inside = speed <= end
            _curve(plot, one, np.linspace(0, end, 800), speed)
            _band(plot, one, band, np.linspace(0, end, 800))
            plot.plot(speed[inside], friction_nm[inside], ".", color="0.35", markersize=4, label="points")
            _support(plot, one, speed, friction_nm, end)
            _label(plot, "speed [rad/s]", "friction [N m]", f"{_SIDES[one.direction]}, {part}")
    shown: dict[str, Any] = {}
    for plot in plots.flat:  # a kind of support vector may occur in one direction only
        shown |= {name: handle for handle, name in zip(*plot.get_legend_handles_labels(), strict=True)}
    figure.legend(
        shown.values(), shown.keys(), loc="outside lower center", ncols=len(shown), fontsize="small"
    )
    return _png(figure, evidence.points.motion)


def _curve(plot: Axes, one: Learned, v: np.ndarray, speed: np.ndarray) -> None:
    curve, epsilon = one.curve(v), one.epsilon_nm
    if epsilon > 0:  # a formula has no tube
        plot.fill_between(
            v,
            curve - epsilon,
            curve + epsilon,
            alpha=0.25,
            color="tab:blue",
            linewidth=0,
            label="epsilon tube",
        )
    report_measured_range.draw(plot, v, curve, speed, linewidth=1.3, label="learned friction")


def _band(plot: Axes, one: Learned, band: Band | None, v: np.ndarray) -> None:
    if band is None:
        return
    curve, wide = one.curve(v), band.at(v)
    twice, gap = np.concatenate([v, [np.nan], v]), [np.nan]
    outer = np.concatenate([curve - wide, gap, curve + wide])
    plot.plot(twice, outer, ":", color="tab:blue", linewidth=1, label="95 % band")


def _support(plot: Axes, one: Learned, speed: np.ndarray, friction_nm: np.ndarray, end: float) -> None:
    """Ring the points that are support vectors: of two points at one speed, both."""
    bounded = one.bounded
    for which, colour, name in ((~bounded, "tab:red", "free"), (bounded, "tab:purple", "bounded")):
        at = np.isin(speed, one.curve.support_vectors[which]) & (speed <= end)
        if which.any():
            plot.plot(
                speed[at],
                friction_nm[at],
                "o" if name == "free" else "s",
                markerfacecolor="none",
                color=colour,
                label=f"support vectors, {name}",
            )


def ladder(evidence: Evidence) -> bytes:
    """Draw the held-out RMSE of every usable rung with its confidence interval."""
    from matplotlib.ticker import LogLocator

    rungs = [rung for rung in evidence.rungs if not rung.refused]
    figure = pictures.blank(8, 1.2 + 0.36 * len(rungs))
    plot = figure.subplots()
    # the plainest on top: the axis counts from below
    for at, rung in enumerate(reversed(rungs)):
        low, high = (1e3 * end for end in interval_nm(rung))
        colour = "tab:red" if rung.family == evidence.chosen else "tab:blue"
        centre = 1e3 * rung.rmse_nm
        plot.errorbar(centre, at, xerr=[[centre - low], [high - centre]], fmt="o", color=colour, capsize=4)
    plot.set_ylim(-0.6, len(rungs) - 0.4)
    plot.set_yticks(range(len(rungs)), [rung.family for rung in reversed(rungs)])
    # the plainest may err ten times as much as the best, which would all stand on one spot
    plot.set_xscale("log")
    _label(plot, "held-out RMSE [mN m], 95 % confidence interval", "", "")
    plot.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    plot.xaxis.set_major_formatter("{x:g}")
    plot.xaxis.set_minor_formatter("")
    return _png(figure, evidence.points.motion)


def residuals(evidence: Evidence) -> bytes:
    """Draw residuals of the chosen model against speed: training, held out, test."""
    chosen = evidence.of(evidence.chosen)
    # linear below it: break-away at 0 has no place on a logarithm
    least = float(np.min([one.trained.speed[one.trained.speed > 0].min() for one in chosen]))
    most = float(np.max([one.trained.speed.max() for one in chosen]))
    figure = pictures.blank(10, 6.4)
    plots = figure.subplots(2, 1, sharex=True)
    for plot, one in zip(plots, chosen, strict=True):
        if one.epsilon_nm > 0:
            plot.axhspan(
                -1e3 * one.epsilon_nm, 1e3 * one.epsilon_nm, color="tab:blue", alpha=0.15, linewidth=0
            )
        _scatter(plot, one.trained, "o", "0.35", "training points")
        _scatter(plot, one.held_out, "x", "tab:orange", "held out of training")
        if one.predicted is not None:
            _scatter(plot, one.predicted, "^", "tab:green", "test points")
        plot.axhline(0, color="black", linewidth=0.6)
        plot.set_xscale("symlog", linthresh=least, linscale=0.3)
        plot.set_xlim(-0.1 * least, 1.1 * most)
        plot.set_xticks(_speed_ticks(least, most), minor=False)
        plot.set_xticks([], minor=True)
        plot.xaxis.set_major_formatter("{x:g}")
        _label(plot, "", "model - measured [mN m]", _SIDES[one.direction])
    plots[-1].set_xlabel("speed [rad/s]")
    handles, names = plots[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=len(names), fontsize="small")
    return _png(figure, evidence.points.motion)


def _speed_ticks(least: float, most: float) -> list[float]:
    """0, and 1, 2 and 5 of every decade between the slowest run and the fastest; far apart when there are
    many."""
    decades = range(math.floor(math.log10(least)), math.ceil(math.log10(most)) + 1)
    fine = (1, 2, 5) if len(decades) <= 5 else (1,)
    return [0.0, *(x for d in decades for n in fine if least <= (x := n * 10.0**d) <= most)]


def _scatter(plot: Axes, errors: Errors, marker: str, colour: str, name: str) -> None:
    plot.plot(
        errors.speed,
        1e3 * errors.error_nm,
        marker,
        color=colour,
        markerfacecolor="none",
        markersize=5,
        linewidth=0,
        label=name,
    )


def residuals_against(evidence: Evidence, name: str) -> bytes:
    """Draw training residuals of the chosen model against one of the extra columns."""
    points, figure = evidence.points, pictures.blank(10, 3.6)
    plot = figure.subplots()
    for one in evidence.of(evidence.chosen):
        mine = points.rows_of(one.direction)
        error = one.curve(np.abs(points.velocity_rad_s[mine])) - points.friction_nm[mine]
        plot.plot(
            evidence.extra[name][mine],
            1e3 * error,
            "o",
            markerfacecolor="none",
            color=_COLOURS[one.direction],
            label=_SIDES[one.direction],
        )
    plot.axhline(0, color="black", linewidth=0.6)
    _label(plot, EXTRA_COLUMNS[name], "model - measured [mN m]", "")
    figure.legend(loc="outside lower center", ncols=2, fontsize="small")
    return _png(figure, evidence.points.motion)


def _label(plot: Axes, x: str, y: str, title: str) -> None:
    plot.set_xlabel(x)
    plot.set_ylabel(y)
    plot.set_title(title, fontsize="medium")
    plot.grid(visible=True, alpha=0.3)


def speak(figure: Figure, motion: str) -> None:
    """Write labels and legends of a figure in the units of its axis; they were written for a rotary one.

    Small speeds are in mm/s."""
    for plot in figure.axes:
        if "[rad/s]" in plot.get_xlabel():
            unit, factor = speed_scale(motion, max(map(abs, plot.get_xlim())))
            plot.set_xlabel(plot.get_xlabel().replace("rad/s", unit))
            if factor != 1.0:
                plot.xaxis.set_major_formatter(partial(_times, factor))
        plot.set(
            xlabel=words(plot.get_xlabel(), motion),
            ylabel=words(plot.get_ylabel(), motion),
            title=words(plot.get_title(), motion),
        )
        legend = plot.get_legend()
        for text in legend.get_texts() if legend else ():
            text.set_text(words(text.get_text(), motion))


def _times(factor: float, value: float, _at: int) -> str:
    return f"{factor * value:g}"


def _png(figure: Figure, motion: str) -> bytes:
    speak(figure, motion)
    return pictures.png(figure, {"Software": None})
