"""The table of operations: what a client may ask, who may, and the keys, types and bounds of each.

The decoder (`messages`), the handlers (`requests`), `hello` and the document all follow this table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rtctl.control.vocabulary import NAMES, PARAMETERS, Display, meaning
from rtctl.wire.protocol import ROLES

SWITCH = ("on", "off")
HANDS = ("off",)
DISPLAYS = tuple(one.name.lower() for one in Display)

Role = Literal["observer", "renderer", "operator"]


@dataclass(frozen=True)
class Key:
    """One key of a request, with what it may hold.

    kind `number`: one finite number; `numbers`: one per axis of the rig; `axis`: an axis' name or index;
    `choice`: one of `choices`; `lease`: the text that `lease` gave. Bounds are fixed (`low`, `high`), or the
    axis' own when `low` is None."""

    name: str
    kind: Literal["number", "numbers", "axis", "choice", "lease"]
    meaning: str
    required: bool = False
    low: float | None = None
    high: float | None = None
    choices: tuple[str | int, ...] = ()


@dataclass(frozen=True)
class Operation:
    """One operation: its keys besides `id`, `op` and `epoch`, and whether `epoch` must be given.

    `role` is the least a client must be."""

    meaning: str
    role: Role
    keys: tuple[Key, ...] = ()
    needs_epoch: bool = False


def allowed(op: str, role: str) -> bool:
    """Whether a client of this role may ask for this operation."""
    # roles stand in their order: each may what those before it may
    return ROLES.index(role) >= ROLES.index(OPERATIONS[op].role)


_AXIS = Key("axis", "axis", "the axis, by name or index", required=True)
_LEASE = Key("lease", "lease", "the text the operation `lease` gave", required=True)
_HELD = Key("lease", "lease", "the lease that is held already: renews it")
# high: every language's number holds it exactly (`messages.MAX_ID`)
_DECIDED = Key("tick", "number", "the tick in which it was decided", low=0, high=2**53)

OPERATIONS: dict[str, Operation] = {
    "hello": Operation("protocol, rig, axes, rate, endpoints, bounds", "observer"),
    "status": Operation("state, epoch, faults, newest measurements, command in force", "observer"),
    "schema": Operation("JSON Schema of the tick record", "observer"),
    # an epoch is required where something would move: a stop since then must void it
    "arm": Operation(
        "enable the actuator: IDLE to ARMING to ACTIVE", "operator", (_DECIDED,), needs_epoch=True
    ),
    "stop": Operation("ramp the torque to zero and disable; never refused", "observer"),
    "reset": Operation(
        "leave FAULT or ESTOP once its cause is gone, or dismiss a stop of the friction watch", "operator"
    ),
    "tare": Operation(
        "take the present force reading as zero",
        "operator",
        (Key("hands", "choice", "nobody touches the device, whatever force is shown", choices=HANDS),),
    ),
    "lease": Operation(
        "be the one who moves the proxy, until stopped, released or silent",
        "renderer",
        (_HELD,),
        needs_epoch=True,
    ),
    "release": Operation("give the lease back", "renderer", (_LEASE,)),
    "environment": Operation(
        "virtual environment of one axis; keys left out keep their value",
        "renderer",
        (
            _AXIS,
            Key("kind", "choice", "kind of environment", required=True, choices=NAMES),
            *(
                Key(one.name, "choice", meaning(one), choices=(-1, 1))
                if one.sign
                else Key(one.name, "number", meaning(one))
                for one in PARAMETERS
            ),
            Key("lease", "lease", "needed by a renderer, who changes what it moves; not by an operator"),
        ),
    ),
    "display": Operation(
        "what an axis shows: an impedance or an admittance, and mass and damping of that; keys left out "
        "keep their value",
        "renderer",
        (
            _AXIS,
            Key(
                "display",
                "choice",
                "the other one only where the rig file has display_change = true",
                choices=DISPLAYS,
            ),
            Key("mass_kgm2", "number", "virtual mass; from the rig file's own up to its mass_max_kgm2"),
            Key(
                "mass_damping_nms_rad",
                "number",
                "its damping; from the rig file's own up to its damping_max_nms_rad",
            ),
            Key("lease", "lease", "needed by a renderer, as for an environment; not by an operator"),
        ),
    ),
    "target": Operation(
        "proxy of the axes whose environment is remote",
        "renderer",
        (
            _LEASE,
            Key("position_rad", "numbers", "proxy position of every axis", required=True),
            Key("velocity_rad_s", "numbers", "proxy velocity of every axis; 0 when left out"),
        ),
        needs_epoch=True,
    ),
    "compensation": Operation(
        "share of the configured friction feed-forward",
        "operator",
        (
            Key("axis", "axis", "the axis, by name or index; all when left out"),
            Key("share", "number", "0 is off, 1 as configured", required=True, low=0.0, high=1.0),
        ),
    ),
    "adapt": Operation(
        "have the compensation follow the friction that is seen, or hold it where it is",
        "operator",
        (
            Key("axis", "axis", "the axis, by name or index; all that may follow when left out"),
            Key(
                "follow",
                "choice",
                "on only where the rig file has adapt_per_min > 0",
                required=True,
                choices=SWITCH,
            ),
        ),
    ),
}
"""Every operation a client may ask for."""
