"""The drive that the proofs take an axis for: its joint, how late it is, and the way of its force."""

from __future__ import annotations

from hw.interface import Joint
from rtctl.check.devices_of_axis import link_damping
from rtctl.check.force_way import ForceWay
from rtctl.control.proofs.drive_in_hand import RESONANCES_HZ, RIGID, Drive, ElasticJoint, resonance
from rtctl.control.proofs.stability import Between
from rtctl.rig_file.axis_tables import AxisTable


def joints_of(joint: Joint, inertia_kgm2: float) -> tuple[ElasticJoint, ...]:
    """Rigid, elastic as declared, or elastic of all resonances where it is said to be elastic and no more."""
    if joint.stiffness_nm_rad > 0:
        one = ElasticJoint(joint.link_inertia_share, joint.stiffness_nm_rad, joint.damping_nms_rad)
        return (one,)
    if joint.motor_share < 1:  # elastic, and nobody says how much: all of them must pass
        return tuple(resonance(inertia_kgm2, hz) for hz in RESONANCES_HZ)
    return (RIGID,)


def drive_of(table: AxisTable, joint: Joint, period_s: float, between: Between, way: ForceWay) -> Drive:
    """The drive of an axis that slides, with its force sensor.

    Its damping is the rig file's, not what a feed-forward leaves of it: that only takes part of the
    observer's work (`observer_loop`). An admittance, which has no observer, puts in what is left
    (`admittance_figures.loop_of`)."""
    return Drive(
        table.inertia_kgm2,
        table.viscous_nms_rad,
        period_s,
        delay=between.delay,
        lag_hz=between.lag_hz,
        sample_ticks=between.sample_ticks,
        sensor_hz=way.sensor_hz,
        sensor_ticks=way.ticks,
        force_lowpass_hz=table.force.lowpass_hz,
        link_viscous_nms_rad=link_damping(table.viscous_nms_rad, joint),
        encoder=joint.encoder,
        joints=joints_of(joint, table.inertia_kgm2),
    )
