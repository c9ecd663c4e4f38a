"""Force sensors played by the test: they speak their published protocols on a pty or a loopback socket."""

from __future__ import annotations

import os
import pty
import select
import socket
import tty

from patience import until

from hw.force import optoforce, rdt, rokubi
from tests.bench.io_slcan import waiting

WAIT_S = 60.0


def force_of(k):
    """The k-th sample's force, N."""
    return (0.5 * k, -0.25 * k, 1.0 + k)


class PtySensor:
    """A sensor on a pseudo-terminal."""

    shown = None
    """The force that every sample has, N, in place of one that changes."""

    def __init__(self):
        self.master, slave = pty.openpty()
        tty.setraw(slave)
        self.path = os.ttyname(slave)
        self._slave = slave
        self.k = self._sent = 0
        os.set_blocking(self.master, False)

    @property
    def where(self):
        return {"port": self.path, "open_timeout_s": 0.0}

    def write(self, data):
        sent = 0
        while sent < len(data):
            sent += os.write(self.master, data[sent:])
        self._sent += sent

    def heard(self):
        """Everything the host has sent so far."""
        if not select.select([self.master], [], [], WAIT_S)[0]:
            return b""
        return os.read(self.master, 4096)

    def arrived(self, backend):
        """Wait until all that was written since can be read: a pty delivers a little later, and in parts."""
        until(lambda: waiting(backend._port.fd) >= self._sent, "what was written")
        self._sent = 0

    def emit(self, backend):
        self.k += 1
        self.write(self.frame(self.k, force=self.shown))
        self.arrived(backend)

    def unplug(self):
        self.close()

    def close(self):
        for name in ("master", "_slave"):
            fd = getattr(self, name)
            if fd >= 0:
                os.close(fd)
                setattr(self, name, -1)


class Rokubi(PtySensor):
    kind = "rokubi"
    options = {}

    @staticmethod
    def frame(k, status=0, force=None):
        return rokubi.encode(force or force_of(k), stamp_us=1000 * k, status=status)


class OptoForce(PtySensor):
    kind = "optoforce"
    options = {"counts_per_n": [100.0, 100.0, 50.0]}

    @staticmethod
    def frame(k, status=0, force=None):
        x, y, z = force or force_of(k)
        return optoforce.encode(
            "3-axis", [round(100 * x), round(100 * y), round(50 * z)], count=k, status=status
        )


class Rdt:
    kind = "rdt"
    shown = None
    options = {"counts_per_n": 1e6}

    def __init__(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(WAIT_S)
        self.host = None
        self.k = 0

    @property
    def where(self):
        return {"host": "127.0.0.1", "port": self.socket.getsockname()[1], "open_timeout_s": 0.0}

    def heard(self):
        """The next command, and remember who asked."""
        datagram, self.host = self.socket.recvfrom(64)
        return rdt.command_of(datagram)

    @staticmethod
    def frame(k, status=0, number=None, force=None):
        x, y, z = force or force_of(k)
        counts = (round(1e6 * x), round(1e6 * y), round(1e6 * z))
        return rdt.encode(k if number is None else number, 7 * k, counts, status)

    def write(self, datagram):
        if self.host is None:
            assert self.heard() == rdt.START_REALTIME
        self.socket.sendto(datagram, self.host)

    def arrived(self, backend):
        assert select.select([backend._socket], [], [], WAIT_S)[0]

    def emit(self, backend):
        self.k += 1
        self.write(self.frame(self.k, force=self.shown))
        self.arrived(backend)

    def unplug(self):
        self.close()

    def close(self):
        self.socket.close()


SENSORS = {sensor.kind: sensor for sensor in (Rokubi, OptoForce, Rdt)}

_played = []


def play(kind):
    """A new device of this kind; `close_all` ends it."""
    _played.append(SENSORS[kind]())
    return _played[-1]


def newest():
    return _played[-1]


def close_all():
    while _played:
        _played.pop().close()
