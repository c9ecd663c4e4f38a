"""Bounds of what a client may ask of an axis, as a rig tells them."""

BOUNDS = {
    "stiffness_nm_rad": (0.0, 100.0),
    "damping_nms_rad": (0.0, 10.0),
    "center_rad": (-10.0, 10.0),
    "pitch_rad": (0.001, 10.0),
    "position_rad": (-3.0, 3.0),
    "velocity_rad_s": (-20.0, 20.0),
}

DISPLAY = {"mass_kgm2": (0.01, 0.05), "mass_damping_nms_rad": (0.1, 2.0)}
"""The same of one that may show a virtual mass."""
