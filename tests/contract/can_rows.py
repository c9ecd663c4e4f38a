"""CAN devices for the contract suite: each preset's options, and the simulated device on the other side.

By default both sit on python-can's `virtual` bus. RTCTL_CAN_WIRES names SocketCAN wires instead, each by the
interface of the backend and that of the device: `vcan0:vcan0,can0:can1`. `tests/system` runs the suite so.
"""

import itertools
import os
import time

import can

from hw.simulators.can_device import TORQUE_CONSTANT_NM_A, DriveSim, make_drives
from hw.simulators.can_plant import Inertia

WIRES = [tuple(wire.split(":")) for wire in os.environ.get("RTCTL_CAN_WIRES", "").split(",") if wire]
PERIOD_S = 1e-3
MARK_S, MARKS_MAX = 0.2, 100
"""How long a mark may take before another one is sent, and how often."""

_numbers = itertools.count()


def bus(wire, *, fd=False):
    if wire:
        return {"interface": "socketcan", "channel": wire[0], "fd": fd}
    return {"interface": "virtual", "channel": f"contract-{next(_numbers)}", "fd": fd}


def _axes(n_axes, **more):
    return [{"node": 1 + axis, **more} for axis in range(n_axes)]


def odrive(n_axes, wire):
    return {"bus": bus(wire), "heartbeat_ms": 10.0, "axis": _axes(n_axes)}


def odrive_request(n_axes, wire):
    return {**odrive(n_axes, wire), "feedback": "request"}


def moteus(n_axes, wire):
    return {"bus": bus(wire, fd=True), "axis": _axes(n_axes)}


def cia402(n_axes, wire):
    return {"bus": bus(wire), "axis": _axes(n_axes, velocity_units=65536.0)}


RECEIVE = {
    "id": 0x101,
    "counter": {"byte": 4, "bits": 8},
    "checksum": {"kind": "crc8_j1850", "byte": 7},
    "field": [
        {"channel": "position", "byte": 0, "bits": 16, "wrap": True, "unit": "turn", "scale": 1 / 4096 / 80},
        {"channel": "current", "byte": 2, "bits": 16, "type": "int", "unit": "mA"},
        {"channel": "estop", "start_bit": 40, "bits": 1},
    ],
}
SPEED = {
    "id": 0x102,
    "length": 4,
    "field": [
        {
            "channel": "velocity",
            "byte": 0,
            "bits": 32,
            "type": "int",
            "unit": "turn/s",
            "scale": 1e-3 / 4096 / 80,
        }
    ],
}
SEND = {
    "id": 0x200,
    "length": 4,
    "field": [
        {"channel": "current_command", "byte": 0, "bits": 16, "type": "int", "unit": "mA"},
        {"channel": "enable", "byte": 2, "bits": 8},
        {"channel": "counter", "byte": 3, "bits": 8},
    ],
}


def board(n_axes, wire):
    return {"bus": bus(wire), "receive": [RECEIVE, SPEED], "send": [SEND]}


class Marked:
    """The device's bus; a mark among its frames is noted and not handed on, and ends the reading."""

    MARK = 0x1FFF_FF00
    """Extended identifier of mark number 0; nothing else on the wire is sent so far behind."""

    def __init__(self, bus):
        self._bus, self.seen = bus, None

    def recv(self, timeout=None):
        message = self._bus.recv(timeout)
        if message is not None and message.is_extended_id and message.arbitration_id >= self.MARK:
            self.seen = message.arbitration_id
            return None
        return message

    def __getattr__(self, name):
        return getattr(self._bus, name)


class WithDevice:
    """A backend whose device lives in the test: it answers while the backend opens, then once per read.

    On a real wire a mark is sent behind the frames, and what comes before it has arrived.
    """

    def __init__(self, backend, options, sim_kind, n_axes, wire):
        self.backend, self.wire, table = backend, wire, options["bus"]
        self.provides, self.consumes = backend.provides, backend.consumes
        arguments = {"interface": table["interface"], "channel": wire[1] if wire else table["channel"]}
        more = {"fd": True} if table["fd"] else {}
        self.bus = Marked(can.Bus(**arguments, **more, ignore_config=True))
        # opened before the backend's socket: what it has received, the backend has
        self.witness = None
        if wire:
            self.witness = can.Bus(interface="socketcan", channel=wire[0], fd=table["fd"], ignore_config=True)
        drives = make_drives(sim_kind, range(1, n_axes + 1))
        self.sim = DriveSim(self.bus, drives, Inertia(n_axes, TORQUE_CONSTANT_NM_A), fd=table["fd"])
        self._marks = itertools.count()

    def open(self):
        self.sim.start()
        try:
            self.backend.open()
        finally:
            self.sim.stop()
        self.settle()

    def step(self):
        self.sim.advance(PERIOD_S)
        self.settle()

    def read(self, tick):
        self.step()
        self.backend.read(tick)

    def write(self, tick):
        self.backend.write(tick)

    def stop(self):
        self.backend.stop()

    def close(self):
        self.backend.close()

    def settle(self):
        """Have the device answer everything sent so far, and the answers arrive."""
        if self.witness is None:
            while self.sim.handle():
                pass
            return
        self._until_marked(self.witness, self.bus, lambda: self.sim.handle(MARK_S))
        ear = Marked(self.witness)
        self._until_marked(self.bus, ear, lambda: ear.recv(MARK_S))

    def _until_marked(self, mouth, ear, take_in):
        """Send a mark and take in what comes before it; an emulated controller may lose it, so it is sent
        again.
        """
        for _ in range(MARKS_MAX):
            mark = Marked.MARK + next(self._marks) % 256
            mouth.send(can.Message(arbitration_id=mark, is_extended_id=True))
            before = time.monotonic()
            while ear.seen != mark and time.monotonic() < before + MARK_S:
                take_in()
            if ear.seen == mark:
                return
        raise AssertionError(f"nothing arrives on {self.wire}")

    def release(self):
        self.backend.close()
        self.bus.shutdown()
        if self.witness is not None:
            self.witness.shutdown()

    def __getattr__(self, name):
        return getattr(self.backend, name)


def _row(kind, n_axes, table, sim_kind, wire):
    def beside(backend, options, n_axes):
        return WithDevice(backend, options, sim_kind, n_axes, wire)

    return kind, n_axes, lambda n_axes, folder: table(n_axes, wire), beside


_KINDS = {
    "odrive": ("odrive", 1, odrive, "odrive"),
    "odrive by request, two axes": ("odrive", 2, odrive_request, "odrive-request"),
    "moteus, two axes": ("moteus", 2, moteus, "moteus"),
    "cia402, two axes": ("cia402", 2, cia402, "cia402"),
    "can board": ("can", 1, board, "can"),
}

ROWS = {
    name + (f" on {wire[0]}" if wire else ""): _row(*row, wire)
    for wire in WIRES or [()]
    for name, row in _KINDS.items()
    if not (row[0] == "moteus" and wire and wire[0] != "vcan0")  # the emulated controllers know no CAN FD
}

KINDS = {row[0] for row in ROWS.values()}
