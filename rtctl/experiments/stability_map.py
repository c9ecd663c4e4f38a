"""The k-b region of provably stable couplings against simulation with the worst hands
(docs/theory.md 2.11)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rtctl import pictures
from rtctl.control.proofs import stability
from rtctl.errors import ConfigError
from rtctl.experiments import figures, worst_delay, worst_hand
from rtctl.experiments.one_mass import Device, device_of, proven
from rtctl.experiments.order import Order
from rtctl.experiments.report import Outcome, Part, Target
from rtctl.experiments.statistics import Estimate
from rtctl.friction.learn.report_page import Picture
from rtctl.friction.learn.report_tables import Table

TITLE = "Stability map"
SHARES = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
"""b_c over the device's damping b."""

MODES = (1, 2, 3, 5, 14)
# in 1000 the hand of 14 resonances seems to decay (.9996) a tenth above its first instability at b_c = .8 b
TICKS = 4000
"""Ticks of each simulation in time."""

# what it compensates is no damping any more: the region must shrink by as much, and no further
VISCOUS_GAINS = (0.0, 0.3, 0.6)

DELAYS = (1, 2)
DELAY_SHARES = SHARES[::2]
# by ratio: the worst lies at .02 to .8 by delay and b_c, the lower the less of b is spent on b_c
ANGLES = np.geomspace(0.02, math.pi / 2 - 1e-3, 13)
"""Places of theta = w T / 2 at which a loop with delay meets its worst hand."""

# twice as many parts change the growth of the starts that decay by 2 %, half as many by 4 to 9
DRY_NM, DRY_GAINS, DRY_MODES, DRY_PARTS = 0.25, (0.0, 0.9, 1.0), (1, 2, 3), 64
"""Dry friction of the runs in time, shares of it compensated, hands, and parts of a tick."""

DRY_SPEEDS_RAD_S = (0.01, 0.1, 1.0)


def run(order: Order) -> Outcome:
    """Run the experiment: joint and hand are computed, the rig gives the figures. Raises ConfigError."""
    order.require_simulated("stability-map")
    axis, device = order.loaded.config.axis[0], device_of(order.loaded)
    # k_max is 2 (b - b_c)/T: without damping no stiffness is proven, and no share of it can be told
    if not device.damping > 0:
        what = (
            f"axis[0].viscous_nms_rad is {axis.viscous_nms_rad:g}, of which nothing is sure: no coupling is "
            "proven, and no region is there to map"
        )
        raise ConfigError(f"{order.loaded.path}: {what}; give what the joint has")
    found = {modes: _edge(device, modes) for modes in MODES}
    viscous = {gain: _edge(_compensated(device, gain), MODES[-1]) for gain in VISCOUS_GAINS}
    order.progress(0.5, "worst-case hands in time")
    below, above = _in_time(device, found)
    dry = {gain: _with_dry_friction(device, gain) for gain in DRY_GAINS}
    delayed = {}
    delays = sorted({*DELAYS, math.ceil(axis.coupling.delay_ticks)} - {0})  # delay 0 is the map itself
    for at, delay in enumerate(delays):
        order.progress(0.6 + 0.4 * at / len(delays), f"delay of {delay} ticks")
        delayed[delay] = [_delayed(device, share, delay) for share in DELAY_SHARES]
    order.progress(1.0, "stability map")
    made = _outcome(device, found, viscous, below, above)
    return _with_more(made, device, delayed, dry)


def _delayed(device: Device, share: float, delay: int) -> float:
    """Least unstable k_c over the proven one, over the worst hands and environments."""
    b, T = device.damping, device.period_s
    return worst_delay.first_unstable_share(device.inertia, b, T, share * b, delay, MODES[-1], ANGLES)


def _with_dry_friction(device: Device, gain: float) -> float:
    """Largest growth on the proven bound with dry friction of which `gain` is compensated, sign a tick
    late."""
    T, most = device.period_s, 0.0
    for modes in DRY_MODES:
        part = worst_hand.worst(device.inertia, device.damping, T, modes, DRY_PARTS)
        for share in DELAY_SHARES:
            for speed in DRY_SPEEDS_RAD_S:
                most = max(
                    most,
                    worst_hand.peak_with_friction(
                        part.step, part.push, part.angle, part.speed, device.inertia, DRY_NM, gain * DRY_NM,
                        proven(device, share), share * device.damping, T, DRY_PARTS, TICKS, speed,
                    ),
                )  # fmt: skip
    return most


def _with_more(
    made: Outcome, device: Device, delayed: dict[int, list[float]], dry: dict[float, float]
) -> Outcome:
    """The outcome with the parts on delay and on dry friction added."""
    rows = []
    for delay, shares in delayed.items():
        for share, found in zip(DELAY_SHARES, shares, strict=True):
            b_c = share * device.damping
            bound = stability.k_max_sampled_data(device.damping, b_c, device.period_s, delay)
            rows.append((str(delay), f"{b_c:.4g}", f"{bound:.2f}", f"{found:.2f}"))
    least, most = min(min(one) for one in delayed.values()), max(max(one) for one in delayed.values())
    header = ("delay, ticks", "b_c, N m s/rad", "proven k_c, N m/rad", "first unstable k_c over it")
    caption = (
        f"With delay: first unstable k_c over the proven one, in steps of 1 %, over hands of {MODES[-1]} "
        f"resonances and lossless environments made for {len(ANGLES)} frequencies each."
    )
    dry_rows = [(f"{100 * gain:.0f} %", f"{growth:.4f}") for gain, growth in dry.items()]
    dry_caption = (
        f"Dry friction of {DRY_NM:g} N m, run in time on the proven bound in hands of "
        f"{', '.join(map(str, DRY_MODES))} resonances from {DRY_SPEEDS_RAD_S[0]:g} to "
        f"{DRY_SPEEDS_RAD_S[-1]:g} rad/s: largest energy of the second half over the first, worst of all "
        "runs. Above 1 it would grow; 1 is the least start, whose motion stays as small as it began (a "
        "late sign hunts about rest), larger ones decay."
    )
    shown = (
        Table(caption, header, tuple(rows)),
        Table(dry_caption, ("compensated", "growth"), tuple(dry_rows)),
    )
    targets = (
        Target("with delay: least unstable k_c over proven k_c", Estimate(least, 0.0, 1), 1.0, "", 1.0),
        Target(
            "with delay: the first instability lies above the bound by",
            Estimate(most - 1.0, 0.0, 1), 0.10, at_most=True,
        ),
        Target(
            "dry friction compensated in full, sign a tick late: growth per cycle on the bound",
            Estimate(max(dry.values()), 0.0, 1), 1.0, "", 1.0, at_most=True,
        ),
    )  # fmt: skip
    text = (
        "With delay the bound is reached at an angle below Nyquist, where the worst hand resonates at "
        "every frequency that sampling folds there, and only with the worst environment behind the "
        "coupling: a lossless mass or spring."
    )
    numbers = {
        **made.numbers,
        "delay": {
            str(delay): dict(zip(map(str, DELAY_SHARES), one, strict=True)) for delay, one in delayed.items()
        },
        "dry_friction_growth": {str(gain): growth for gain, growth in dry.items()},
    }
    parts = (*made.parts, Part("With delay, and with dry friction", (text,), shown))
    return replace(made, parts=parts, targets=(*made.targets, *targets), numbers=numbers)


def _compensated(device: Device, gain: float) -> Device:
    """The device as the coupling finds it when this share of the viscous friction is compensated."""
    return replace(device, damping=(1 - gain) * device.damping)


def _edge(device: Device, modes: int) -> list[float]:
    b, T = device.damping, device.period_s
    hand = worst_hand.worst(device.inertia, b, T, modes)
    # ten times the bound at b_c = 0, 2 b/T: whatever is unstable is so below, and what is stable is so up to
    # one stiffness (400 stiffnesses of each hand and share on three joints), which halving finds
    return [worst_hand.first_unstable(hand, share * b, T, 20 * b / T) for share in SHARES]


def _in_time(device: Device, found: dict[int, list[float]]) -> tuple[float, float]:
    """Largest growth on the proven bound, and least a tenth above the first instability, over every hand and
    b_c."""
    below, above = 0.0, float("inf")
    for modes, edges in found.items():
        hand = worst_hand.worst(device.inertia, device.damping, device.period_s, modes)
        for share, edge in zip(SHARES, edges, strict=True):
            b_c, T = share * device.damping, device.period_s
            known = (hand.step, hand.push, hand.angle, hand.speed)
            # in time as well as by poles: two ways to be wrong
            below = max(below, worst_hand.growth(*known, proven(device, share), b_c, T, TICKS, 0.1))
            above = min(above, worst_hand.growth(*known, 1.1 * edge, b_c, T, TICKS, 0.1))
    return below, above


def _outcome(
    device: Device,
    found: dict[int, list[float]],
    viscous: dict[float, list[float]],
    below: float,
    above_edge: float,
) -> Outcome:
    bounds = [proven(device, share) for share in SHARES]
    # by the hand of most resonances: fewer fold less onto the worst place
    above = [edge / bound - 1 for edge, bound in zip(found[MODES[-1]], bounds, strict=True)]
    inside = min(edge / bound for edges in found.values() for edge, bound in zip(edges, bounds, strict=True))
    inside_viscous = min(
        edge / proven(_compensated(device, gain), share)
        for gain, edges in viscous.items()
        for share, edge in zip(SHARES, edges, strict=True)
    )
    inside = min(inside, inside_viscous)
    targets = (
        Target(
            "no hand is unstable inside the proven region: least unstable k_c over proven k_c",
            Estimate(inside, 0.0, 1), 1.0, "", 1.0,
        ),
        Target(
            f"worst hand ({MODES[-1]} resonances): its first instability lies above the bound by",
            Estimate(max(above), 0.0, 1), 0.10, at_most=True,
        ),
    )  # fmt: skip
    shown = (_picture(device, found, viscous), _table(device, found))
    text = (
        "Joint, hand and coupling to a rigid wall, by the poles of the exact sampled loop and run in time. "
        f"Run in time, {'no' if below <= 1.0 else 'some'} hand's energy grows on the proven bound (largest "
        f"ratio over the second half of {TICKS} ticks: {below:.4g}), and "
        f"{'every one' if above_edge > 1.0 else 'not every one'} grows a tenth above its first instability "
        f"(least ratio: {above_edge:.4g}). Computed from the rig's J, b and T without noise: seeds would "
        "change nothing."
    )
    numbers = {
        "damping_share": list(SHARES),
        "proven_k_nm_rad": bounds,
        "first_unstable_k_nm_rad": {str(modes): edges for modes, edges in found.items()},
        "first_unstable_k_viscous_nm_rad": {str(gain): edges for gain, edges in viscous.items()},
        "growth_on_bound": below,
        "growth_above_first_instability": above_edge,
    }
    parts = (Part("Theory against simulation", (text,), shown),)
    return Outcome("stability-map", TITLE, _sentence(inside, above, device), parts, targets, numbers)


def _sentence(inside: float, above: Sequence[float], device: Device) -> str:
    """What came out: `inside` is the least unstable k_c over the proven one, `above` by what the worst hand's
    lie above it."""
    b, T = device.damping, device.period_s
    # 4 without b_c, and more with it: that test takes b_c for damping, where sampling makes it a burden
    ends = (0.0, SHARES[-1])
    papers = [stability.k_max_adams_hannaford(b, one * b, T) / proven(device, one) for one in ends]
    said = (
        "No simulated hand is unstable inside the proven region"
        if inside >= 1.0
        else f"A simulated hand is unstable at {inside:.3g} times the proven stiffness"
    )
    return (
        f"{said}; the worst one ({MODES[-1]} lossless resonances at odd multiples of Nyquist) is unstable "
        f"from {100 * min(above):.1f} to {100 * max(above):.1f} % above it, depending on b_c. The papers' "
        f"test promises {papers[0]:.2g} to {papers[1]:.2g} times as much stiffness."
    )


def _picture(device: Device, found: dict[int, list[float]], viscous: dict[float, list[float]]) -> Picture:
    figure = pictures.blank(10, 4.8)
    left, right = figure.subplots(1, 2)
    b_c = np.array(SHARES) * device.damping
    paper = [stability.k_max_adams_hannaford(device.damping, b, device.period_s) for b in b_c]
    bounds = [proven(device, share) for share in SHARES]
    left.fill_between(b_c, 0, bounds, alpha=0.25, color="tab:green", label="proven")
    for modes, edges in found.items():
        left.plot(
            b_c, edges, "o-", markersize=3, linewidth=0.8, label=f"unstable: hand of {modes} resonances"
        )
    left.plot(b_c, paper, "k--", linewidth=0.8, label="Adams-Hannaford (papers)")
    left.set_yscale("log")
    figures.label(left, "b_c [N m s/rad]", "k_c [N m/rad]", "viscous friction left alone")
    for number, (gain, edges) in enumerate(viscous.items()):
        one, colour = _compensated(device, gain), f"C{number}"
        at = np.array(SHARES) * one.damping
        right.fill_between(at, 0, [proven(one, share) for share in SHARES], alpha=0.2, color=colour)
        right.plot(at, edges, "o-", color=colour, markersize=3, linewidth=0.8, label=f"viscous_gain {gain:g}")
    figures.label(right, "b_c [N m s/rad]", "k_c [N m/rad]", "viscous friction compensated")
    for plot in (left, right):
        plot.legend(fontsize="x-small")
    caption = (
        "Stiffness k_c in N m/rad over damping b_c in N m s/rad of the coupling: proven region (shaded) "
        "and first instability with worst-case hands. Left: without compensation of viscous friction, "
        "hands of 1 to 14 resonances. Right: what is left of the region when viscous friction is "
        "compensated, with the hand of 14."
    )
    return Picture("stability_map", caption, figures.png(figure, device.motion))


def _table(device: Device, found: dict[int, list[float]]) -> Table:
    rows = []
    for at, share in enumerate(SHARES):
        bound = proven(device, share)
        cells = [f"{edges[at]:.2f} (+{100 * (edges[at] / bound - 1):.1f} %)" for edges in found.values()]
        rows.append((f"{share * device.damping:.4g}", f"{bound:.2f}", *cells))
    hands = (f"hand of {n} resonances" if n > 1 else "of 1" for n in found)
    header = ("b_c, N m s/rad", "proven k_c, N m/rad", *hands)
    return Table("First unstable k_c, N m/rad, and how far above the proven bound.", header, tuple(rows))
