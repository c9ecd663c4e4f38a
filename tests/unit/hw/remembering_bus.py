"""A bus that only remembers, and the numbers of one axis on it."""

from types import SimpleNamespace

import numpy as np

from hw.interface import LinkFault, Rig

RIG = Rig(1, 1e-3, np.full(1, 10.0), np.full(1, 0.8), np.full(1, 0.05), np.full(1, 4096.0), np.eye(3)[:1])
AXIS = {
    "node": 5, "direction": 1, "shaft": "motor", "offset_rad": 0.0, "current_max_a": 20.0,
    "counts_per_turn": 4096.0,
    "rated_torque_nm": 1.0, "rated_current_a": 2.0, "velocity_units": 0.0,
}  # fmt: skip
OPTIONS = {"feedback": "request", "heartbeat_ms": 10.0, "source": 0, "time_to_live_ms": 10.0,
    "temperature_ms": 100.0,
           "feedback_ms": 1.0, "axis": [AXIS]}  # fmt: skip
DEVICE, LOST = int(LinkFault.DEVICE), int(LinkFault.LOST)


class Bus:
    """Remembers what was sent; `answer` is called at every `receive`."""

    def __init__(self, answer=lambda: None):
        self.sent, self.answer, self.handlers = [], answer, {}

    def outgoing(self, can_id, length):
        return SimpleNamespace(id=can_id, buffer=bytearray(length), offset=0, length=length)

    def send(self, frame):
        self.sent.append((frame.id, bytes(frame.buffer)))
        return True

    def receive(self):
        self.answer()
        return True

    def subscribe(self, handlers):
        self.handlers = handlers


def three_looks(bus, done, _seconds):
    """A wait that looks three times and gives up."""
    for _ in range(3):
        bus.receive()
    return done()
