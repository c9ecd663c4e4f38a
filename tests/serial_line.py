"""A pty with the backend of a serial board at one end; the test plays the board at the other."""

import os
import pty
import struct
import termios
import tty
from fcntl import ioctl

import numpy as np
from patience import until

from hw.interface import Rig
from hw.serial.frame_backend import SerialBackend
from hw.serial.options import SerialOptions
from rtctl.tick import new_ticks


def waiting(fd):
    """Bytes that are there to be read."""
    return struct.unpack("i", ioctl(fd, termios.FIONREAD, bytes(4)))[0]


class SerialLine:
    """The backend is open, and its board was not asked who it is; `counts` of the encoder a turn."""

    def __init__(self, counts):
        self.far, self.near = pty.openpty()
        for fd in (self.far, self.near):
            tty.setraw(fd)
        os.set_blocking(self.far, False)
        one = np.ones(1)
        options = SerialOptions.model_validate({"port": os.ttyname(self.near), "baud": 921_600})
        rig = Rig(1, 1e-3, one, one, 0.05 * one, counts * one, np.eye(3)[:1])
        self.backend = SerialBackend(options.model_dump(mode="json"), rig)
        self.backend._greet = lambda _port: None
        self.backend.open()
        self.tick = new_ticks(1, 1)
        self.backend.warm_up(self.tick)

    def arrive(self, data):
        """Sent, and there to be read: a loaded machine hands on what was written to a pty in parts, and only
        later.
        """
        os.write(self.far, data)
        until(lambda: waiting(self.near) >= len(data), "the bytes")

    def close(self):
        self.backend.close()
        for fd in (self.far, self.near):
            os.close(fd)
