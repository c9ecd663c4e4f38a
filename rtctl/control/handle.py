"""Ways and speeds that were chosen for a joint, as they are on a linear axis: at a handle
`hw.motion.HANDLE_M` from the joint.

Inside, the coordinate of a linear axis is m under the names of rad (`hw.motion`). A constant of the law that
is so many rad a second would there be as many metres a second: a carriage that a hand moves at 9 mm/s would
creep, and be left unhelped."""

from __future__ import annotations

from hw.motion import HANDLE_M
from rtctl.control.jit import inlined
from rtctl.control.records import Record

_HANDLE_M = HANDLE_M


@inlined
def own_rad(p: Record, axis: int, chosen: float) -> float:
    """A way in rad or speed in rad/s `chosen` for a joint, in the coordinate of this axis."""
    return chosen * _HANDLE_M if p.is_linear[axis] != 0 else chosen
