"""Virtual masses and hands with which an admittance display is stable, as a picture, with the rig file's."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hw.motion import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rtctl.check.stability_report import AxisReport
    from rtctl.control.proofs.admittance_loop import AdmittanceLoop

_MASSES = 9
_AROUND = 4.0
"""Masses from the rig file's over this to as many times it."""


def draw_axis(plot: Axes, axis: AxisReport) -> None:
    """Draw the stable region of one axis over virtual mass and stiffness of the hand; some seconds."""
    loop, one = axis.loop, axis.admittance
    if loop is None or one is None:
        return
    # with the file's own mass among them, whose point is drawn on the curve
    mass = np.sort(
        [loop.mass_kgm2, *np.geomspace(loop.mass_kgm2 / _AROUND, loop.mass_kgm2 * _AROUND, _MASSES)]
    )
    world, free = boundary(loop, mass, world=True), boundary(loop, mass, world=False)
    plot.fill_between(mass, 0, world, alpha=0.25, color="tab:green", label="stable in every linear world")
    plot.plot(mass, world, color="tab:green")
    plot.plot(mass, free, color="tab:gray", linestyle="--", label="limit in free motion")
    plot.axvline(
        one.mass_min_continuous_kgm2,
        color="tab:blue",
        linestyle=":",
        label="J K_v/(b + K_v): any hand, no lag",
    )
    colour = "black" if one.stable else "tab:red"
    plot.plot(loop.mass_kgm2, loop.box.stiffness_nm_rad, "o", color=colour, label="this rig file", zorder=3)
    # a mass counts by its ratio to the joint's, a hand by its to another
    plot.set_xscale("log")
    plot.set_yscale("log")
    seen = np.concatenate([world, free, [loop.box.stiffness_nm_rad]])
    # 0: no hand passes with that mass, and a logarithm has no place for it
    seen = seen[seen > 0]
    plot.set_ylim(0.5 * float(seen.min()), 2 * float(seen.max()))
    plot.set_xlabel(words("virtual mass m [kg m^2]", axis.motion))
    plot.set_ylabel(words("stiffness of the hand k_h [N m/rad]", axis.motion))
    gains = (
        f"b_v = {loop.virtual_damping_nms_rad:.3g}, K_v = {loop.velocity_gain_nms_rad:.3g} N m s/rad, K_p = "
        f"{loop.position_gain_nm_rad:.3g} N m/rad"
    )
    plot.set_title(f"axis {axis.name}: {words(gains, axis.motion)}", fontsize="small")
    plot.legend(fontsize="small")
    plot.grid(visible=True, alpha=0.3)


def boundary(loop: AdmittanceLoop, masses: np.ndarray, *, world: bool) -> np.ndarray:
    """Stiffest hand that passes with each virtual mass, N m/rad, in every linear world or in free motion."""
    from rtctl.control.proofs.admittance_margin import largest_hand

    return np.array([largest_hand(replace(loop, mass_kgm2=float(mass)), world=world) for mass in masses])
