"""A request for an excitation program with sound numbers, and what the tick says of it."""

from rtctl.control.vocabulary import Program, ProgramFlag

FIELDS = {
    "velocity_rad_s": 0.0,
    "acceleration_rad_s2": 10.0,
    "stiffness_nm_rad": 40.0,
    "damping_nms_rad": 1.2,
    "alpha": 0.3,
    "torque_max_nm": 1.0,
    "ramp_nm_s": 0.5,
    "fast_nm": 0.0,
    "slip_rad": 0.01,
    "min_rad": -2.0,
    "max_rad": 2.0,
    "hand_nm": 0.05,
    "hand_zero_nm": 0.0,
}


def ask(rig, kind, limit_ticks=100_000, **values):
    """Request a program on every axis, with sound numbers where none are given."""
    rig.command["program_kind"] = int(kind)
    rig.command["program_limit_ticks"] = limit_ticks
    for name, value in {**FIELDS, **values}.items():
        rig.command[f"program_{name}"] = value
    rig.command["program_count"] += 1
    return rig


def coast(rig, plant, n):
    """Run the rig on a plant for n ticks."""
    for _ in range(n):
        rig.tick(plant.advance(rig["torque_applied_nm"]))
    return rig


def flags(rig):
    return ProgramFlag(int(rig["program_flags"]))


def kind(rig):
    return Program(int(rig["program_kind"]))
