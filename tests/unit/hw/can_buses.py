"""CAN buses that are pairs of local sockets: frames of SocketCAN, and the lines of an adapter."""

import ctypes
import errno
import os
import pty
import socket
import struct
import time
import tty

from hw.can import raw, slcan, steady_cycle
from hw.can.bus import EXTENDED
from hw.system_calls import FAILED
from tests.bench.io_slcan import waiting

HEAD = struct.Struct("=IBB2x")


class PlainCalls:
    """`hw.system_calls` for where nothing is compiled."""

    error = 0

    def _tried(self, call, *arguments):
        try:
            return call(*arguments)
        except BlockingIOError:
            return 0
        except OSError as error:
            self.error = error.errno
            return FAILED

    def receive_many(self, fd, messages_at, most):
        n = ctypes.CDLL(None, use_errno=True).recvmmsg(
            int(fd), ctypes.c_void_p(int(messages_at)), most, 0x40, None
        )
        self.error = ctypes.get_errno()
        return n if n >= 0 else 0 if self.error == errno.EAGAIN else FAILED

    def read_some(self, fd, into):
        try:
            return os.readv(int(fd), [memoryview(into)]) or FAILED
        except BlockingIOError:
            return 0

    def write_all(self, fd, packet, size):
        n = self._tried(os.write, int(fd), packet[:size].tobytes())
        return n if n == FAILED else int(n == size)

    def last_error(self):
        return self.error

    def put(self, monkeypatch):
        for name in ("receive_many", "read_some", "write_all", "last_error"):
            monkeypatch.setattr(steady_cycle, name, getattr(self, name))


class LineBus(slcan.SlcanBus):
    """The slcan reader's code on a pty, whose other end speaks for the bus; the adapter tells of every frame
    it has sent.
    """

    def __init__(self, _fd):
        self.far, self.slave = pty.openpty()
        for end in (self.far, self.slave):
            tty.setraw(end)
        os.set_blocking(self.far, False)
        self.pump, self.read_so_far, self.tells = None, b"", True
        super().__init__({"channel": os.ttyname(self.slave), "bitrate": 1_000_000, "arguments": {}})

    def _command(self, command, seconds):
        return b""

    def receive(self):
        if self.pump is not None:
            self.pump()
        return super().receive()

    def _put(self, line):
        before = waiting(self.fileno())
        os.write(self.far, line)
        deadline = time.monotonic() + 30.0
        while waiting(self.fileno()) < before + len(line):
            assert time.monotonic() < deadline

    def give(self, can_id, data):
        extended = bool(can_id & EXTENDED)
        head = b"T%08X" % (can_id & 0x1FFF_FFFF) if extended else b"t%03x" % can_id
        self._put(b"%s%d%s\r" % (head, len(data), data.hex().encode()))

    def sent(self):
        time.sleep(0)
        try:
            while True:
                self.read_so_far += os.read(self.far, 4096)
        except BlockingIOError:
            pass
        *lines, self.read_so_far = self.read_so_far.split(b"\r")
        frames = [slcan.parse(line) for line in lines if line != b"C"]
        if frames and self.tells:
            self._put(b"z\r" * len(frames))
        return frames

    def close(self):
        super().close()
        for end in (self.far, self.slave):
            os.close(end)


class PairBus(raw.RawBus):
    """The raw socket's code on one end of a pair of local sockets that keep messages apart."""

    def __init__(self, fd):
        self.near, self.far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.far.setblocking(False)
        self.far.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 200_000)
        self.pump = None
        made = socket.socket
        raw.socket.socket = lambda *_: self.near
        try:
            super().__init__("pair", fd=fd)
        finally:
            raw.socket.socket = made

    def _configure(self):
        self._socket.setblocking(False)

    def subscribe(self, handlers):
        self._handlers = dict(handlers)

    def receive(self):
        if self.pump is not None:  # while it is opened
            self.pump()
        return super().receive()

    def give(self, can_id, data):
        self.far.send(HEAD.pack(can_id, len(data), 0) + data.ljust(64 if self._fd else 8, b"\0"))

    def sent(self):
        frames = []
        while True:
            try:
                frame = self.far.recv(128)
            except BlockingIOError:
                return frames
            can_id, length, _ = HEAD.unpack_from(frame)
            assert len(frame) == (72 if self._fd else 16)
            frames.append((can_id, frame[8 : 8 + length]))

    def close(self):
        super().close()
        self.far.close()
