"""A simulated board at a pty, the backend at its port, and a tick."""

import contextlib
import os

import serial_boards
from hardware import rig

from hw import registry
from rtctl.control.jit import records
from rtctl.tick import new_ticks

STATE_BYTES = 45


RIG = rig()


def backend_of(port, **options):
    model = registry.options_model("serial")
    valid = model.model_validate({"port": port, "open_timeout_s": 30.0, "reopen_timeout_s": 10.0, **options})
    return registry.create("serial", valid.model_dump(mode="json"), RIG)


class Bench:
    """A board, the backend at its port, and a tick."""

    def __init__(self, board):
        self.board, self.backend = board, backend_of(board.port)
        self.in_step = serial_boards.InLockstep(self.backend, STATE_BYTES)
        self.tick = records(new_ticks(1, 1))

    def cycle(self, enabled=1, current_a=0.5):
        self.in_step.read(self.tick)
        self.tick["enabled"], self.tick["current_command_a"] = enabled, current_a
        self.in_step.write(self.tick)

    def drive(self):
        """Open, and have the motor driven."""
        self.in_step.open()
        self.cycle(enabled=0)
        self.cycle()
        self.in_step.wait()
        assert self.motor["current_a"] == 0.5

    def cycles(self, n, **more):
        for _ in range(n):
            self.cycle(**more)

    def exchange(self, n):
        """`n` cycles that wait for nothing."""
        for _ in range(n):
            self.backend.read(self.tick)
            self.backend.write(self.tick)

    def flood(self):
        """Send into a line that is always full."""
        self.backend._port.discard_output = lambda: None
        for _ in range(1000):
            with contextlib.suppress(BlockingIOError):
                while True:
                    os.write(self.backend.fileno(), b"\x01" * 4096)
            self.backend.write(self.tick)

    @property
    def motor(self):
        """What the motor got last."""
        return self.board.observation.rows()[-1]


def replug(board):
    board.order("unplug")
    board.order("plug")


def with_chatter(backend, master):
    """The other side says something else, once the port is open and emptied."""
    greet = backend._greet

    def _greet(port):
        os.write(master, b"hello, I am a shell\r\n")
        greet(port)

    backend._greet = _greet
    return backend
