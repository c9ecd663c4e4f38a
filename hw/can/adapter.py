"""Any interface python-can drives, behind the same five methods as the raw socket.

Its traps are dealt with here: filters stay off, because `recv(0)` gives None for a frame they drop though
a wanted one waits behind it; slcan's serial time-out of 1 ms is set to 0, and its acknowledge lines read
as None; a garbled line raises whatever its decoder stumbles over and counts as damaged; `serial` and
`seeedstudio` wait for their port whatever they are asked, so they are asked only when a frame's worth of
bytes is there."""

from __future__ import annotations

import errno
import queue
import select
import struct
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from hw.can.bus import DRAIN_LIMIT, EXTENDED, REMOTE, Handler
from hw.can.health import BusHealth
from hw.interface import BackendError, LinkLost, Options

if TYPE_CHECKING:
    from types import ModuleType

    from can import BusABC, Message

_FULL = frozenset({errno.ENOBUFS, errno.EAGAIN, errno.ETIMEDOUT})
_GARBLED = (ValueError, IndexError, TypeError, struct.error)

PORTS = {"serial": ("_ser", 11), "seeedstudio": ("ser", 5)}
"""Interfaces that ignore the time they may take: where their pyserial port is, and bytes of their shortest
frame."""

# ten bytes at 115,200 bit/s take .9 ms: a frame that has begun is there by then
REST_S, ROOM_S = 1e-3, 0.05
"""Longest waits on such a port, s: for the rest of a frame whose first bytes came; for room, which was looked
for before."""


def python_can() -> ModuleType:
    """The module `can`. Raises BackendError naming the extra to install."""
    try:
        import can
    except ModuleNotFoundError as error:
        raise BackendError("this CAN interface needs python-can: pip install 'rtctl[can]'") from error
    return can


def _arguments(options: Options) -> dict[str, Any]:
    """Arguments of `can.Bus`: the table's own keys, then what the interface needs, then what the user
    adds."""
    arguments: dict[str, Any] = {
        "interface": options["interface"],
        "channel": options["channel"],
        # else python-can reads ~/can.conf and /etc/can.conf, which no rig file tells of
        "ignore_config": True,
    }
    # socketcan's rate is set by `ip link`; the others have none
    if options["interface"] not in ("socketcan", "virtual", "udp_multicast"):
        arguments["bitrate"] = options["bitrate"]
        if options["fd"]:
            arguments["data_bitrate"] = options["data_bitrate"]
    if options["interface"] == "slcan":
        arguments["timeout"] = 0.0  # any other makes every empty poll that long
    # udp_multicast sends CAN FD unless it is told not to
    if options["fd"] or options["interface"] == "udp_multicast":
        arguments["fd"] = options["fd"]
    # last: what somebody writes into the rig file goes before what is set here
    return {**arguments, **options["arguments"]}


def _for_peer(message: Message, stamp_s: float, channel: str) -> Message:
    """A copy of a message, as a peer on python-can's in-process bus receives it.

    Its constructor looks at each argument, and `copy.deepcopy` for what is shared: six times as long."""
    # every field that python-can reads: a message without one of them fails at the peer, not here
    copied: Message = object.__new__(type(message))
    copied.timestamp, copied.channel, copied.is_rx = stamp_s, channel, True
    copied.is_error_frame = copied.error_state_indicator = False
    copied.arbitration_id, copied.is_extended_id = message.arbitration_id, message.is_extended_id
    copied.is_remote_frame, copied.dlc, copied.data = message.is_remote_frame, message.dlc, message.data[:]
    copied.is_fd, copied.bitrate_switch = message.is_fd, message.bitrate_switch
    return copied


class AdapterFrame:
    """A python-can message whose data is changed in place."""

    __slots__ = ("buffer", "length", "message", "offset")

    def __init__(self, can_id: int, length: int, *, fd: bool) -> None:
        self.message = python_can().Message(
            arbitration_id=can_id & 0x1FFF_FFFF,
            is_extended_id=bool(can_id & EXTENDED),
            is_remote_frame=bool(can_id & REMOTE),
            is_fd=fd,
            bitrate_switch=fd,
            dlc=length,
            data=None if can_id & REMOTE else bytearray(length),
        )
        self.buffer: bytearray = self.message.data
        self.offset, self.length = 0, length


class AdapterBus:
    """One python-can bus. Raises BackendError if it cannot be opened."""

    def __init__(self, options: Options) -> None:
        can = python_can()
        self.health = BusHealth()
        self._name = f"CAN {options['interface']} {options['channel']}"
        self._fd = bool(options["fd"])
        self._handlers: dict[int, Handler] = {}
        # the one interface whose answers to what was sent come by the same way as frames
        self._chatty = options["interface"] == "slcan"
        self._unread_replies = 0
        self._errors = (can.CanError, OSError)
        self._stumbles = (*_GARBLED, *self._errors)
        self._port: list[Any] = []
        self._lost = ""
        try:
            self._bus = can.Bus(**_arguments(options))
        except (can.CanError, OSError, ImportError, NotImplementedError, ValueError, TypeError) as error:
            raise BackendError(
                f"{self._name} cannot be opened: {error}; check interface, channel and arguments of "
                "[device.options.bus], that the adapter is plugged in, and that no other program holds it"
            ) from error
        # `recv` looks at the wall clock and at filters; below it lies what an interface implements itself
        self._recv: Callable[[float], tuple[Any, bool]] = self._bus._recv_internal
        self._send: Callable[..., None] = self._bus.send
        self._waiting = self._asker(options["interface"])
        self._too_late, self._refused = can.CanTimeoutError, can.CanOperationError

    def _asker(self, interface: str) -> Callable[[], int] | None:
        """What tells without waiting whether `recv` has anything to give; None where only `recv` knows."""
        if interface == "virtual":
            inbox = self._bus.queue
            waiting: deque[Any] = inbox.queue
            # `popleft` of a deque is whole by itself, and this bus is its only reader: no lock is needed
            if inbox.maxsize <= 0:  # nobody waits for room in it, so that a frame is taken without a lock
                self._recv = lambda _timeout: (waiting.popleft(), False)
            if not self._bus.receive_own_messages and not self._bus.preserve_timestamps:
                self._send = self._send_to_peers
            return waiting.__len__  # a tenth of the cost of an empty `recv`
        if interface not in PORTS:
            return None
        name, shortest = PORTS[interface]
        port = getattr(self._bus, name)
        port.timeout, port.write_timeout = REST_S, ROOM_S
        self._port = [port]
        # whole frames only: asked for one that is there in part, `recv` would wait for the rest of it
        return lambda: int(port.in_waiting) // shortest

    def _send_to_peers(self, message: Message, timeout: float) -> None:
        """Send on the in-process bus. Raises CanOperationError as `send` does there."""
        bus, stamp_s, full = self._bus, 1e-9 * time.time_ns(), False
        own, channel = bus.queue, bus.channel_id
        for peer in bus.channel:
            # as python-can with `receive_own_messages` off, which is asked above
            if peer is own:
                continue
            try:
                # a copy for each: the sender changes the data of its frame in place in the next cycle
                peer.put(_for_peer(message, stamp_s, channel), timeout=timeout)
            except queue.Full:
                full = True
        if full:
            raise self._refused("a peer has no room")

    def subscribe(self, handlers: Mapping[int, Handler]) -> None:
        """Have `receive` call these; all other frames are dropped here."""
        self._handlers = dict(handlers)

    def receive(self) -> bool:
        """Hand every waiting frame to its handler. Raises LinkLost once the adapter is gone."""
        if self._lost:
            raise LinkLost(self._lost)
        recv, handlers, waiting = self._recv, self._handlers, self._waiting
        # slcan: each frame sent is acknowledged by a line that reads as None
        # one more than are due: a None beyond them says that nothing waits
        empties = self._unread_replies + 1 if self._chatty else 1
        # damaged frames and empty looks count, too: a line of noise must not hold up the loop
        for _ in range(DRAIN_LIMIT):
            try:
                if waiting is not None and not waiting():
                    return True
                message, _ = recv(0)
            except self._stumbles as error:
                if not self._is_damage(error):
                    raise self._gone(error) from error
                self.health.counts["damaged"] += 1
                continue
            if message is None:
                # where something told that a frame waits, None is one that the interface dropped: looked on
                empties -= waiting is None
                if empties <= 0:
                    self._unread_replies = 0
                    return True
                continue
            can_id = message.arbitration_id
            if message.is_extended_id:
                can_id |= EXTENDED
            # before its identifier is looked up: it holds classes of errors
            if message.is_error_frame:
                self.health.error_frame(message.arbitration_id, message.data)
                continue
            if message.is_remote_frame:
                can_id |= REMOTE
            handler = handlers.get(can_id)
            if handler is not None:
                handler(message.data, 0, len(message.data))  # `dlc` is what the frame said it has
        return False

    def _is_damage(self, error: Exception) -> bool:
        """Whether a frame was garbled, and not the adapter lost. On a port a loss has the port's error as its
        cause."""
        if isinstance(error, self._errors):
            return bool(self._port) and error.__cause__ is None and not isinstance(error, OSError)
        return True

    def _gone(self, error: Exception) -> LinkLost:
        self._lost = self._lost or f"{self._name} is lost: {error}; plug the adapter in again"
        return LinkLost(self._lost)

    def outgoing(self, can_id: int, length: int) -> AdapterFrame:
        """Make a frame that can be sent; its data is all zero."""
        return AdapterFrame(can_id, length, fd=self._fd)

    def send(self, frame: AdapterFrame) -> bool:
        """Queue a frame; False when the queue is full. Raises LinkLost."""
        if self._lost:
            raise LinkLost(self._lost)
        try:
            # a port without room would make `write` wait for ROOM_S
            if self._port and not select.select((), self._port, (), 0)[1]:
                self.health.refused()
                return False
            self._send(frame.message, timeout=0)
        except self._errors as error:
            # interfaces wrap the system's error, and its number stands in the one or the other
            cause = error.__cause__ or error
            code = getattr(error, "error_code", None) or getattr(cause, "errno", None)
            if code in _FULL or isinstance(cause, TimeoutError) or isinstance(error, self._too_late):
                self.health.refused()
                return False
            raise self._gone(error) from error
        # not before: a frame that was refused is acknowledged by nobody
        self._unread_replies += 1
        if self.health.refused_in_a_row:
            self.health.taken()
        return True

    def discard(self) -> None:
        """Nothing: what was queued leaves in its order."""

    def fresh_python_can(self) -> BusABC:
        """The bus itself: most adapters can be opened only once."""
        bus: BusABC = self._bus
        return bus

    def release(self, bus: object) -> None:
        """Keep it open."""

    def close(self) -> None:
        """Shut the bus down; an adapter that is gone already is no error."""
        # from now on sending and receiving say so, in place of an error of the closed bus
        self._lost = self._lost or f"{self._name}: closed"
        try:
            self._bus.shutdown()
        except self._errors:
            return
