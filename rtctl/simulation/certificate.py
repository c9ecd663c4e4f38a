"""What `rtctl check` would say of a simulated rig's admittance display, for reports that show it beside what happened."""

from __future__ import annotations

from rtctl.check import stability_report
from rtctl.control import admittance_margin
from rtctl.rig_file.config import LoadedConfig


def stiffest_hand_nm_rad(loaded: LoadedConfig) -> float:
    """The stiffest hand that the certificate of the first axis lets pass, in any linear world, N m/rad; 0 where none."""
    return admittance_margin.largest_hand(stability_report.admittance_loop(loaded, 0))
