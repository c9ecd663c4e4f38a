"""Gains of the speed servo of an identification that no joint of an axis rings on (docs/theory.md 9.1)."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product

import numpy as np

from hw.interface import Joint
from rtctl.check.devices_of_axis import joint_of_axis, link_damping
from rtctl.check.drive_of_axis import joints_of
from rtctl.check.lateness import of_axis
from rtctl.control.proofs.admittance_loop import AdmittanceLoop, points, spectral_radii
from rtctl.control.proofs.drive_in_hand import ElasticJoint, resonance
from rtctl.rig_file.axis_tables import AxisTable
from rtctl.rig_file.config import LoadedConfig

GAIN_MARGIN = 1.5
"""The servo stays stable with all of its torque so many times as large: an inertia that is told two thirds
too small."""
LATENESS = (0.0, 0.5, 1.0)
"""Shares of what is declared of delay and current loop that must be quiet: a rig may be quicker, and its
current may exceed a step by less."""
STEP, STEPS = math.sqrt(2.0), 13
"""Filters that are tried: each so many times as slow as the one before, and how many."""
UNSOUND = (
    "is stable on this joint, elastic and late as it is (docs/theory.md 9.1): declare its damping "
    "(viscous_nms_rad, drive.joint_damping_nms_rad), make the drive quicker"
)
"""Why a rig is refused, behind what is not stable."""
_FIXED = (1e-3, 1e9)
"""Virtual mass, kg m^2, and spring, N m/rad, by which the reference stands still: its motion changes nothing
of a linear loop."""

Gains = Callable[[float], tuple[float, float, float]]
"""Damping N m s/rad, stiffness N m/rad and time constant s of the filter, of a factor on that time."""


def slowed_until_quiet(loaded: LoadedConfig, axis: int, gains: Gains) -> float | None:
    """Least factor of the filter's time constant, 1 or more, with which this servo is stable on every joint
    that the axis may have; None where none of `STEPS` is."""
    tried = (STEP**step for step in range(STEPS))
    return next((factor for factor in tried if _quiet(loaded, axis, *gains(factor))), None)


def _joints(table: AxisTable, joint: Joint, period_s: float) -> tuple[ElasticJoint, ...]:
    """Those of the proofs, and where the rig file names the lowest resonance and no device knows better, that
    one: a rig that nothing else calls elastic rings there all the same."""
    found, hz = joints_of(joint, table.inertia_kgm2), table.drive.resonance_hz
    # from half of the rate on it is nothing that a tick sees
    named = joint.stiffness_nm_rad == 0 and 0 < hz * period_s < 0.5
    return (*found, resonance(table.inertia_kgm2, hz)) if named else found


def _quiet(loaded: LoadedConfig, axis: int, d: float, k: float, filter_s: float) -> bool:
    """Whether this servo is stable with `GAIN_MARGIN`, however late of what is declared."""
    table, T, joint = loaded.config.axis[axis], loaded.config.period_s, joint_of_axis(loaded, axis)
    between, joints = of_axis(loaded, axis).between, _joints(table, joint, T)
    mass, spring = _FIXED
    at = points([(0.0, 0.0, 0.0, 0.0, one, spring, 0.0) for one in range(len(joints))])
    for share, overshoot in product(LATENESS, {0.0, between.overshoot}):
        loop = AdmittanceLoop(
            table.inertia_kgm2,
            table.viscous_nms_rad,
            T,
            mass,
            0.0,
            GAIN_MARGIN * d,
            GAIN_MARGIN * k,
            delay=share * between.delay,
            # of a lag the time constant is what may be less; 0 is none
            lag_hz=between.lag_hz / share if share > 0 else 0.0,
            overshoot=overshoot,
            sample_ticks=between.sample_ticks,
            # the law's filter is T/(T + tau)
            velocity_lowpass_hz=math.log1p(T / filter_s) / (2 * math.pi * T),
            link_viscous_nms_rad=link_damping(table.viscous_nms_rad, joint),
            encoder=joint.encoder,
            joints=joints,
        )
        if not np.all(spectral_radii(loop, at) < 1.0):
            return False
    return True
