"""ZMTP 3.0 by its bytes, and what is wrong of it: what a stranger may say to a door. RFC 23 of ZeroMQ."""

from __future__ import annotations

import random
from collections.abc import Callable

import msgpack

MORE, LAST = b"\x01\x00", b"\x00\x00"
"""Empty frames, of which more follow or none."""

GREETING = b"\xff" + bytes(8) + b"\x7f\x03\x00" + b"NULL".ljust(20, b"\0") + bytes(32)

_HUGE = (2**63 - 1, 2**64 - 1, 2**32, 10**12)
_VOID = (-1, 0, 1, 2**31, 2**53, 2**63 - 1, 2**64 - 1, 1.5, "0", None, True, [0])
"""Epochs: long past, never to come, and what is none."""


def ready(socket_type: bytes, identity: bytes = b"") -> bytes:
    """The command that ends a handshake; with a name of the client's own choice, of at most 255 bytes."""
    body = b"\x05READY" + _property(b"Socket-Type", socket_type)
    if identity:
        body += _property(b"Identity", identity)
    return (
        b"\x04" + bytes([len(body)]) + body
        if len(body) < 256
        else b"\x06" + len(body).to_bytes(8, "big") + body
    )


def _property(name: bytes, value: bytes) -> bytes:
    return bytes([len(name)]) + name + len(value).to_bytes(4, "big") + value


def frame(payload: bytes) -> bytes:
    """The last frame of a message."""
    if len(payload) < 256:
        return b"\x00" + bytes([len(payload)]) + payload
    return b"\x02" + len(payload).to_bytes(8, "big") + payload


def name_of(number: int) -> bytes:
    """What client `number` calls itself: a new name each time, but for every fourth, who takes that of the
    one before.
    """
    return (number - (number % 4 == 3)).to_bytes(4, "big").rjust(255, b"\x01")


def noise(number: int) -> bytes:
    """64 KiB that are no ZMTP, in some of them after a good beginning."""
    draw = random.Random(number)
    return GREETING[: draw.randrange(65) * (number % 2)] + draw.randbytes(65536)


def half(number: int) -> bytes:
    """A handshake that stops anywhere before its end."""
    whole = GREETING + ready(b"DEALER")
    return whole[: 1 + number % (len(whole) - 1)]


def lies(number: int) -> bytes:
    """A frame whose head claims what does not come, or flags that are reserved; a command that nobody knows,
    or a part of one.
    """
    claimed = _HUGE[number % len(_HUGE)].to_bytes(8, "big")
    return (
        b"\x02" + claimed + b"x" * 8,
        b"\x03" + claimed,
        b"\x06" + claimed + b"\x05READY",
        bytes([0xF8 | number % 8, 4]) + b"abcd",
        b"\x04\x05\x04ERRO",
        b"\x04\x07\x04PING\xff\xff",
        b"\x04\x12\x05READY\xff\xff\xff\xff\xff\x7f\xff\xff\xff",
    )[number % 7]


def asked(number: int) -> bytes:
    """A good request, with the delimiter before it."""
    return MORE + frame(msgpack.packb({"id": number, "op": "status"}))


def void(number: int) -> bytes:
    """Requests that may move nothing: in an epoch that is over or none, with a lease that nobody has."""
    epoch, lease = _VOID[number % len(_VOID)], ("0" * 16, "f" * 16, 0, None)[number % 4]
    requests = (
        {"id": 1, "op": "arm", "epoch": epoch if epoch not in (None, 0, 1) else -2},
        {"id": 2, "op": "reset", "epoch": -1},
        {"id": 3, "op": "target", "lease": lease, "epoch": epoch, "position_rad": [1e3]},
        {"id": 4, "op": "lease", "lease": lease},
        {"id": 5, "op": "release", "lease": lease, "epoch": epoch},
        {"lease": lease, "epoch": epoch, "position_rad": [0.1]},
    )
    return b"".join(frame(msgpack.packb(request)) for request in requests)


BEFORE = ("raw", "half")
"""Kinds that do not get as far as being let in."""

SAYS: dict[str, Callable[[int], bytes]] = {
    "raw": noise,
    "half": half,
    "lies": lies,
    "identities": asked,
    "epochs": void,
}
"""What each kind says in its connection of that number."""
