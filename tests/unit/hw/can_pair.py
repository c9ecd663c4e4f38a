"""A CAN device whose bus is a pair of local sockets, with a simulated one at the other end: time passes only
when told.
"""

import copy
import math
import struct

import numpy as np
from can_buses import PairBus, PlainCalls

from hw import registry
from hw.can.board_options import BoardOptions
from hw.can.bus import EXTENDED
from hw.can.fields import CHECKSUMS
from hw.entry_points import call_for_int, entry_point
from hw.jit import JIT_DISABLED, compiled
from hw.simulators.can_device import make_drives
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import shipped_config
from rtctl.tick import new_ticks


@compiled
def _go(at, arguments):
    return call_for_int(at, arguments)


def run(half, arguments):
    """One half of a compiled cycle; as plain Python where nothing is compiled."""
    return half(*arguments) if JIT_DISABLED else _go(entry_point(half, *arguments), arguments)


class Talker:
    """A board with numbers of every kind: random ones, some damaged, repeated, foreign or not finite."""

    def __init__(self, checksum, seed=3):
        self.checksum, self.rng, self.count, self.angle = checksum, np.random.default_rng(seed), 0, 0.0

    def options(self):
        """Of the rig file's device."""
        told = [
            {"channel": "position", "byte": 1, "bits": 16, "unit": "deg", "wrap_at": 360.0, "scale": 0.01},
            {"channel": "current", "start_bit": 27, "bits": 5, "type": "int", "unit": "mA",
                "saturates": True},
            {"channel": "temperature", "start_bit": 39, "bits": 11, "order": "big", "scale": 0.1,
                "unit": "degC"},
            {"channel": "fault", "start_bit": 49, "bits": 1},
            {"channel": "estop", "start_bit": 50, "bits": 1},
        ]  # fmt: skip
        wide = [
            {"channel": "velocity", "start_bit": 8, "bits": 64, "type": "float", "unit": "rpm"},
            {"channel": "force", "axis": 1, "start_bit": 75, "bits": 64, "unit": "mN", "scale": 1e-9},
            {"channel": "force", "axis": 2, "byte": 24, "bits": 32, "type": "float", "order": "big",
                "unit": "N"},
            {"channel": "enabled", "byte": 30, "bits": 8},
        ]  # fmt: skip
        amperes = {"channel": "current_command", "bits": 16, "type": "int", "unit": "mA", "limit": 5.0}
        orders = [
            {**amperes, "byte": 0, "order": "big"},
            {"channel": "torque", "byte": 2, "bits": 32, "type": "float", "unit": "Nm", "limit": 2.0},
            {"channel": "torque", "start_bit": 51, "bits": 12, "unit": "mNm", "offset": -2000.0,
                "limit": 1.5},
            {"channel": "torque", "byte": 8, "bits": 64, "type": "float", "order": "big", "unit": "mNm"},
            {"channel": "enable", "byte": 16, "bits": 8},
            {"channel": "counter", "byte": 17, "bits": 3},
            {"channel": "constant", "byte": 18, "bits": 8, "value": 90},
        ]  # fmt: skip
        seven = {"byte": 0, "bits": 8, "value": 7}
        counted = {"counter": {"byte": 7, "bits": 4}, "checksum": {"kind": self.checksum, "byte": 9}}
        options = {
            "bus": {"channel": "can0", "fd": True},
            "receive": [
                {"id": 0x10, "length": 12, "select": [seven], **counted, "field": told},
                {"id": 0x11, "extended": True, "length": 32, "required": False, "field": wide},
            ],
            "send": [
                {"id": 0x20, "length": 24, "checksum": {"kind": self.checksum, "byte": 20}, "field": orders},
                {"id": 0x21, "enter": [1] * 8, "idle": [2] * 8, "field": [{**amperes, "byte": 0}]},
            ],
            "poll": [{"id": 0x30, "extended": True, "data": [1, 2]}],
        }
        return BoardOptions.model_validate(options).model_dump(mode="json")

    def frame(self, _can_id, _data):
        """It answers nothing."""
        return []

    def pass_time(self, *_):
        """Its frames of one cycle."""
        rng = self.rng
        self.count += int(rng.random() < 0.9)
        self.angle = (self.angle + 30.0 * rng.random()) % 360.0
        raw = 64_000 if rng.random() < 0.05 else round(100 * self.angle)
        body = struct.pack(
            "<BHHHB", 7 if rng.random() < 0.8 else 8, raw, *rng.integers(0, 0x10000, 2), self.count & 0xF
        )
        data = bytearray(body + b"\0" + bytes(3))
        size = 2 if self.checksum == "sum16" else 1
        data[9 : 9 + size] = CHECKSUMS[self.checksum](bytes(data[:9] + data[9 + size :])).to_bytes(
            size, "big"
        )
        data[0] ^= 2 * int(rng.random() < 0.05)
        speed = struct.pack("<Bd", 0, float(rng.normal()) if rng.random() < 0.9 else math.nan)
        wide = speed + rng.bytes(15) + struct.pack(">f", rng.normal()) + bytes(2) + bytes([self.drives, 0])
        frames = [(0x10, bytes(data)), (0x11 | EXTENDED, wide)]
        return frames[: 1 + int(rng.random() < 0.5)]

    @property
    def drives(self):
        """What it says of its power stage."""
        return int(self.count % 200 > 20)


class Paired:
    """The device of a rig file on a pair, opened, and its simulated counterpart; `compiled_half`: cycles are
    compiled where they can be.
    """

    def __init__(self, monkeypatch, rig_file, kind, *, compiled_half, bus=PairBus, talker=None, change=None):
        if JIT_DISABLED:
            PlainCalls().put(monkeypatch)
        loaded = load(shipped_config(rig_file))
        (member,) = loaded.members()
        options = copy.deepcopy(member.options) if talker is None else talker.options()
        if change is not None:
            change(options)
        hardware = loaded.config.hardware()
        (self.sim,) = make_drives(kind, [1]) if talker is None else [talker]
        self.bus = bus(bool(options["bus"]["fd"]))
        self.bus.pump = self.answer
        monkeypatch.setattr("hw.can.backend.open_bus", lambda _options: self.bus)
        monkeypatch.setattr("hw.can.cia402_setup.configure", lambda *_: (1.0, 2.0, b"who"))
        if kind == "cia402":
            self.sim.objects.update(
                {(0x6060, 0): 10, (0x1A01, 1): 0x606C_0020, (0x1801, 1): 0x281, (0x1017, 0): 7}
            )
        self.backend = registry.create(member.kind, options, hardware)
        self.backend.open()
        self.tick = new_ticks(1, 1)
        self.backend.warm_up(self.tick)
        self.answer()
        self.bus.pump = None
        self.now_s, self.left = 0.0, {"read": 0, "write": 0}
        self.parts = self.backend.compiled_cycle(self.tick) if compiled_half else None

    def answer(self):
        """The simulated device takes what was sent; its answers wait."""
        frames = self.bus.sent()
        answers = self.sim.pass_time(1e-3, 0.0, 0.0, 0.0) if self.bus.pump is not None else []
        for can_id, data in frames:
            answers += self.sim.frame(can_id, data)
        for can_id, data in answers:
            self.bus.give(can_id, data)
        return frames

    def step(self, name):
        """One half of a cycle, in compiled code if it does all of it."""
        parts = self.parts
        if parts is not None and run(getattr(parts, name), getattr(parts, f"{name}_arguments")) == 0:
            return
        self.left[name] += 1
        getattr(self.backend, name)(self.tick)

    def cycle(self, *, enabled=0, current_a=0.0, more=(), torque_nm=0.0):
        """One cycle; returns the tick as read and the frames sent."""
        self.now_s += 1e-3
        turns = 3.0 * math.sin(2.0 * self.now_s) + 0.7 * math.sin(90.0 * self.now_s)
        for can_id, data in self.sim.pass_time(1e-3, turns, 6.0 * math.cos(2.0 * self.now_s), 0.1 * turns):
            self.bus.give(can_id, data)
        for can_id, data in more:
            self.bus.give(can_id, data)
        self.tick["tick"] += 1
        self.step("read")
        seen = self.tick.copy()
        self.tick["enabled"], self.tick["current_command_a"] = enabled, current_a
        self.tick["torque_applied_nm"] = torque_nm
        self.step("write")
        return seen, self.answer()

    def close(self):
        self.backend.close()


def noise(rng, known):
    """Frames that come besides: now and then damaged ones of the device, and foreign ones."""
    if rng.random() < 0.8:
        return []
    can_id = int(rng.choice(known)) if rng.random() < 0.5 else int(rng.integers(1, 0x700))
    data = rng.bytes(int(rng.choice([0, 4, 7, 8, 8])))
    return [(can_id & ~EXTENDED if can_id < 0x800 else can_id, data)]


def identifiers(bus):
    return np.array(sorted(bus._handlers))


KINDS = [
    ("can-odrive.toml", "odrive"),
    ("can-cia402.toml", "cia402"),
    ("can-moteus.toml", "moteus"),
    ("can-board.toml", "can"),
    ("can-mit.toml", "mit"),
    ("can-vesc.toml", "vesc"),
]


def settled(pair, *names, enabled=1, **more):
    """A device in whose cycles Python is not needed, armed."""
    device = pair(*names, **more)
    for _ in range(20):
        device.cycle(enabled=enabled)
    device.left = {"read": 0, "write": 0}
    return device
