"""Simulated boards for the contract suite: one process per row, powered up anew for every test."""

import fcntl
import select
import struct
import termios

from hw.serial.simulated_board import SimulatedBoard

_BOARDS = {}

AXES = ("[[axis]]\nlever_m = [0.0, 0.1, 0.0]\n", "[[axis]]\nlever_m = [0.0, 0.0, 0.1]\n")
MOVING = """
[[device]]
kind = "mock"
[[device.options.hand]]
kind = "sine"
start_s = 0.0
"""


def board(n_axes, make_folder, which="first", *arguments):
    """The board of this many axes, in lockstep with its host; just powered up and plugged in."""
    key = (n_axes, which, arguments)
    if key not in _BOARDS:
        folder = make_folder("board")
        rig = folder / "rig.toml"
        rig.write_text("".join(AXES[:n_axes]) + MOVING)
        _BOARDS[key] = SimulatedBoard(folder, "--step", "--rig", str(rig), *arguments)
    found = _BOARDS[key]
    found.order("plug")
    found.order("reset")
    return found


def close_all():
    while _BOARDS:
        _BOARDS.popitem()[1].close()


class InLockstep:
    """A serial backend whose `read` first waits for the answer to the command before: for tests in step."""

    def __init__(self, backend, answer_bytes):
        self._backend, self._answer_bytes, self._awaited = backend, answer_bytes, False

    def __getattr__(self, name):
        return getattr(self._backend, name)

    def open(self):
        self._backend.open()
        self._awaited = not self._backend.sample_waits

    def read(self, tick):
        if self._awaited:
            self.wait()
        self._awaited = False
        self._backend.read(tick)

    def write(self, tick):
        self._backend.write(tick)
        self._awaited = True

    def wait(self):
        fd = self._backend.fileno()
        while struct.unpack("i", fcntl.ioctl(fd, termios.FIONREAD, b"\0\0\0\0"))[0] < self._answer_bytes:
            assert select.select([fd], [], [], 10.0)[0], "no answer"
