"""Simulated boards for the contract suite: one process per row, powered up anew for every test."""

import fcntl
import json
import select
import struct
import termios

import pytest
from nursery import Program
from simulated_board import PATIENCE_S, SimulatedBoard

from hw.serial import frame_backend as serial_backend

_BOARDS = {}

AXES = ("[[axis]]\nlever_m = [0.0, 0.1, 0.0]\n", "[[axis]]\nlever_m = [0.0, 0.0, 0.1]\n")
MOVING = """
[[device]]
kind = "mock"
[[device.options.hand]]
kind = "sine"
start_s = 0.0
"""


def _numbers(n_axes, *fields):
    """Fields one after the other from byte 4 on, each once per axis; and the byte after them."""
    out, at = [], 4
    for field in fields:
        for axis in range(n_axes):
            out.append({**field, "axis": axis, "offset": at})
            at += 4
    return out, at


def described(n_axes):
    """Frames of a board of many axes: 32-bit numbers, big endian, CRC-16 of Modbus; without the port."""
    position = {"channel": "position", "type": "i32", "unit": "counts"}
    current = {"channel": "current", "type": "i32", "unit": "mA", "scale": 0.001}
    velocity = {"channel": "velocity", "type": "i32", "unit": "counts/s", "scale": 0.1}
    sample, end = _numbers(n_axes, position, current, velocity)
    sample += [
        {"channel": "force", "type": "i16", "component": k, "offset": end + 2 * k, "scale": 5.0, "unit": "mN"}
        for k in range(3)
    ]
    sample += [
        {"channel": "sequence", "type": "u16", "offset": 2},
        {"channel": "estop", "type": "u8", "offset": end + 6, "mask": 1},
        {"channel": "fault", "type": "u8", "offset": end + 6, "mask": 128},
        {"channel": "identity", "type": "u8", "offset": end + 7},
    ]
    commands, stop = _numbers(n_axes, {"channel": "current_command", "type": "f32", "unit": "A"})
    commands += [{"channel": "enable", "type": "u8", "offset": 3, "mask": 1}]
    common = {"endian": "big", "checksum": "crc16-modbus"}
    return {
        "sample": {"sync": [0xA5, 0x5A], "length": end + 10, "field": sample, **common},
        "command": {"sync": [0x5A, 0xA5], "length": stop + 2, "field": commands, **common},
    }


def described_bytes(n_axes):
    """Length of a sample frame."""
    return described(n_axes)["sample"]["length"]


def lines(n_axes):
    """Lines of text of a board of many axes; without the port."""
    units = {"position": "rad", "current": "A", "velocity": "rad/s"}
    fields = [
        {"channel": channel, "axis": axis, "unit": unit}
        for channel, unit in units.items()
        for axis in range(n_axes)
    ]
    fields += [{"channel": "force", "component": k, "unit": "N"} for k in range(3)]
    fields += [{"channel": "sequence"}, {"channel": "estop", "mask": 1}, {"channel": "fault", "mask": 1}]
    numbers = [{**field, "column": k} for k, field in enumerate(fields)]
    exact = [{**one, "decimals": 9} if "unit" in one else one for one in numbers]
    wanted = [
        {"channel": "current_command", "axis": axis, "prefix": " C", "unit": "A", "decimals": 9}
        for axis in range(n_axes)
    ]
    return {
        "sample": {"separator": ";", "columns": len(fields), "checksum": "nmea", "field": exact},
        "command": {"time_to_live_ms": 10.0, "checksum": "nmea", "field": wanted},
    }


def lines_bytes(n_axes):
    """Less than a line has; the board writes a line at once."""
    return 2 * lines(n_axes)["sample"]["columns"]


def lines_board(n_axes, make_folder, which="first"):
    """A board that speaks `lines(n_axes)`, just powered up and plugged in."""
    return _describing("serial-lines", lines(n_axes), n_axes, make_folder, which)


def _device(kind, tables):
    lines = ["[[device]]", f'kind = "{kind}"', "[device.options]", 'port = "/dev/none"']
    for name, table in tables.items():
        lines.append(f"[device.options.{name}]")
        for key, value in table.items():
            if key == "field":
                rows = ", ".join(
                    "{" + ", ".join(f"{k} = {json.dumps(v)}" for k, v in field.items()) + "}"
                    for field in value
                )
                lines.append(f"field = [{rows}]")
            else:
                lines.append(f"{key} = {json.dumps(value)}")
    return "\n".join(lines) + "\n"


def described_board(n_axes, make_folder, which="first"):
    """A board that speaks `described(n_axes)`, just powered up and plugged in."""
    return _describing("serial-described", described(n_axes), n_axes, make_folder, which)


def _describing(kind, tables, n_axes, make_folder, which):
    folder = make_folder(kind)
    (folder / "frame.toml").write_text(_device(kind, tables))
    speaks = ("--described", str(folder / "frame.toml"))
    found = board(n_axes, lambda _: folder, f"{kind} {which}", *speaks, velocity=True)
    found.order("identity 1")
    return found


def board(n_axes, make_folder, which="first", *arguments, velocity=False):
    """The board of this many axes, in lockstep with its host; just powered up and plugged in."""
    key = (n_axes, which, velocity)
    if key not in _BOARDS:
        folder = make_folder("board")
        rig = folder / "rig.toml"
        rig.write_text("".join(AXES[:n_axes]) + MOVING + ("[device.options.velocity]\n" if velocity else ""))
        _BOARDS[key] = SimulatedBoard(folder, "--step", "--rig", str(rig), *arguments, popen=Program)
    found = _BOARDS[key]
    found.order("plug")
    found.order("reset")
    return found


def at_port(port):
    """The board behind a port."""
    return next(found for found in _BOARDS.values() if found.port == port)


def close_all():
    while _BOARDS:
        _BOARDS.popitem()[1].close()


class InLockstep:
    """A serial backend whose `read` first waits for the answer to the command before: for tests in step."""

    def __init__(self, backend, answer_bytes, board=None, samples=1):
        self._backend, self._answer_bytes, self._awaited = backend, answer_bytes, False
        if board is not None:  # a described board sends nothing unasked, and cannot be asked
            self._greet, backend._greet = backend._greet, self._have_it_send
            self._board, self._samples = board, samples

    def _have_it_send(self, port):
        for _ in range(self._samples):
            self._board.order("sample")
        self._greet(port)

    def __getattr__(self, name):
        return getattr(self._backend, name)

    def open(self):
        """Asks the board once: a second answer to a slow first one would be taken for that of a command."""
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(serial_backend, "ASK_AGAIN_S", 1e6)
            self._backend.open()
        self._awaited = not self._backend.sample_waits

    def read(self, tick):
        self.wait_if_asked()
        self._backend.read(tick)

    def wait_if_asked(self):
        if self._awaited:
            self.wait()
        self._awaited = False

    def write(self, tick):
        self._backend.write(tick)
        self._awaited = True

    def wait(self):
        fd = self._backend.fileno()
        while struct.unpack("i", fcntl.ioctl(fd, termios.FIONREAD, b"\0\0\0\0"))[0] < self._answer_bytes:
            assert select.select([fd], [], [], PATIENCE_S)[0], "no answer"
