"""Lets the makers' libraries read random frames, and writes digests of what they read to readings.json beside
this file.

    pip install -r tests/contract/makers/requirements.txt
    python tests/contract/makers/make_readings.py

What the libraries let pass and we do not is said where it is taken out: README.md has the list.
"""

import json
import struct
import types
from importlib import metadata
from pathlib import Path

import random_frames
from readings import NOTHING, TURN, digest, doubles, finite

OPTOFORCE_UNUSABLE = 0xE000 | 0x1C00 | 0x03F0
MONITOR, ERROR = 1 << 16, 1 << 31


def _plain_stream(base):
    """The library's reader of a frame, which notes what it passes over without a word: empty reads and
    writes, long counts.
    """

    class Plain(base):
        plain = True

        def read_int8(self):
            value, kind = super().read_int8() & 0xFF, type(self)
            if not getattr(self, "of_a_register", False):
                kind.plain &= 0x20 <= value <= 0x2F or value == 0x50
                self.counts = value & 3 == 0 and value != 0x50
            return (value ^ 0x80) - 0x80

        def read_varuint(self):
            before, value = self._offset, super().read_varuint()
            most = 1 if self.counts else 2
            type(self).plain &= self._offset - before <= most and not (self.counts and value > 64)
            self.counts = False
            return value

        def read_type(self, typecode):
            self.of_a_register = True
            value = super().read_type(typecode)
            self.of_a_register = False
            return value

    return Plain


def moteus_reader():
    from moteus import Register, multiplex

    end = (multiplex.SubframeType.RESPONSE, 0x7F, multiplex.INT8, 0x55)
    floats = [int(getattr(Register, name)) for name in ("POSITION", "VELOCITY", "Q_CURRENT", "TEMPERATURE")]
    mode, fault = int(Register.MODE), int(Register.FAULT)
    strict = multiplex.Stream = _plain_stream(multiplex.Stream)

    def _read(data):
        strict.plain, replies = True, []
        try:
            # a list of them all may take hours: READ of 2**35
            for one in multiplex.parse_frame(data + b"\x21\x7f\x55"):
                if one.type != multiplex.SubframeType.RESPONSE:
                    return NOTHING
                replies.append(one)
        except (RuntimeError, ValueError, struct.error):
            return NOTHING
        if not strict.plain or not replies or tuple(replies[-1]) != end:
            return NOTHING
        types_of = {one.register: one.resolution for one in replies}
        found = {one.register: one.value for one in replies}
        if not {mode, fault, *floats} <= set(types_of):
            return NOTHING
        if any(types_of[one] != multiplex.F32 for one in floats) or multiplex.F32 in (
            types_of[mode],
            types_of[fault],
        ):
            return NOTHING
        position, velocity, current, temperature = (found[one] for one in floats)
        if not finite(position, velocity, current, temperature):
            return NOTHING
        return doubles(TURN * position, TURN * velocity, current, temperature, found[mode], found[fault])

    return _read


def odrive_reader(version):
    import cantools

    folder = Path(metadata.distribution("odrive-can").locate_file("odrive_can/dbc"))
    base = cantools.database.load_file(folder / f"odrive-cansimple-{version}.dbc")
    known = {
        name: base.get_message_by_name(f"Axis0_{name}")
        for name in random_frames.ODRIVE
        if name != "Get_Temperature"
    }
    if version != "0.5.6":
        known["Get_Temperature"] = base.get_message_by_name("Axis0_Get_Temperature")

    def _read(frame):
        name, data = frame
        if name not in known or len(data) < (7 if name == "Heartbeat" else 8):
            return NOTHING
        read = known[name].decode(data, decode_choices=False, scaling=False, allow_truncated=True)
        if name == "Heartbeat":
            return doubles(read["Axis_Error"], read["Axis_State"])
        numbers = {
            "Get_Encoder_Estimates": lambda: (TURN * read["Pos_Estimate"], TURN * read["Vel_Estimate"]),
            "Get_Iq": lambda: (read["Iq_Measured"],),
            "Get_Temperature": lambda: (read["Motor_Temperature"], 0 * read["FET_Temperature"]),
        }[name]()
        return doubles(*numbers) if finite(*numbers) else NOTHING

    return _read


def optoforce_reader():
    from optoforce import reading

    scales = reading.FX_SCALE, reading.FY_SCALE, reading.FZ_SCALE
    read_of = {
        "3-axis": reading.read_16bytes,
        "6-axis": reading.read_22bytes,
        "4x3-axis": reading.read_34bytes,
    }

    def _read(frame):
        layout, data = frame
        n = random_frames.OPTOFORCE[layout]
        if data[:4] != bytes((0xAA, 0x07, 0x08, 2 * n + 4)):
            return NOTHING
        found = read_of[layout](data[:4], data[4:])
        if not found.valid_checksum or found.status & OPTOFORCE_UNUSABLE:
            return NOTHING
        counts = [round(value / scale) for value, scale in zip(found[2:5], scales, strict=True)]
        return doubles(*counts, *(found[5:8] if layout == "6-axis" else ()))

    return _read


def rdt_reader():
    import NetFT

    sensor, waiting = NetFT.Sensor.__new__(NetFT.Sensor), []
    sensor.mean, sensor.sock = [0] * 6, types.SimpleNamespace(recv=lambda size: waiting.pop())

    def _read(data):
        waiting.append(data)
        try:
            six = sensor.receive()
        except struct.error:
            return NOTHING
        status = struct.unpack_from(">I", data, 8)[0]  # which the library does not look at
        rest = status & ~MONITOR
        usable = rest == 0 or (rest == ERROR and status & MONITOR)
        return doubles(*six) if usable else NOTHING

    return _read


def main():
    readers = {
        "moteus": (moteus_reader(), "moteus"),
        "odrive 0.5.6": (odrive_reader("0.5.6"), "odrive"),
        "odrive 0.6.10": (odrive_reader("0.6.10"), "odrive"),
        "optoforce": (optoforce_reader(), "optoforce"),
        "rdt": (rdt_reader(), "rdt"),
    }
    found = {}
    for name, (read, kind) in readers.items():
        chunks = (
            [read(frame) for frame in random_frames.chunk(kind, k)] for k in range(random_frames.CHUNKS)
        )
        told = [(digest(readings), sum(one != NOTHING for one in readings)) for readings in chunks]
        found[name] = {"samples": sum(n for _, n in told), "digests": [one for one, _ in told]}
    packages = ("moteus", "odrive-can", "cantools", "optoforce", "NetFT")
    made = {"versions": {name: metadata.version(name) for name in packages}, "readings": found}
    Path(__file__).with_name("readings.json").write_text(json.dumps(made, indent=1) + "\n")


if __name__ == "__main__":
    main()
