"""A hostile client: `python -m tests.bench.flooder KIND ADDRESS SECONDS [RATE_HZ]`. Of this machine only;
ends by itself.

Kinds: `junk`, `valid` and `targets` offer messages to an endpoint at RATE_HZ (what the daemon does not take
yet waits here, and is not made up for); `connections` keeps 200 TCP connections open that send noise and 200
that say nothing, and opens each again when it is closed. Prints one JSON line: what was offered and taken.
"""

from __future__ import annotations

import contextlib
import json
import selectors
import socket
import sys
import time

import msgpack
import zmq

from rtctl.errors import ClientError

RATE_HZ = 1e5
CONNECTIONS = 200
MOST_SECONDS = 600.0
_SLICE_S = 0.002

MESSAGES = {
    "junk": b"\xdd\x05\xf5\xe1\x00" + b"\x01" * 38,  # 43 bytes that claim 1e8 elements
    "valid": msgpack.packb({"id": 1, "op": "status"}),
    "targets": msgpack.packb({"lease": "0" * 16, "epoch": 0, "position_rad": [0.0]}),
}


def send_messages(kind: str, address: str, seconds: float, rate_hz: float) -> dict[str, int]:
    """Offer one message again and again at `rate_hz`, reading no reply."""
    payload = MESSAGES[kind]
    offered = taken = 0
    with zmq.Context() as context, context.socket(zmq.DEALER) as dealer:
        dealer.setsockopt(zmq.LINGER, 0)
        dealer.setsockopt(zmq.RCVHWM, 1)
        dealer.connect(address)
        began = time.monotonic()
        while (passed := time.monotonic() - began) < seconds:
            while offered < rate_hz * passed:
                offered += 1
                try:
                    dealer.send(payload, zmq.NOBLOCK)
                    taken += 1
                except zmq.Again:
                    offered = int(rate_hz * passed)
            time.sleep(_SLICE_S)
    return {"offered": offered, "taken": taken}


def keep_connections(address: str, seconds: float) -> dict[str, int]:
    """Keep noisy and silent TCP connections open; count how often each had to be opened."""
    host, port = address.removeprefix("tcp://").split(":")
    end = time.monotonic() + seconds
    opened = 0
    with selectors.DefaultSelector() as selector:

        def open_one(noisy: bool) -> None:
            nonlocal opened
            made = socket.socket()
            made.setblocking(False)
            made.connect_ex((host, int(port)))
            selector.register(made, selectors.EVENT_READ | (selectors.EVENT_WRITE if noisy else 0), noisy)
            opened += 1

        for number in range(2 * CONNECTIONS):
            open_one(number % 2 == 0)
        while time.monotonic() < end:
            for key, events in selector.select(0.05):
                one, noisy = key.fileobj, key.data
                assert isinstance(one, socket.socket)
                closed = False
                with contextlib.suppress(BlockingIOError):
                    try:
                        if events & selectors.EVENT_WRITE:
                            one.send(b"\xff\xfejunk" * 8)
                        closed = bool(events & selectors.EVENT_READ) and one.recv(4096) == b""
                    except OSError:
                        closed = True
                if closed:
                    selector.unregister(one)
                    one.close()
                    open_one(noisy)
            time.sleep(0.01)  # noise, not a test of the network
        for key in list(selector.get_map().values()):
            assert isinstance(key.fileobj, socket.socket)
            key.fileobj.close()
    return {"offered": opened, "taken": 2 * CONNECTIONS}


def main(kind: str, address: str, seconds: str, rate_hz: str = str(RATE_HZ)) -> None:
    """Run one kind of flood."""
    if not address.startswith(("ipc://", "tcp://127.0.0.1:")):
        raise ClientError(f"{address}: floods are for this machine only")
    duration = min(float(seconds), MOST_SECONDS)
    if kind == "connections":
        counts = keep_connections(address, duration)
    else:
        counts = send_messages(kind, address, duration, float(rate_hz))
    sys.stdout.write(json.dumps(counts) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
