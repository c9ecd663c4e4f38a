"""Tables, pictures, targets and numbers of the experiment on admittance displays."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence

import numpy as np

from rtctl import pictures
from rtctl.experiments import figures
from rtctl.experiments.admittance_findings import (
    CERTIFIED,
    DAMPING_SHARES,
    FELT_WITHIN,
    HZ,
    LEFT_MOST,
    MASSES,
    Felt,
    Left,
)
from rtctl.experiments.admittance_runs import HAND_NM_RAD, Contact, Rubbing, Shown
from rtctl.experiments.one_mass import device_of, proven
from rtctl.experiments.report import Target
from rtctl.experiments.statistics import Estimate
from rtctl.experiments.virtual import FAST_SINE
from rtctl.friction.learn.report_page import Picture
from rtctl.friction.learn.report_tables import Table
from rtctl.rig_file.config import LoadedConfig


def left_table(left: Left, light: Shown, hand: float) -> Table:
    """Hand's torque left, per display and motion."""
    names = list(next(iter(left.values())))
    rows = tuple((name, *(f"{100 * left[motion][name].mean:.1f} %" for motion in left)) for name in names)
    caption = (
        "Hand's torque left (RMS), of an impedance without compensation on the same rig: free motion, m = "
        f"{light.mass_kgm2:g} kg m^2, b_v = {light.damping_nms_rad:g} N m s/rad, K_v = "
        f"{light.velocity_gain_nms_rad:g}, K_p = {light.position_gain_nm_rad:g}; stiffest hand certified in "
        f"any linear world {hand:.0f} N m/rad."
    )
    return Table(caption, ("display", *left), rows)


def felt_table(felt: Sequence[Felt]) -> Table:
    """Mass and damping asked for and felt."""
    rows = tuple(
        (
            f"{one.asked.mass_kgm2:.3g}, {one.asked.damping_nms_rad:.3g}",
            "yes" if one.asked.feedforward else "no",
            str(one.joint),
            f"{one.mass_kgm2:.3g}, {one.damping_nms_rad:.3g}",
            f"{100 * one.error:.1f} %",
            f"{one.hand_nm_rad:.0f}" if one.hand_nm_rad > 0 else "none: refused",
        )
        for one in felt
    )
    header = ("asked: m, b_v", "sent ahead", "joint", "felt: m, b_v", "larger error", "certified hand")
    caption = (
        "Mass (kg m^2) and damping (N m s/rad) asked for and felt, .5 to 5 Hz, and the stiffest hand (N "
        "m/rad) certified in any linear world."
    )
    return Table(caption, header, rows)


def contact_table(touched: Mapping[str, Mapping[str, Contact]]) -> Table:
    """Stiffness felt of every world, per display."""
    rows = tuple(
        (world, *(_contact_cell(world, one) for one in (worlds[world] for worlds in touched.values())))
        for world in next(iter(touched.values()))
    )
    caption = (
        f"A hand of {HAND_NM_RAD:g} N m/rad leans on a virtual world: stiffness felt (N m/rad; of a wall "
        "the way into it), and the least of the energy account. A coupling is felt in series with its "
        "spring. Where it hardly rubs: a hundredth of the dry friction, no compensation, no dead band."
    )
    return Table(caption, ("world, N m/rad", *touched), rows)


def _contact_cell(world: str, one: Contact) -> str:
    """What one display did of one world; of a wall hardly anything moves, so its slope says nothing."""
    if one.stopped:
        return "stopped"
    felt = f"{1e3 * one.way_rad:.2f} mrad" if world == "wall" else f"{one.stiffness_nm_rad:.4g}"
    return f"{felt}, {'calm' if one.calm else 'rings'}; {1e3 * one.account_min_j:.2f} mJ"


def impedance_picture(loaded: LoadedConfig, shown: Shown, heard: Mapping[str, list[complex]]) -> Picture:
    """|Z| felt over frequency, beside what was asked for and the bare joint."""
    axis, figure = loaded.config.axis[0], pictures.blank(10, 4.4)
    plot = figure.subplots()
    turn = 2j * np.pi * np.array(HZ)
    for number, (name, values) in enumerate(heard.items()):
        plot.loglog(HZ, np.abs(values), "o-", color=f"C{number}", markersize=3, linewidth=0.9, label=name)
    for number, share in enumerate(MASSES, 1):
        asked = np.abs(share * axis.inertia_kgm2 * turn + shown.damping_nms_rad)
        plot.loglog(
            HZ, asked, "--", color=f"C{number}", linewidth=0.8, label="asked for" if number == 1 else None
        )
    plot.loglog(
        HZ, np.abs(axis.inertia_kgm2 * turn + axis.viscous_nms_rad), "k:", linewidth=0.9, label="bare joint"
    )
    figures.label(plot, "frequency [Hz]", "|Z| [N m s/rad]")
    plot.legend(fontsize="x-small")
    caption = (
        "Impedance that a hand feels in free motion on a joint that hardly rubs, 1 to 30 Hz: displays, "
        "what was asked for (dashed), bare joint (dotted). Above 14 Hz the watch takes it for a contact "
        "that rings, and damps."
    )
    return Picture("admittance_impedance", caption, pictures.png(figure))


def width_picture(loaded: LoadedConfig, widths: Mapping[str, Sequence[tuple[float, float]]]) -> Picture:
    """Stiffest calm wall over damping, and what is proven of the coupling."""
    figure = pictures.blank(10, 4.0)
    plot = figure.subplots()
    for name, pairs in widths.items():
        damping, stiffness = zip(*pairs, strict=True)
        certified = name == CERTIFIED
        what = "bears hands to" if certified else "stiffest calm wall in a hand of"
        plot.semilogy(
            damping,
            np.maximum(stiffness, 1.0),  # none, 0, has no place on a logarithmic axis
            "--" if certified else "o-",
            markersize=4,
            linewidth=0.9,
            label=f"{name}: {what} {HAND_NM_RAD:g} N m/rad",
        )
    # no simulation: any passive hand, where the points are of one
    device = device_of(loaded)
    b_c = [share * device.damping for share in DAMPING_SHARES]
    plot.semilogy(
        b_c,
        [proven(device, share) for share in DAMPING_SHARES],
        "k--",
        linewidth=0.8,
        label="impedance: proven with any hand",
    )
    figures.label(plot, "b_c of the coupling, b_v of the mass [N m s/rad]", "k_c, K_p [N m/rad]")
    plot.legend(fontsize="x-small")
    caption = (
        "Z-width: stiffness of a rigid virtual wall up to which it neither rings nor stops in this one "
        "hand, on a joint that hardly rubs, over the damping of coupling or virtual mass. Dashed: up to "
        "where the matrices of the admittance bear every such hand in any linear world, and what is proven "
        "of the coupling with any hand."
    )
    return Picture("admittance_z_width", caption, pictures.png(figure))


def targets(left: Left, felt: Sequence[Felt], *, rigid: bool) -> tuple[Target, ...]:
    """What has to be reached, on a joint of one mass or on an elastic one."""
    ahead = [one.error for one in felt if one.asked.feedforward == 1.0 and one.joint is Rubbing.BARE]
    smooth = [one.error for one in felt if one.asked.feedforward == 1.0 and one.joint is Rubbing.HARDLY]
    helped = [
        one.error
        for one in felt
        if one.asked.feedforward == 1.0 and one.joint is Rubbing.COMPENSATED and one.hand_nm_rad > 0
    ]
    within = FELT_WITHIN if rigid else 2 * FELT_WITHIN
    return (
        Target("hand's torque left on the fast sine, compensated",
            left[FAST_SINE.name]["admittance, compensated"], LEFT_MOST, at_most=True),
        Target("mass and damping felt on a joint that hardly rubs: largest error",
            Estimate(float(np.max(smooth)), 0.0, 1), within, at_most=True),
        Target("and on one that rubs", Estimate(float(np.max(ahead)), 0.0, 1), 2 * FELT_WITHIN, at_most=True),
        Target("and on one that rubs, compensated, where some hand is certified",
            Estimate(float(np.max(helped)) if helped else math.nan, 0.0, 1), within, at_most=True),
    )  # fmt: skip


def numbers(
    left: Left,
    felt: Sequence[Felt],
    touched: Mapping[str, Mapping[str, Contact]],
    widths: Mapping[str, Sequence[tuple[float, float]]],
    heard: Mapping[str, Sequence[complex]],
    hand: float,
) -> dict[str, object]:
    """Everything for scripts, SI units."""
    return {
        "hand_torque_left": {motion: {name: one.as_dict() for name, one in rows.items()} for motion,
            rows in left.items()},
        "stiffest_hand_nm_rad": hand,
        "felt": [{**vars(one.asked), "felt_mass_kgm2": one.mass_kgm2,
            "felt_damping_nms_rad": one.damping_nms_rad, "joint": one.joint,
            "certified_hand_nm_rad": one.hand_nm_rad} for one in felt],
        "contact": {name: {world: vars(one) for world, one in worlds.items()} for name,
            worlds in touched.items()},
        "impedance_felt_nms_rad": {
            name: [{"hz": hz, "size": abs(z), "angle_rad": cmath.phase(z)} for hz,
                z in zip(HZ, values, strict=True)] for name, values in heard.items()
        },
        "stiffest_wall_nm_rad": {name: [list(pair) for pair in pairs] for name, pairs in widths.items()},
    }  # fmt: skip
