"""A CAN board of some fields, on a bus that only remembers."""

import struct
from types import SimpleNamespace

import numpy as np

from hw.can.board_backend import BoardBackend
from hw.can.board_options import BoardOptions
from hw.can.fields import CHECKSUMS
from hw.can.health import BusHealth
from hw.interface import Rig
from rtctl.tick import new_ticks

RIG = Rig(1, 1e-3, np.full(1, 10.0), np.full(1, 0.8), np.full(1, 0.05), np.full(1, 4096.0), np.eye(3)[:1])


SENSED = {
    "id": 0x101,
    "counter": {"byte": 6, "bits": 8},
    "checksum": {"kind": "xor8", "byte": 7},
    "field": [
        {"channel": "position", "byte": 0, "bits": 16, "wrap": True, "unit": "count"},
        {"channel": "current", "byte": 2, "bits": 16, "type": "int", "unit": "mA"},
        {"channel": "estop", "byte": 4, "bits": 8},
        {"channel": "fault", "byte": 5, "bits": 8},
    ],
}


FORCE = {
    "id": 0x1FFF0,
    "extended": True,
    "required": False,
    "length": 4,
    "field": [{"channel": "force", "axis": 2, "byte": 0, "bits": 32, "type": "float", "unit": "N"}],
}


SENT = {
    "id": 0x200,
    "length": 8,
    "checksum": {"kind": "sum8", "byte": 7},
    "field": [
        {"channel": "current_command", "byte": 0, "bits": 16, "type": "int", "unit": "mA", "limit": 5.0},
        {"channel": "torque", "byte": 2, "bits": 16, "type": "int", "unit": "mNm", "limit": 2.0},
        {"channel": "enable", "byte": 4, "bits": 8},
        {"channel": "counter", "byte": 5, "bits": 2},
        {"channel": "constant", "byte": 6, "bits": 8, "value": 0x5A},
    ],
}


class Bus:
    """Remembers what was sent; `answer(how many were sent)` gives the frames of the next `receive`."""

    def __init__(self, answer):
        self.sent, self.answer, self.handlers, self.health = [], answer, {}, BusHealth()

    def outgoing(self, can_id, length):
        return SimpleNamespace(id=can_id, buffer=bytearray(length), offset=0, length=length)

    def send(self, frame):
        self.sent.append(bytes(frame.buffer))
        return True

    def receive(self):
        for can_id, data in self.answer(len(self.sent)):
            self.handlers[can_id](data, 0, len(data))
        return True

    def subscribe(self, handlers):
        self.handlers = dict(handlers)

    def discard(self):
        pass

    def close(self):
        pass


def sensed(count, *, counts=0, milliamps=0, estop=0, fault=0):
    body = struct.pack("<HhBBB", counts, milliamps, estop, fault, count & 0xFF)
    return 0x101, body + bytes([CHECKSUMS["xor8"](body)])


def opened(monkeypatch, answer=None, **more):
    options = {"bus": {"channel": "can0"}, "receive": [SENSED, FORCE], "send": [SENT], **more}
    backend = BoardBackend(BoardOptions.model_validate(options).model_dump(mode="json"), RIG)
    bus = Bus(answer or (lambda n: [sensed(n // 5)]))  # opening sends five frames at a time, as a stop
    monkeypatch.setattr("hw.can.backend.open_bus", lambda _options: bus)
    backend.open()
    tick = new_ticks(1, 1)
    backend.warm_up(tick)
    return backend, bus, tick
