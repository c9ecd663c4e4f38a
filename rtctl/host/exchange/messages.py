"""Requests of clients, decoded strictly by the table of operations.

`decode` is a pure function of the bytes: it never raises, never allocates beyond a small multiple of the
message, and returns either a `Request` whose every value is known, finite and within its bounds, or a
`Refusal` that says what is wrong."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import Any, TypeGuard

import msgpack

from rtctl.host.exchange.operations import OPERATIONS, Key, Operation
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.wire.protocol import MAX_REQUEST_BYTES, PROTOCOL_VERSION

Id = int | str
MAX_ID = 2**53
"""Largest integer id or epoch: every language's number holds it exactly."""
# names have 32 characters at most, a lease 16
_MAX_TEXT = 64
_MAX_KEYS = 16
# as many axes as there may be (`tick.MOST_AXES`)
_MAX_ITEMS = 8
_OF_ALL = ("id", "op", "epoch", "rig", "protocol")
"""Keys that every operation takes."""
_LEASE_TEXT = re.compile(r"[0-9a-f]{16}")


@dataclass(frozen=True)
class Request:
    """A request that is well formed and within bounds. `axis` is an index in `values`; `id` is None for a
    `stop` in which none could be read: then nobody is answered."""

    id: Id | None
    op: str
    epoch: int | None = None
    values: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Refusal:
    """Why a message was refused. `id` is None where none could be read: then nobody is answered."""

    code: str
    text: str
    id: Id | None = None
    op: str | None = None


class _RefuseError(Exception):
    def __init__(self, code: str, text: str) -> None:
        super().__init__(text)
        self.code = code


class _DuplicateKeyError(ValueError):
    pass


def decode(payload: bytes, rig: RigDescription) -> Request | Refusal:
    """Decode and check one request. A `stop` is one whatever else its map holds.

    Parameters
    ----------
    payload
        The bytes of the payload frame.
    rig
        Axes and bounds.

    Returns
    -------
    Request | Refusal
        Codes of refusals: `too_large`, `malformed`, `wrong_protocol`, `unknown_op`, `unknown_key`,
        `missing_key`, `wrong_type`, `wrong_rig`, `unknown_axis`, `out_of_bounds`."""
    identity: Id | None = None
    op: str | None = None
    try:
        message = _unpack(payload)
        identity = _identity(message)
        if message.get("op") == "stop":
            # of another version, or with a mistake in it: who says stop has a hand on the rig
            return Request(identity, "stop")
        if identity is None:
            raise _RefuseError(
                "malformed", f"id: an integer from 0 to 2^53 or a short text, not {_shown(message.get('id'))}"
            )
        _require_version(message)  # first: what a later version asks may mean another thing, or nothing, here
        op, operation = _operation(message)
        epoch = _epoch(message, required=operation.needs_epoch)
        return Request(identity, op, epoch, _values(message, operation, rig))
    except _RefuseError as refused:
        return Refusal(refused.code, str(refused), identity, op)


def decode_target(payload: bytes, rig: RigDescription) -> Request | Refusal:
    """Decode one message of the endpoint for targets: the keys of the operation `target` and `epoch`.

    `id` and `op` need not be there and mean nothing. Codes of refusals as for `decode`."""
    try:
        message = _unpack(payload)
        _require_version(message)
        operation = OPERATIONS["target"]
        epoch = _epoch(message, required=True)
        # 0: an id is for replies, and a target has none
        return Request(0, "target", epoch, _values(message, operation, rig))
    except _RefuseError as refused:
        return Refusal(refused.code, str(refused))


def _unpack(payload: bytes) -> dict[str, Any]:
    if len(payload) > MAX_REQUEST_BYTES:
        raise _RefuseError("too_large", f"{len(payload)} bytes; a request may have {MAX_REQUEST_BYTES}")
    try:
        message = msgpack.unpackb(
            payload,
            object_pairs_hook=_unique,
            max_str_len=_MAX_TEXT,
            # a header of five bytes may announce 4 GB: refused before they are asked for
            max_array_len=_MAX_ITEMS,
            max_map_len=_MAX_KEYS,
            # no operation has bytes or an extension
            max_bin_len=0,
            max_ext_len=0,
        )
    except _DuplicateKeyError as error:
        raise _RefuseError("malformed", str(error)) from None
    except (ValueError, msgpack.UnpackException) as error:
        raise _RefuseError("malformed", f"not one small msgpack map: {type(error).__name__}") from None
    if not isinstance(message, dict):
        raise _RefuseError("malformed", f"a request is a map, not {_shown(message)}")
    return message


def _unique(pairs: list[tuple[Any, Any]]) -> dict[str, Any]:
    """Build a map; msgpack itself would let the last of two equal keys win."""
    unique: dict[str, Any] = {}
    for key, value in pairs:
        if not isinstance(key, str):  # msgpack allows any key
            msg = "keys are strings"
            raise _DuplicateKeyError(msg)
        if key in unique:
            msg = f"key {_shown(key)} given twice"
            raise _DuplicateKeyError(msg)
        unique[key] = value
    return unique


def _identity(message: dict[str, Any]) -> Id | None:
    identity = message.get("id")
    if isinstance(identity, str) and 0 < len(identity) <= _MAX_TEXT:
        return identity
    if _is_integer(identity) and 0 <= identity <= MAX_ID:
        return int(identity)
    return None


def _operation(message: dict[str, Any]) -> tuple[str, Operation]:
    op = message.get("op")
    if not isinstance(op, str) or op not in OPERATIONS:
        raise _RefuseError("unknown_op", f"op {_shown(op)}; there are: {', '.join(OPERATIONS)}")
    return op, OPERATIONS[op]


def _epoch(message: dict[str, Any], *, required: bool) -> int | None:
    epoch = message.get("epoch")
    # a nil that was sent is a wrong type, not a missing key
    if epoch is None and "epoch" not in message:
        if required:
            raise _RefuseError(
                "missing_key", "epoch: give the one you last saw, so that a stop voids this request"
            )
        return None
    # a state sample has it as float64, and some languages have no other numbers
    if isinstance(epoch, float) and epoch.is_integer():
        epoch = int(epoch)
    if not _is_integer(epoch):
        raise _RefuseError("wrong_type", f"epoch: an integer, not {_shown(epoch)}")
    if not 0 <= epoch <= MAX_ID:
        raise _RefuseError("out_of_bounds", f"epoch: {epoch} is not within 0 to 2^53")
    return int(epoch)


def _values(message: dict[str, Any], operation: Operation, rig: RigDescription) -> dict[str, Any]:
    known = {key.name: key for key in operation.keys}
    _require_rig(message, rig)
    # refused, not left out: a key of another version, or spelt wrong, would do nothing and nobody would know
    for name in message:
        if name not in known and name not in _OF_ALL:
            allowed = ", ".join(known) or f"none besides {', '.join(_OF_ALL)}"
            raise _RefuseError("unknown_key", f"{_shown(name)}; this operation takes: {allowed}")
    values: dict[str, Any] = {}
    for name, key in known.items():
        if name in message:
            # operations name the axis before what is bounded by it
            values[name] = _value(message[name], key, rig, values.get("axis"))
        elif key.required:
            raise _RefuseError("missing_key", f"{name} is missing: {key.meaning}")
    return values


def _require_version(message: dict[str, Any]) -> None:
    """Refuse what is asked in the words of a later protocol; a request that names none is of this one."""
    spoken = message.get("protocol", PROTOCOL_VERSION)
    if not _is_integer(spoken):
        raise _RefuseError("wrong_type", f"protocol: its version, an integer, not {_shown(spoken)}")
    if spoken != PROTOCOL_VERSION:
        raise _RefuseError(
            "wrong_protocol",
            f"the client speaks protocol {_shown(spoken)}, this daemon {PROTOCOL_VERSION}: install the same "
            "version of rtctl at both ends, and start the daemon anew",
        )


def _require_rig(message: dict[str, Any], rig: RigDescription) -> None:
    """Refuse what is meant for another rig, whose daemon was reached here before."""
    meant = message.get("rig", rig.name)
    if not isinstance(meant, str):
        raise _RefuseError("wrong_type", f"rig: its name, not {_shown(meant)}")
    if meant != rig.name:
        raise _RefuseError(
            "wrong_rig",
            f"this is for rig {_shown(meant)}, and rig {rig.name} is reached here now: connect anew",
        )


def _value(value: object, key: Key, rig: RigDescription, axis: int | None) -> int | float | str | list[float]:
    if key.kind == "axis":
        return _axis_index(value, rig)
    if key.kind == "choice":
        # True and 1.0 are equal to 1 in Python, and -1 and 1 are choices
        if isinstance(value, bool | float) or not isinstance(value, str | int) or value not in key.choices:
            raise _choice_error(value, key)
        return value
    if key.kind == "lease":
        if not isinstance(value, str) or not _LEASE_TEXT.fullmatch(value):
            raise _RefuseError("wrong_type", f"{key.name}: the 16 characters that `lease` gave")
        return value
    if key.kind == "number":
        return _number(value, key, key.name, rig.axes[axis or 0])
    if not isinstance(value, list) or len(value) != rig.n_axes:
        raise _RefuseError("wrong_type", f"{key.name}: an array of {rig.n_axes} numbers, not {_shown(value)}")
    return [_number(item, key, f"{key.name}[{i}]", rig.axes[i]) for i, item in enumerate(value)]


def _choice_error(value: object, key: Key) -> _RefuseError:
    code = "out_of_bounds" if type(value) in {type(choice) for choice in key.choices} else "wrong_type"
    allowed = ", ".join(str(choice) for choice in key.choices)
    return _RefuseError(code, f"{key.name}: one of {allowed}, not {_shown(value)}")


def _axis_index(value: object, rig: RigDescription) -> int:
    names = [axis.name for axis in rig.axes]
    if isinstance(value, str) and value in names:
        return names.index(value)
    if _is_integer(value) and 0 <= value < rig.n_axes:
        return int(value)
    code = "unknown_axis" if isinstance(value, str) or _is_integer(value) else "wrong_type"
    raise _RefuseError(
        code, f"axis: one of {', '.join(names)}, or an index below {rig.n_axes}, not {_shown(value)}"
    )


def _number(value: object, key: Key, where: str, axis: AxisDescription) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _RefuseError("wrong_type", f"{where}: a number, not {_shown(value)}")
    if key.low is None or key.high is None:
        low, high = axis.bounds[key.name]
    else:
        low, high = key.low, key.high
    if not math.isfinite(value) or not low <= value <= high:
        raise _RefuseError("out_of_bounds", f"{where}: {value} is not within {low:g} to {high:g}")
    return float(value)


def _is_integer(value: object) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool)


def _shown(value: object) -> str:
    """A value as part of a sentence: short, and never the repr of something nested."""
    if value is None:
        return "nil"
    if isinstance(value, str | int | float):
        text = repr(value)
        return text if len(text) <= _MAX_TEXT else text[: _MAX_TEXT - 3] + "..."
    if isinstance(value, list):
        return "an array"
    return "a map" if isinstance(value, dict) else type(value).__name__
