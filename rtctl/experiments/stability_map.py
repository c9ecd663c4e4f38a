"""The k-b region of provably stable couplings against simulation with the worst hands (theory reference, 1.5)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rtctl.control import stability
from rtctl.experiments import figures, worst_hand
from rtctl.experiments.order import Order
from rtctl.experiments.report import Outcome, Part, Target
from rtctl.experiments.statistics import Estimate
from rtctl.friction.report_page import Picture
from rtctl.friction.report_tables import Table

TITLE = "Stability map"
SHARES = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
"""b_c over the device's damping b."""

MODES = (1, 2, 3, 5, 14)
TICKS = 4000
"""Of the simulations in time."""

VISCOUS_GAINS = (0.0, 0.3, 0.6)


@dataclass(frozen=True)
class Device:
    """J, b and T of the rig's first axis."""

    inertia: float
    damping: float
    period_s: float


def run(order: Order) -> Outcome:
    """Run the experiment: joint and hand are computed, the rig gives the figures. Raises ConfigError."""
    order.require_simulated("stability-map")
    axis = order.loaded.config.axis[0]
    device = Device(axis.inertia_kgm2, axis.viscous_nms_rad, order.loaded.config.period_s)
    found = {modes: _edge(device, modes) for modes in MODES}
    viscous = {gain: _edge(_compensated(device, gain), MODES[-1]) for gain in VISCOUS_GAINS}
    order.progress(0.5, "worst-case hands in time")
    below, above = _in_time(device, found)
    order.progress(1.0, "stability map")
    return _outcome(device, found, viscous, below, above)


def _compensated(device: Device, gain: float) -> Device:
    """The device as the coupling finds it when this share of the viscous friction is compensated."""
    return replace(device, damping=(1 - gain) * device.damping)


def proven(device: Device, share: float) -> float:
    """Largest proven k_c at b_c = share b, viscous damping alone, N m/rad."""
    return stability.k_max_sampled_data(device.damping, share * device.damping, device.period_s)


def _edge(device: Device, modes: int) -> list[float]:
    hand = worst_hand.worst(device.inertia, device.damping, device.period_s, modes)
    high = 20 * device.damping / device.period_s
    return [
        worst_hand.first_unstable(hand, share * device.damping, device.period_s, high) for share in SHARES
    ]


def _in_time(device: Device, found: dict[int, list[float]]) -> tuple[float, float]:
    """Largest growth on the proven bound, and least a tenth above the first instability, over every hand and b_c."""
    below, above = 0.0, float("inf")
    for modes, edges in found.items():
        hand = worst_hand.worst(device.inertia, device.damping, device.period_s, modes)
        for share, edge in zip(SHARES, edges, strict=True):
            b_c, T = share * device.damping, device.period_s
            known = (hand.step, hand.push, hand.angle, hand.speed)
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
    above = [edge / bound - 1 for edge, bound in zip(found[MODES[-1]], bounds, strict=True)]
    inside = min(edge / bound for edges in found.values() for edge, bound in zip(edges, bounds, strict=True))
    inside_viscous = min(
        edge / proven(_compensated(device, gain), share)
        for gain, edges in viscous.items()
        for share, edge in zip(SHARES, edges, strict=True)
    )
    targets = (
        Target(
            "no hand is unstable inside the proven region: least unstable k_c over proven k_c",
            Estimate(min(inside, inside_viscous), 0.0, 1), 1.0, "", 1.0,
        ),
        Target(
            f"worst hand ({MODES[-1]} resonances): 10 % less how far its first instability lies above the bound",
            Estimate(0.10 - max(above), 0.0, 1), 0.0,
        ),
    )  # fmt: skip
    key = (
        f"No simulated hand is unstable inside the proven region; the worst one ({MODES[-1]} lossless resonances at odd "
        f"multiples of Nyquist) is unstable from {100 * min(above):.1f} to {100 * max(above):.1f} % above it, depending on "
        "b_c, so the bound is not only safe but tight. The papers' test promises several times as much stiffness."
    )
    shown = (
        _picture(device, found, viscous),
        _table(device, found),
    )
    text = (
        "Joint, hand and coupling to a rigid wall, by the poles of the exact sampled loop and run in time. Run in time, no "
        f"hand's energy grows on the proven bound (largest ratio over the second half of {TICKS} ticks: {below:.3g}), and every "
        f"one grows a tenth above its first instability (least ratio: {above_edge:.3g}). Dry friction is left out: what of it is "
        "not compensated holds the joint and only helps. Computed from the rig's J, b and T without noise, so seeds would "
        "change nothing; the delay is 0 ticks."
    )
    numbers = {
        "damping_share": list(SHARES),
        "proven_k_nm_rad": bounds,
        "first_unstable_k_nm_rad": {str(modes): edges for modes, edges in found.items()},
        "first_unstable_k_viscous_nm_rad": {str(gain): edges for gain, edges in viscous.items()},
        "growth_on_bound": below,
        "growth_above_first_instability": above_edge,
    }
    return Outcome(
        "stability-map", TITLE, key, (Part("Theory against simulation", (text,), shown),), targets, numbers
    )


def _picture(device: Device, found: dict[int, list[float]], viscous: dict[float, list[float]]) -> Picture:
    figure = figures.new(10, 4.8)
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
        "Stiffness k_c in N m/rad over damping b_c in N m s/rad of the coupling: proven region (shaded) and first "
        "instability with worst-case hands. Left: without compensation of viscous friction, hands of 1 to 14 resonances. "
        "Right: what is left of the region when viscous friction is compensated, with the hand of 14."
    )
    return Picture("stability_map", caption, figures.png(figure))


def _table(device: Device, found: dict[int, list[float]]) -> Table:
    rows = []
    for at, share in enumerate(SHARES):
        bound = proven(device, share)
        cells = [f"{edges[at]:.2f} (+{100 * (edges[at] / bound - 1):.1f} %)" for edges in found.values()]
        rows.append((f"{share * device.damping:.4g}", f"{bound:.2f}", *cells))
    header = (
        "b_c, N m s/rad",
        "proven k_c, N m/rad",
        *(f"hand of {n} resonances" if n > 1 else "of 1" for n in found),
    )
    return Table("First unstable k_c, N m/rad, and how far above the proven bound.", header, tuple(rows))
