"""How the disturbance observer of an axis goes by its force sensor: by how much it delays its own signals,
and how quick it is.

It is as quick as gears that nobody declared bear. One place for the plan of the law and for `rtctl check`; it
follows from what is declared and configured, never from what was measured since."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

from rtctl.check import force_way, lateness
from rtctl.check.devices_of_axis import joint_of_axis
from rtctl.check.drive_of_axis import drive_of
from rtctl.check.verdict import hand_factor
from rtctl.control.proofs.drive_in_hand import RIGID
from rtctl.control.proofs.stability import lag_ticks

if TYPE_CHECKING:
    from hw.interface import Joint
    from rtctl.check.force_way import ForceWay
    from rtctl.control.proofs.drive_in_hand import ElasticJoint
    from rtctl.control.proofs.observer_loop import Loop
    from rtctl.control.proofs.observer_margin import Finding
    from rtctl.control.proofs.stability import Between
    from rtctl.rig_file.axis_tables import AxisTable
    from rtctl.rig_file.config import LoadedConfig


@dataclass(frozen=True)
class Tuning:
    """What the law is given."""

    bandwidth_hz: float
    own_ticks: int = 0
    """By which torque and velocity are delayed, to belong to a force that comes late."""
    excess: float = 0.0
    """Share by which the inertia is taken too high: it damps what may be left over between both."""
    usual_hz: float = 0.0
    """Bandwidth without such a sensor."""


def of_axis(loaded: LoadedConfig, axis: int) -> Tuning:
    """As the rig file says; where it gives no bandwidth the largest that leaves every vibration enough
    damping, behind a late sensor and of gears that are not known (docs/theory.md 6.4, 6.5)."""
    table, T = loaded.config.axis[axis], loaded.config.period_s
    observer, way = table.friction.observer, force_way.of_axis(loaded, axis)
    usual_hz = observer.bandwidth_at(1 / T)
    late, fixed = way.ticks > 0 or way.sensor_hz > 0, observer.bandwidth_hz > 0
    joint = joint_of_axis(loaded, axis)
    if not (observer.gain > 0 and "force" not in loaded.config.rig.absent and (late or not fixed)):
        return Tuning(usual_hz, usual_hz=usual_hz)
    loop = loop_of(table, joint, T, lateness.of_axis(loaded, axis).between, way, Tuning(usual_hz))
    # of an unknown gear `gears` ask
    loop = loop if joint.stiffness_nm_rad > 0 else replace(loop, joints=(RIGID,))
    # a bandwidth that is named is kept; `rtctl check` refuses it where it rings
    return _tuned(loop, () if fixed else gears_of(table, joint), fixed=fixed)


def loop_of(
    table: AxisTable, joint: Joint, period_s: float, between: Between, way: ForceWay, tuning: Tuning
) -> Loop:
    """The loop of an axis that slides as `observer_loop` wants it."""
    from rtctl.control.proofs.observer_loop import Loop  # reading a report's names must not load the compiler

    return Loop(
        **vars(drive_of(table, joint, period_s, between, way)),
        gain=table.friction.observer.gain,
        bandwidth_hz=tuning.bandwidth_hz,
        acting_ticks=round(between.delay + lag_ticks(between.lag_hz, period_s)),
        own_ticks=tuning.own_ticks,
        excess=tuning.excess,
        stiffness_nm_rad=table.coupling.stiffness_nm_rad,
        damping_nms_rad=table.coupling.damping_nms_rad,
        hand=hand_factor(table),
    )


def gears_of(table: AxisTable, joint: Joint) -> tuple[ElasticJoint, ...]:
    """What the joint may be beside what is declared; none where its stiffness is."""
    from rtctl.control.proofs.drive_in_hand import unknown_gears

    return () if joint.stiffness_nm_rad > 0 else unknown_gears(table.inertia_kgm2, table.drive.resonance_hz)


def slower_hz(hz: float) -> list[float]:
    """Bandwidths below this one that are tried, the largest first."""
    from rtctl.control.proofs import observer_margin

    return [float(one) for one in reversed(observer_margin.BANDWIDTHS_HZ) if one < hz]


@lru_cache(maxsize=256)
def _tuned(loop: Loop, gears: tuple[ElasticJoint, ...], *, fixed: bool) -> Tuning:
    from rtctl.control.proofs import observer_match

    slower = [] if fixed else slower_hz(loop.bandwidth_hz)
    # what gears bear without the sensor is what is usual, and no more is tried behind it, as a sensor may
    # be quicker than it is said to be
    at_once = replace(loop, sensor_ticks=0, sensor_hz=0.0)
    usual_hz = observer_match.largest_in_gears(at_once, gears, (loop.bandwidth_hz, *slower))
    if usual_hz == 0.0 or not judged(replace(at_once, bandwidth_hz=usual_hz)).ok:
        usual_hz = (
            loop.bandwidth_hz
        )  # what gears bear is too slow for the joint as it is declared: `rtctl check` says so
    if observer_match.late_ticks(loop) == 0:
        return Tuning(usual_hz, usual_hz=usual_hz)
    found = observer_match.tuned(loop, [hz for hz in (loop.bandwidth_hz, *slower) if hz <= usual_hz], gears)
    if gears and not judged(found).ok:
        # what gears bear fails on the joint as it is declared: that one comes first, and a row says the rest
        found = observer_match.tuned(loop, [loop.bandwidth_hz, *slower])
    return Tuning(found.bandwidth_hz, found.own_ticks, found.excess, usual_hz)


@lru_cache(maxsize=256)
def judged(loop: Loop) -> Finding:
    """The worst of the joint as it is declared in any hand of the box, as late as it is said to be and less
    late."""
    from rtctl.control.proofs import observer_margin
    from rtctl.control.proofs.less_late import less_late

    found = map(observer_margin.judge, (loop, *less_late(loop)))
    return max(found, key=lambda one: (not one.ok, -one.kept))  # the worst: what fails, then what keeps least
