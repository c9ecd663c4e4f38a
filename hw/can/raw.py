"""SocketCAN without a library: one socket, one buffer, one system call for all frames that wait.

Measured beside python-can's socketcan bus on the same interface (`rtctl bench io`)."""

from __future__ import annotations

import errno
import os
import socket
import struct
from collections.abc import Mapping
from typing import TYPE_CHECKING

from hw.can.batch import FRAMES, STRIDE, Batch
from hw.can.bus import DRAIN_LIMIT, ERROR, EXTENDED, REMOTE, Handler
from hw.can.health import WANTED, BusHealth
from hw.interface import BackendError, LinkLost

if TYPE_CHECKING:
    from can import BusABC

# identifier, length; flags of FD and padding follow up to the data at byte 8
_HEAD = struct.Struct("=IB")  # struct can_frame is in the machine's own byte order
CAN_RAW_ERR_FILTER = 2  # linux/can/raw.h; the socket module has it, its stubs do not
_FD_BRS = 0x01  # send the data phase at the data bit rate
# sizeof(struct can_frame), sizeof(struct canfd_frame), offset of their data: both begin alike
CLASSIC_BYTES, FD_BYTES, DATA_AT = 16, 72, 8

# EAGAIN: the socket's own buffer is full; ENOBUFS: the queue of the interface is (10 frames by default)
_FULL = frozenset({errno.ENOBUFS, errno.EAGAIN})
_REMEDY = {
    errno.EAFNOSUPPORT: "this kernel has no CAN: 'sudo modprobe can_raw', or use a kernel built with "
    "CONFIG_CAN",
    errno.ENODEV: "there is no such interface: 'ip link show type can' lists them; plug the adapter in, "
    "load its driver",
    errno.ENETDOWN: "the interface is down: 'sudo ip link set {0} up type can bitrate 1000000 restart-ms "
    "100'",
    errno.EPERM: "not permitted: CAN sockets need no rights, but a sandbox may forbid the AF_CAN address "
    "family",
    errno.ENXIO: "the interface is gone: plug the adapter in again",
}


class RawFrame:
    """A frame as the kernel takes it."""

    __slots__ = ("buffer", "length", "offset")

    def __init__(self, can_id: int, length: int, *, fd: bool) -> None:
        self.buffer = bytearray(FD_BYTES if fd else CLASSIC_BYTES)
        self.offset, self.length = DATA_AT, length
        struct.pack_into("=IBB", self.buffer, 0, can_id, length, _FD_BRS if fd else 0)


def _text(channel: str, error: OSError) -> str:
    remedy = _REMEDY.get(error.errno or 0, "")
    return f"CAN interface {channel}: {error.strerror or error}" + (
        f"; {remedy.format(channel)}" if remedy else ""
    )


class RawBus:
    """One SocketCAN interface. Raises BackendError if it cannot be opened."""

    lines = False
    """See `SteadyBus`."""

    def __init__(self, channel: str, *, fd: bool) -> None:
        self.health = BusHealth()
        self._channel, self._fd = channel, fd
        # a look-up by identifier costs the same for one drive and for eight
        self._handlers: dict[int, Handler] = {}
        self._lost = ""
        try:
            self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        except OSError as error:
            raise BackendError(_text(channel, error)) from error
        try:
            self._configure()
        except OSError as error:
            self._socket.close()
            raise BackendError(_text(channel, error)) from error
        # the descriptor stays the same one for as long as this bus lives
        self._batch, self._send = Batch(self._socket.fileno()), self._socket.send
        self._kept, self._error = (0, 0), 0

    def _configure(self) -> None:
        option = self._socket.setsockopt
        self._socket.setblocking(False)
        # before bind: frames that come between the two would be taken by the default, which is all of them
        option(socket.SOL_CAN_RAW, CAN_RAW_ERR_FILTER, WANTED)
        option(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, b"")  # nothing until subscribe() asks for it
        if self._fd:
            # without it the kernel gives a socket no FD frame, and takes none
            option(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        self._socket.bind((self._channel,))
        # bind succeeds on an interface that is down, and every send would fail later, in the loop
        if not _is_up(self._socket, self._channel):
            raise OSError(errno.ENETDOWN, "network is down")

    def fileno(self) -> int:
        """Descriptor of the socket."""
        return self._socket.fileno()

    def use(self, batch: Batch) -> None:
        """See `SteadyBus`."""
        # the buffer is the compiled cycles' own: frames that they have not decoded are found there
        batch.aim(self._socket.fileno())
        self._batch = batch

    def packed(self, frame: RawFrame) -> bytes:
        """See `SteadyBus`."""
        return bytes(frame.buffer)

    def keep(self, begin: int, end: int, rest: bytes, error: int) -> None:
        """See `SteadyBus`; there are no bytes behind frames of a socket."""
        del rest
        self._kept, self._error = (begin, end), error

    def rest(self) -> bytes:
        """See `SteadyBus`."""
        return b""

    def _waiting(self) -> tuple[int, int]:
        """First and end of the frames to look at now. Raises OSError."""
        # SO_ERROR is cleared by whoever reads it; compiled code has read it
        if self._error:  # told once, to compiled code
            raise OSError(self._error, os.strerror(self._error))
        # those first, in their order: newer ones of the kernel would be overtaken by them
        kept, self._kept = self._kept, (0, 0)
        return kept if kept[0] < kept[1] else (0, self._batch.take())

    def subscribe(self, handlers: Mapping[int, Handler]) -> None:
        """Have `receive` call these; the kernel drops all other frames."""
        self._handlers = dict(handlers)
        # the flags too: else standard 0x10 would pass for extended 0x10
        mask = EXTENDED | REMOTE | 0x1FFF_FFFF
        packed = b"".join(struct.pack("=II", can_id, mask) for can_id in handlers)
        self._socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, packed)

    def receive(self) -> bool:
        """Hand every waiting frame to its handler. Raises LinkLost once the interface is down or gone."""
        handlers, head = self._handlers, _HEAD.unpack_from
        buffer = self._batch.buffer
        try:
            # bounded: a node that floods the bus must not keep the loop from sending its stop
            for _ in range(DRAIN_LIMIT // FRAMES):
                begin, n = self._waiting()
                for at in range(begin * STRIDE, n * STRIDE, STRIDE):
                    can_id, length = head(buffer, at)
                    handler = handlers.get(can_id)
                    if handler is not None:
                        handler(buffer, at + DATA_AT, length)
                    # behind the handlers: an error frame is rare, and no handler has its flag
                    elif can_id & ERROR:
                        data = buffer[at + DATA_AT : at + DATA_AT + length]
                        self.health.error_frame(can_id & ~ERROR, data)
                # one system call less: asking again only to hear that nothing waits
                if n < FRAMES:  # fewer than there is room for: nothing more waits
                    if self._lost:
                        raise LinkLost(self._lost)
                    return True
        except OSError as error:
            raise self._gone(error) from error
        return False

    def _gone(self, error: OSError) -> LinkLost:
        """Remember it: the kernel tells a socket only once."""
        self._lost = self._lost or _text(self._channel, error)
        return LinkLost(self._lost)

    def outgoing(self, can_id: int, length: int) -> RawFrame:
        """Make a frame that can be sent; its data is all zero."""
        return RawFrame(can_id, length, fd=self._fd)

    def send(self, frame: RawFrame) -> bool:
        """Queue a frame; False when the queue is full. Raises LinkLost."""
        try:
            if self._error:
                raise OSError(self._error, os.strerror(self._error))
            self._send(frame.buffer)
        except OSError as error:
            # no exception for the loop: the frame is lost, the next cycle has a newer one
            if error.errno in _FULL:
                self.health.refused()
                return False
            raise self._gone(error) from error
        # asked first: `taken` does work that an ordinary cycle need not
        if self.health.refused_in_a_row:
            self.health.taken()
        return True

    def discard(self) -> None:
        """Nothing: what was queued leaves in its order."""

    def fresh_python_can(self) -> BusABC:
        """A python-can bus on the same interface."""
        from hw.can.adapter import python_can

        bus: BusABC = python_can().Bus(
            interface="socketcan", channel=self._channel, fd=self._fd, ignore_config=True
        )
        return bus

    def release(self, bus: BusABC) -> None:
        """Close it."""
        bus.shutdown()

    def close(self) -> None:
        """Close the socket."""
        # before the socket: a number that is another file's by now must not be read from
        self._batch.close()
        self._socket.close()
        self._lost = self._lost or f"CAN interface {self._channel}: closed"


def _is_up(sock: socket.socket, channel: str) -> bool:
    import fcntl

    # the kernel's struct is 40 bytes on 64 bits: `fcntl.ioctl` hands it a buffer of its own, of 1024
    request = struct.pack("16sh14x", channel.encode(), 0)  # struct ifreq: name, flags
    flags: int = struct.unpack_from("16xh", fcntl.ioctl(sock.fileno(), 0x8913, request))[0]  # SIOCGIFFLAGS
    return bool(flags & 1)
