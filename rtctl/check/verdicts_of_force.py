"""Tests of what a force sensor makes of a force before the law reads it: its own low-pass, and how late it is
besides."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

from rtctl.check.verdict import Outcome, Subject, Verdict
from rtctl.check.verdicts_of_admittance import found
from rtctl.check.verdicts_of_observer import loop_of, observes
from rtctl.rounded import up

if TYPE_CHECKING:
    from rtctl.control.proofs.observer_loop import Loop

REMEDY = "force.sensor_lowpass_hz and sensor_delay_s, from its data sheet or measured (docs/force-sensors.md)"


def sensor_of_an_admittance(s: Subject) -> list[Verdict]:
    """What the certificate counted on, and how slow a sensor it bears."""
    one = found(s)
    return [_row(s, "admittance, the force sensor's own filter", one.sensor_min_hz)] if one.stable else []


def sensor_of_an_observer(s: Subject) -> list[Verdict]:
    """What the disturbance observer's eigenvalues counted on, likewise."""
    # no row of what is not there
    if not observes(s):
        return []
    tuned = s.axis.observer
    own = (
        f"; torque and velocity are taken of {tuned.own_ticks} ticks before, to belong to it"
        if tuned.own_ticks
        else ""
    )
    own += f", the inertia {tuned.excess:.0%} too high" if tuned.excess else ""
    if tuned.bandwidth_hz < tuned.usual_hz:
        own += f"; bandwidth {tuned.bandwidth_hz:g} Hz for it ({tuned.usual_hz:g} without)"
    return [_row(s, "observer, the force sensor's own filter", _slowest(loop_of(s)), own)]


@lru_cache(maxsize=64)
def _slowest(loop: Loop) -> float:
    from rtctl.control.proofs import observer_margin

    return observer_margin.slowest_sensor(loop)


def _row(s: Subject, name: str, least_hz: float, own: str = "") -> Verdict:
    way = s.axis.force_way
    # what the rows above were judged with, whoever said it or nobody
    counted = f"low-pass of {way.sensor_hz:g} Hz" if way.sensor_hz > 0 else "no low-pass"
    counted += (f", {way.ticks} ticks late" if way.ticks else "") + own
    down = (
        f"holds down to a sensor low-pass of {up(least_hz)} Hz"
        if least_hz > 0
        else "holds with any slower one, too"
    )
    if math.isinf(least_hz):
        down = "holds with no low-pass that was tried"
    # NOT PROVED where nobody does: the figure is then only an assumption
    if way.said_by:
        meaning = f"counted on: {counted} ({way.said_by}); {down}"
    else:
        meaning = f"nobody says what the sensor's own filter is: {counted} was counted on; {down}: {REMEDY}"
    # no low-pass lets every frequency through
    cut = way.sensor_hz or math.inf
    return s.row(
        name,
        (f"{way.sensor_hz:g} Hz" if way.sensor_hz > 0 else "none") if way.said_by else "not declared",
        f">= {up(least_hz)} Hz" if 0 < least_hz < math.inf else "any" if least_hz == 0 else "none",
        Outcome.PASS if way.said_by else Outcome.NOT_PROVED,
        meaning,
        # inf: holds only without one, which is what it has
        least_hz / cut if math.isfinite(least_hz) else 1.0,
    )
