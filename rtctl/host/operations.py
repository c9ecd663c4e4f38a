"""The table of operations: what a client may ask, with the keys, types and bounds of each.

The decoder (`messages`), the handlers (`requests`), `hello` and the document all follow this table.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rtctl.control.vocabulary import Environment

KINDS = tuple(kind.name.lower() for kind in Environment)


@dataclass(frozen=True)
class Key:
    """One key of a request, with what it may hold.

    kind `number`: one finite number; `numbers`: one per axis of the rig; `axis`: an axis' name or index;
    `choice`: one of `choices`. Bounds are fixed (`low`, `high`), or the axis' own when `low` is None.
    """

    name: str
    kind: Literal["number", "numbers", "axis", "choice"]
    meaning: str
    required: bool = False
    low: float | None = None
    high: float | None = None
    choices: tuple[str | int, ...] = ()


@dataclass(frozen=True)
class Operation:
    """One operation: its keys besides `id`, `op` and `epoch`, and whether `epoch` must be given."""

    meaning: str
    keys: tuple[Key, ...] = ()
    needs_epoch: bool = False


_AXIS = Key("axis", "axis", "the axis, by name or index", required=True)

OPERATIONS: dict[str, Operation] = {
    "hello": Operation("protocol, rig, axes, rate, endpoints, bounds"),
    "status": Operation("state, epoch, faults, newest measurements, command in force"),
    "schema": Operation("JSON Schema of the tick record"),
    "arm": Operation("enable the actuator: IDLE to ARMING to ACTIVE", needs_epoch=True),
    "stop": Operation("ramp the torque to zero and disable; never refused"),
    "reset": Operation("leave FAULT or ESTOP once its cause is gone"),
    "tare": Operation("take the present force reading as zero"),
    "environment": Operation(
        "virtual environment of one axis; keys left out keep their value",
        (
            _AXIS,
            Key("kind", "choice", "kind of environment", required=True, choices=KINDS),
            Key("stiffness_nm_rad", "number", "spring, wall: stiffness; detents: greatest slope"),
            Key("damping_nms_rad", "number", "wall, damper: damping"),
            Key("center_rad", "number", "rest angle, wall face, or centre of a detent"),
            Key("side", "choice", "wall: 1 resists motion to larger angles, -1 to smaller", choices=(-1, 1)),
            Key("pitch_rad", "number", "detents: distance"),
        ),
    ),
    "target": Operation(
        "proxy of the axes whose environment is remote",
        (
            Key("position_rad", "numbers", "proxy position of every axis", required=True),
            Key("velocity_rad_s", "numbers", "proxy velocity of every axis; 0 when left out"),
        ),
        needs_epoch=True,
    ),
    "compensation": Operation(
        "share of the configured friction feed-forward",
        (
            Key("axis", "axis", "the axis, by name or index; all when left out"),
            Key("share", "number", "0 is off, 1 as configured", required=True, low=0.0, high=1.0),
        ),
    ),
}
"""Every operation a client may ask for."""
