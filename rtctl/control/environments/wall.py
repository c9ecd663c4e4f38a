"""A wall: a spring and damper on one side of its face, which never pull."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rtctl.control.environments.kind import CENTER, DAMPING, STIFFNESS, Kind, Parameter

if TYPE_CHECKING:
    from hw.record_fields import Record

SIDE = Parameter("side", "", -1, 1, 1, (1.0, -1.0), sign=True)

ABOUT = Kind(
    meaning="A wall: stiff from its place on, towards larger angles.",
    force="k depth + b u inside, never pulling",
    solution="free proxy outside; else (w + k c + (b/t) p_before)/(A + k + b/t), not short of the face",
    parameters={
        STIFFNESS: "k",
        DAMPING: "b",
        CENTER: "face",
        SIDE: "1 resists motion to larger angles, -1 to smaller",
    },
)


def proxy(s: Record, axis: int, drive: float, stiffness: float, before: float, dt: float) -> float:
    """Where wall and coupling are in balance.

    Notes
    -----
    Free proxy w/A; if it is outside the wall, that is the answer. Inside, the wall pushes with
    k d + b u, d the depth. Where that would pull the proxy back in, the wall lets go (free proxy); where
    its damping would stop the proxy short of the face, the proxy rests on the face."""
    k, face = s.world_stiffness_nm_rad[axis], s.world_center_rad[axis]
    damping = s.world_damping_nms_rad[axis] / dt
    side = 1.0 if s.world_side[axis] >= 0 else -1.0
    free = drive / stiffness
    if side * (free - face) <= 0.0:
        return free
    pressed = (drive + k * face + damping * before) / (stiffness + k + damping)
    # the order matters: a damper that holds a proxy which leaves the wall pulls before its spring is out
    if side * (free - pressed) <= 0.0:  # it would have to pull
        return free
    return face if side * (pressed - face) < 0.0 else pressed


def energy(s: Record, axis: int, k: float, center: float, proxy: float) -> float:
    """Energy: k depth^2 / 2."""
    offset = proxy - center
    depth = max(offset if s.world_side[axis] >= 0 else -offset, 0.0)
    return 0.5 * k * depth * depth


def stretch(s: Record, axis: int, center: float) -> float:
    """X - c where the proxy touches the wall, or the joint is beyond its face."""
    way = s.position_rad[axis] - center
    touches = s.world_side[axis] * (s.proxy_position_rad[axis] - center) > 0.0
    return way if touches or s.world_side[axis] * way > 0.0 else 0.0


def free_center(s: Record, axis: int, center: float) -> float:
    """The face goes through space where nothing touches it."""
    face, side = s.world_center_rad[axis], s.world_side[axis]
    nearest = s.position_rad[axis] if side > 0 else -s.position_rad[axis]
    nearest = max(nearest, side * s.proxy_position_rad[axis])
    if side * face < nearest:
        return face
    # up to the joint or the proxy at once; from there on it is felt, and paid
    return side * max(side * center, nearest)
