"""The feed-forward follows the friction that the watch sees: how far it may, and how fast it does
(docs/theory.md 5.10).

Pure functions. Factors are of the learned dry friction; 1 is as learned."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from rtctl.control.compensation_limit import FACTOR_MOST
from rtctl.friction.drift_estimate import Estimate
from rtctl.friction.drift_verdict import SESSION_S, SURE
from rtctl.friction.margins import FrictionFigures, friction_figures
from rtctl.friction.model import FrictionModel
from rtctl.rig_file.axis_tables import AxisTable
from rtctl.rig_file.friction_tables import CAP_SHARE_MAX

TIGHT = 0.015
"""Standard error of a factor that is followed upwards, too: one and a half times what the method itself may
be off by."""

BOUND = "ADAPTATION_BOUND"
"""Name of the warning that the friction lies beyond what may be followed."""

_HALVINGS = 7
"""Halvings of a tenth: the largest factor is known to .0008, from the safe side."""


@dataclass(frozen=True)
class Bounds:
    """How far an axis may go, and how fast: factors, and their change in a second of motion, >= 0."""

    least: float
    most: float
    per_s: float


def followed(
    factor: float, found: Estimate | None, bounds: Bounds, moved_s: float, *, frozen: bool = False
) -> float:
    """The factor after `moved_s` more seconds of motion, by what the watch has found; always within the
    bounds.

    Notes
    -----
    An estimate that is tight, and of this session for `SESSION_S`, is followed both ways. Of any other one
    only its far side counts, three standard errors off, and only where that is below the factor: friction is
    surely less. Nothing moves while `frozen`, or by an estimate that is not finite."""
    wanted = factor
    if found is not None and not frozen and math.isfinite(found.factor + found.factor_error):
        tight = found.factor_error <= TIGHT and found.session_seconds >= SESSION_S
        # down by its far side, up only where it is known: help beyond the friction is the dangerous one
        wanted = found.factor if tight else min(factor, found.factor + SURE * found.factor_error)
    step = bounds.per_s * moved_s
    return min(max(min(max(wanted, factor - step), factor + step), bounds.least), bounds.most)


def beyond(factor: float, found: Estimate | None, bounds: Bounds) -> str:
    """Why the friction cannot be followed any further, in words; empty where it can, or is not surely
    beyond."""
    if found is None or bounds.least < factor < bounds.most:
        return ""
    off = found.factor - factor if factor >= bounds.most else factor - found.factor
    # at its bound the factor may be right, and the estimate beyond it by chance
    if not off > SURE * found.factor_error:
        return ""
    return (
        f"dry friction is {found.factor:.2f} times what was learned, and the compensation follows it no "
        f"further than to {factor:.2f}: learn it anew (rtctl identify)"
    )


def follows(axis: AxisTable, model: FrictionModel | None) -> bool:
    """True where there is a learned feed-forward, and the rig file asks that it follow the friction."""
    table = axis.friction
    return model is not None and table.drift.adapt_per_min > 0 and table.policy not in ("off", "observer")


def largest_feedforward(axis: AxisTable, model: FrictionModel | None, T: float) -> tuple[AxisTable, float]:
    """The axis with gains and cap as at the largest factor that its feed-forward may reach, and that factor,
    1 to 1.1.

    `T` is the control period, s.

    Notes
    -----
    All of the feed-forward grows with the factor, its cap included, which never passes `CAP_SHARE_MAX` of the
    torque limit. The factor is the largest that passes the two-line test (docs/theory.md 5.3) and leaves the
    damping that the coupling is proved with; 1 where the test fails at 1 already, or nothing is followed."""
    if not follows(axis, model):
        return axis, 1.0
    assert model is not None
    # the cap grows with the factor, and may not pass what a rig file may ask for
    most = min(FACTOR_MOST, CAP_SHARE_MAX / max(axis.friction.cap_share, 1e-9))
    if model.load is not None and axis.friction.load_gain > 0:  # never more of the load than there is
        most = min(most, 1 / axis.friction.load_gain)
    count = 2 * math.pi / axis.counts_of_turn
    least_nms_rad = min(_secant(_figures(axis, model, T, count, 1.0)), axis.viscous_nms_rad)

    def passes(factor: float) -> bool:
        found = _figures(axis, model, T, count, factor)
        return found.two_line_margin_nm >= 0 and _secant(found) >= least_nms_rad

    low, high = 1.0, most
    if high > low and passes(high):
        low = high
    elif high > low and passes(low):  # else 1 itself fails: `rtctl check` says so
        # margins fall as the factor rises: the low end always passes
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            low, high = (middle, high) if passes(middle) else (low, middle)
    return at_factor(axis, low), low


def at_factor(axis: AxisTable, factor: float) -> AxisTable:
    """The axis with a feed-forward that is greater by this factor."""
    table = axis.friction
    update = {
        name: factor * getattr(table, name) for name in ("gain", "viscous_gain", "load_gain", "cap_share")
    }
    return axis.model_copy(update={"friction": table.model_copy(update=update)})


def _figures(axis: AxisTable, model: FrictionModel, T: float, count: float, factor: float) -> FrictionFigures:
    return friction_figures(model, Path(), at_factor(axis, factor), T, count)


def _secant(found: FrictionFigures) -> float:
    """Damping that the feed-forward leaves over all speeds, N m s/rad."""
    beyond_range = found.beyond_damping_nms_rad
    return min(found.secant_damping_nms_rad, math.inf if beyond_range is None else beyond_range)
