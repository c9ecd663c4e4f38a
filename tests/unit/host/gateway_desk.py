"""A gateway that is served by hand, in the test's own process: no loop, one row of a tick, and sockets of
clients.
"""

import time

import zmq
from patience import until

from rtctl.host.exchange.gateway import Gateway
from rtctl.rt.shared_memory import CommandWriter, Memory
from rtctl.tick import new_ticks
from rtctl.wire.protocol import Endpoints


class GatewayDesk:
    """The gateway of `rig`, whose newest tick is in this state; `more` is for the gateway."""

    def __init__(self, folder, rig, state, **more):
        self.context = zmq.Context()
        self.endpoints = Endpoints(f"ipc://{folder}/t", f"ipc://{folder}/c", f"ipc://{folder}/x")
        self.memory = Memory.create(1, 8, 1_000_000)
        self.writer = CommandWriter(self.memory)
        self.row = new_ticks(1, 1)
        self.row["state"], self.row["epoch"] = state, 3
        self.gateway = Gateway(self.context, self.endpoints, self.writer, rig, self.newest, **more)
        self.gateway._requests._desk._clock_s = lambda: 0.0  # a loaded machine is no silent renderer
        self.poller = zmq.Poller()
        self.gateway.register(self.poller)
        self.sockets = []

    def open(self, name="command", kind=zmq.DEALER, **options):
        """A client's socket, connected to this endpoint."""
        socket = self.context.socket(kind)
        socket.setsockopt(zmq.LINGER, 0)
        for option, value in options.items():
            socket.setsockopt(getattr(zmq, option), value)
        socket.connect(getattr(self.endpoints, name))
        self.sockets.append(socket)
        return socket

    def newest(self):
        """The row, as the loop has just made it: however long this machine stood still."""
        self.row["time_ns"] = time.monotonic_ns()
        return self.row

    def turn(self):
        """Serve what has come in within 20 ms."""
        self.poller.poll(20)
        self.gateway.serve()

    def until_received(self, counters, received, what):
        """Serve until `counters` say that just so many have come in."""
        until(lambda: self.turn() or counters.received >= received, what)
        assert counters.received == received

    def close(self):
        for socket in self.sockets:
            socket.close(linger=0)
        self.gateway.close()
        self.context.term()
        self.memory.close()
