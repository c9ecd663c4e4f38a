"""Sizes of an axis: what an experiment chose for a joint, as it is on the axis that it is run on.

A linear axis has it as it is at a handle 10 cm from a joint (`hw.motion.own_size`). An axis with less room,
in travel or speed, has every motion made smaller by one factor, in place and speed alike: periods stay."""

from __future__ import annotations

from hw.motion import own_size, words
from rtctl.errors import ConfigError
from rtctl.rig_file.config import LoadedConfig

USED_SHARE = 0.8
"""Share of the travel on the nearer side, and of the velocity limit, that motions may use."""


def scale(loaded: LoadedConfig, reach_rad: float, speed_rad_s: float = 0.0) -> float:
    """Factor of motions that, on a joint with room for them, reach so far from where the first axis starts,
    at this speed at most.

    Raises
    ------
    ConfigError
        It starts at an end of its travel."""
    axis = loaded.config.axis[0]
    start_rad = float(loaded.options["axis"][0]["start_position_rad"])
    # motions go to both sides: the nearer end counts
    up, down = axis.position_max_rad - start_rad, start_rad - axis.position_min_rad
    if not min(up, down) > 0:
        said = (
            f"{loaded.path}: device[0].options.axis[0].start_position_rad {start_rad:g}: the experiments "
            "move to both sides of it, and position_min_rad to position_max_rad are "
            f"{axis.position_min_rad:g} to {axis.position_max_rad:g} rad; let it start nearer to the middle"
        )
        raise ConfigError(words(said, axis.motion))
    factor = own_size("reach_rad", 1.0, axis.motion)
    left = [USED_SHARE * min(up, down) / reach_rad]
    if speed_rad_s > 0:
        # a motion that met the velocity limit would be one of the gate, and not of the controller
        left.append(USED_SHARE * axis.velocity_limit_rad_s / speed_rad_s)
    return min(factor, *left)  # place and speed by one factor: periods stay
