"""Simulated rigs displayed as an admittance, made of the shipped one by changes of its text."""

import numpy as np

from rtctl.rig_file import config
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.shipped_files import shipped_config

SLIPPERY = (
    ("coulomb_nm = 0.25", "coulomb_nm = 1e-5"),
    ("breakaway_nm = 0.35", "breakaway_nm = 1e-5"),
    ("rest_damping_nms_rad = 0.53", "rest_damping_nms_rad = 0.0"),
    ("dry_friction_nm = 0.2", "dry_friction_nm = 0.0"),
)
"""Next to no dry friction, and nothing that is for a joint which sticks."""

QUIET = (
    ("resolution_n = 0.005", "resolution_n = 0.0"),
    ("noise_n = 0.005", "noise_n = 0.0"),
    ("current_noise_a = 0.005", "current_noise_a = 0.0"),
)


def rig(folder, *changes):
    """The rig of configs/admittance.toml with (old, new) pieces of text."""
    text = shipped_config("admittance.toml").read_text()
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path = folder / "rig.toml"
    path.write_text(text)
    return Simulation(config.load(path))


def hand(stiffness_nm_rad, damping_nms_rad, amplitude_rad, frequency_hz):
    """Changes of the hand: a spring and damper that follow a sine."""
    return (
        (
            "stiffness_nm_rad = 5.0\ndamping_nms_rad = 0.1\nstart_s",
            f"stiffness_nm_rad = {stiffness_nm_rad}\ndamping_nms_rad = {damping_nms_rad}\nstart_s",
        ),
        ("amplitude_rad = 0.3", f"amplitude_rad = {amplitude_rad}"),
        ("frequency_hz = 0.5", f"frequency_hz = {frequency_hz}"),
    )


def felt(ticks, speed_rad_s, frequency_hz, period_s):
    """Impedance that the hand felt at this frequency, complex, N m s/rad: its torque over the true speed, by
    their first harmonics.
    """
    turn = np.exp(-2j * np.pi * frequency_hz * period_s * np.arange(len(ticks)))
    return np.mean(ticks["hand_torque_nm"][:, 0] * turn) / np.mean(speed_rad_s * turn)
