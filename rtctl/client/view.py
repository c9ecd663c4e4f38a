"""The live view as the daemon runs it: `python -m rtctl.client.view`, ordered by one line of JSON on its
input.

The view ends with its input, that is with the daemon. `rtctl view` is the same for a person at a terminal."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import sys
import threading
from io import RawIOBase
from pathlib import Path

from rtctl.client import RigClient
from rtctl.client.view_server import ViewServer
from rtctl.errors import NoReplyError, RtctlError
from rtctl.wire.protocol import endpoints_in

NICENESS = 5
OOM_SCORE = 500
"""Short of memory, the system ends the view, not the rig."""


def main(orders: RawIOBase) -> int:
    """Serve until the input ends. Returns the exit status."""
    order = json.loads(orders.readline())
    # before a thread is started: niceness and cores are each thread's own, and inherited (sched(7))
    step_back(order["avoid_core"])
    threading.Thread(target=_end_with, args=(orders,), daemon=True).start()
    try:
        with RigClient(endpoints=endpoints_in(Path(order["folder"]))) as client:
            server = _connect(client, order)
            server.serve_forever(poll_interval=0.5)
    except RtctlError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


class Inherited(ViewServer):
    """The page's server, at an address where the daemon listens already."""

    def __init__(self, client: RigClient, listening: socket.socket, key: str) -> None:
        self._listening = listening
        host, port = listening.getsockname()
        super().__init__(client, host, port, key)

    def server_bind(self) -> None:
        """Take what listens in place of a socket of one's own."""
        self.socket.close()
        self.socket, self.server_address = self._listening, self._listening.getsockname()


def step_back(avoid_core: int) -> None:
    """Take second place to loop and host, as far as the system lets this process choose."""
    with contextlib.suppress(OSError):
        os.nice(NICENESS)
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(str(OOM_SCORE))
    with contextlib.suppress(OSError):
        # on a machine of one core there is no other
        if others := os.sched_getaffinity(0) - {avoid_core}:
            os.sched_setaffinity(0, others)


def _end_with(orders: RawIOBase) -> None:
    while orders.read(4096):
        pass
    os._exit(0)  # nothing here needs an orderly end, and a browser must not delay it


def _connect(client: RigClient, order: dict[str, str | int]) -> ViewServer:
    """The server, once the daemon answers, at the address where that listens."""
    listening = socket.socket(fileno=int(order["listening"]))
    while True:
        # `hello` itself waits for the daemon: this does not spin
        with contextlib.suppress(NoReplyError):
            return Inherited(client, listening, str(order["key"]))


if __name__ == "__main__":
    with open(sys.stdin.fileno(), "rb", buffering=0, closefd=False) as orders_:
        sys.exit(main(orders_))
