"""Axes of little travel, and the motions of a hand that experiments make on all of them."""

from rtctl.experiments.virtual import FAST_SINE, PUSH, SLOW_TRIANGLE

MOTIONS = (FAST_SINE, SLOW_TRIANGLE, PUSH)


def narrow(loaded, least, most, **more):
    """The rig with these ends of the travel of its first axis."""
    axis = loaded.config.axis[0].model_copy(
        update={"position_min_rad": least, "position_max_rad": most, **more}
    )
    return loaded.model_copy(update={"config": loaded.config.model_copy(update={"axis": (axis,)})})
