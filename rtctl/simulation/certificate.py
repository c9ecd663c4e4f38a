"""What `rtctl check` would say of a simulated rig, for reports that show it beside what happened."""

from __future__ import annotations

from dataclasses import replace

from rtctl.check import stability_report
from rtctl.check.devices_of_axis import joint_of_axis, sure_damping
from rtctl.control.proofs import admittance_margin
from rtctl.control.proofs.drive_in_hand import RIGID
from rtctl.rig_file.config import LoadedConfig


def stiffest_hand_nm_rad(loaded: LoadedConfig) -> float:
    """The stiffest hand that the certificate of the first axis lets pass, in any linear world, N m/rad; 0
    where none."""
    return admittance_margin.largest_hand(stability_report.admittance_loop(loaded, 0))


def bears(loaded: LoadedConfig, hand_nm_rad: float) -> bool:
    """Whether the matrices of the first axis bear hands of this stiffness, N m/rad, in any linear world: at
    the grid's points."""
    loop = stability_report.admittance_loop(loaded, 0)
    box = replace(loop.box, stiffness_nm_rad=hand_nm_rad)
    return admittance_margin.judge_stiffest(replace(loop, box=box)).ok


def is_rigid(loaded: LoadedConfig) -> bool:
    """Whether the first axis' joint is said to be one mass."""
    return stability_report.admittance_loop(loaded, 0).joints == (RIGID,)


def sure_damping_nms_rad(loaded: LoadedConfig) -> float:
    """Viscous damping of the first axis that no hand takes away, N m s/rad (docs/theory.md 2.8)."""
    return sure_damping(loaded.config.axis[0].viscous_nms_rad, joint_of_axis(loaded, 0))
