"""A stranger: `python -m tests.bench.attacker KIND ADDRESS SECONDS`. Of this machine only; ends by itself.

Kinds, all but one of raw ZMTP 3.0 without a key. Of connections that were let in: `frames` sends messages of
three million empty frames, one after the other; `unfinished` one message that never ends; `trickle` the same
slowly; `lies` frames whose heads lie; `identities` asks under ever new names, of 255 bytes and of somebody
else; `epochs` arms, resets and moves in epochs and with leases that are void. Of others: `connects` opens
connections as fast as it can and keeps them; `half` does, and says a part of the greeting in each; `raw`
sends what is no ZMTP; `unknown` shakes hands by keys that the daemon does not know, with its own in the place
of SOCKET_TYPE. Whoever is cut off comes again. Prints `begun` when it is at work, and in the end one JSON
line: bytes sent, connections opened.
"""

from __future__ import annotations

import contextlib
import json
import socket
import sys
import time
from collections.abc import Iterator
from functools import cache

import zmq

from rtctl.errors import ClientError
from tests.bench import zmtp
from tests.bench.flooder import MOST_SECONDS

FRAMES = 3_000_000
MOST_OPEN = 4000
"""Connections that `connects` keeps; the oldest is closed for another one."""

MOST_KEPT = 200
"""Connections that `half` and `identities` keep."""

KNOCKING = 64

TRICKLE_BYTES = 20_000
_CHUNK = zmtp.MORE * 32_768


def connect(
    address: str, socket_type: bytes = b"DEALER", identity: bytes = b"", patience_s: float = 2.0
) -> socket.socket:
    """A connection that has greeted and was let in. Raises OSError, also when nobody answers within
    `patience_s`.
    """
    made = plain(address)
    try:
        made.settimeout(patience_s)
        made.sendall(zmtp.GREETING + zmtp.ready(socket_type, identity))
        heard = b""
        while b"READY" not in heard:  # who says more before that is cut off by libzmq itself
            heard += (said := made.recv(4096))
            if not said:
                raise ConnectionResetError(f"{address}: not let in")
    except OSError:
        made.close()
        raise
    return made


def plain(address: str) -> socket.socket:
    """A connection that has said nothing. Raises OSError."""
    if address.startswith("ipc://"):
        made = socket.socket(socket.AF_UNIX)
        where: str | tuple[str, int] = address.removeprefix("ipc://")
    else:
        made = socket.socket()
        host, port = address.removeprefix("tcp://").split(":")
        where = host, int(port)
    try:
        made.settimeout(2.0)
        made.connect(where)
    except OSError:
        made.close()
        raise
    return made


def _messages(kind: str) -> Iterator[bytes]:
    """What is sent over one connection, in parts."""
    while True:
        for _ in range(FRAMES * len(zmtp.MORE) // len(_CHUNK)):
            yield _CHUNK
        if kind == "frames":
            yield zmtp.LAST


@cache
def _say_begun() -> None:
    """Once."""
    sys.stdout.write("begun\n")
    sys.stdout.flush()


def send_frames(kind: str, address: str, socket_type: bytes, seconds: float) -> dict[str, int]:
    """Send frames without an end, over one connection at a time."""
    end = time.monotonic() + seconds
    opened = sent = 0
    while time.monotonic() < end:
        with contextlib.suppress(OSError), connect(address, socket_type) as made:
            opened += 1
            for part in _messages(kind):
                if time.monotonic() > end:
                    break
                sent += made.send(part[:TRICKLE_BYTES] if kind == "trickle" else part)
                _say_begun()
                if kind == "trickle":
                    time.sleep(0.05)
        _say_begun()  # also where it is not let in
        time.sleep(0.002)
    return {"sent": sent, "opened": opened}


def send_briefly(kind: str, address: str, socket_type: bytes, seconds: float) -> dict[str, int]:
    """One connection after the other, with what this kind says in each; those of `half` and `identities` stay
    open.
    """
    end = time.monotonic() + seconds
    opened = sent = 0
    kept: list[socket.socket] = []
    while time.monotonic() < end:
        with contextlib.suppress(OSError):
            if kind in zmtp.BEFORE:
                made = plain(address)
            else:
                made = connect(address, socket_type, zmtp.name_of(opened) if kind == "identities" else b"")
            kept.append(made)
            opened += 1
            said = zmtp.SAYS[kind](opened)
            made.sendall(said)
            sent += len(said)
        _say_begun()
        if len(kept) > (MOST_KEPT if kind in ("half", "identities") else 0):
            kept.pop(0).close()
        time.sleep(0.0005)
    for one in kept:
        one.close()
    return {"sent": sent, "opened": opened}


def keep_connecting(address: str, seconds: float) -> dict[str, int]:
    """Open connections that say nothing, and keep them."""
    end = time.monotonic() + seconds
    opened = 0
    kept: list[socket.socket] = []
    while time.monotonic() < end:
        try:
            kept.append(plain(address))
        except OSError:
            time.sleep(0.001)
            continue
        opened += 1
        _say_begun()
        if len(kept) > MOST_OPEN:
            kept.pop(0).close()
    for one in kept:
        one.close()
    return {"sent": 0, "opened": opened}


def keep_knocking(address: str, server_key: bytes, seconds: float) -> dict[str, int]:
    """Shake hands by keys that nobody knows, `KNOCKING` at a time."""
    end = time.monotonic() + seconds
    opened = 0
    keys = [zmq.curve_keypair() for _ in range(KNOCKING)]
    with zmq.Context() as context:
        while time.monotonic() < end:
            knocking = [context.socket(zmq.DEALER) for _ in keys]
            for made, (public, secret) in zip(knocking, keys, strict=True):
                made.curve_publickey, made.curve_secretkey, made.curve_serverkey = public, secret, server_key
                made.connect(address)
            opened += len(knocking)
            time.sleep(0.03)
            _say_begun()
            for made in knocking:
                made.close(linger=0)
    return {"sent": 0, "opened": opened}


def main(kind: str, address: str, seconds: str, socket_type: str = "DEALER") -> None:
    """Run one kind of attack."""
    if not address.startswith(("ipc://", "tcp://127.0.0.1:")):
        raise ClientError(f"{address}: attacks are for this machine only")
    sys.stdin.read()  # until its end: the word to begin
    duration = min(float(seconds), MOST_SECONDS)
    if kind == "connects":
        counts = keep_connecting(address, duration)
    elif kind == "unknown":
        counts = keep_knocking(address, socket_type.encode(), duration)
    elif kind in zmtp.SAYS:
        counts = send_briefly(kind, address, socket_type.encode(), duration)
    else:
        counts = send_frames(kind, address, socket_type.encode(), duration)
    sys.stdout.write(json.dumps(counts) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
