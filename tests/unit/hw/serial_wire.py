"""A backend of `rtctl-frame` that gets its bytes from the test instead of a port."""

import math

import numpy as np
from board_wire import BoardWire
from hardware import rig

from hw.serial.frame_backend import SerialBackend
from hw.serial.options import SerialOptions
from hw.simulators.serial_firmware import Board
from rtctl.control.jit import records
from rtctl.tick import new_ticks

COUNTS = 160_000


class Wire(BoardWire):
    """A backend that gets its bytes from the test instead of a port."""

    def __init__(self, n_axes=1, *, velocity=False, **options):
        valid = SerialOptions.model_validate({"port": "/dev/none", **options})
        self.backend = SerialBackend(valid.model_dump(mode="json"), rig(n_axes))
        counts_per_rad = np.full(n_axes, COUNTS / (2 * math.pi)) if velocity else None
        self.board = Board(n_axes, "SIM-0001", 1000, counts_per_rad)
        self.tick = records(new_ticks(1, n_axes))
        self.measured = records(new_ticks(1, n_axes))
        self.backend.warm_up(self.tick)
        self.time_us, self.counts = 0, np.zeros(n_axes, np.int64)
        self.feed(b"\0")

    def packet(self, step_us=1000):
        self.time_us += step_us
        return self.board.state_packet(self.measured, self.counts, self.time_us)
