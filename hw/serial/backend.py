"""What every board on a serial port has in common: open, drain to the newest, send, stop, lose, find again.

A subclass says how bytes become a tick and a tick becomes bytes. It runs in the loop process."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from functools import cached_property

import numpy as np

from hw.entry_points import entry_point
from hw.interface import BackendError, CompiledCycle, LinkLost, Options, Rig, Words
from hw.jit import records
from hw.serial.compiled_core import BACKLOG, CHUNKS_PER_READ, PORT, RESTART_PACKETS, read_cycle, write_cycle
from hw.serial.framing import PACKET_MAX
from hw.serial.link import BACKLOGGED, DRAINED, MORE
from hw.serial_port import CHUNK, Port, send_once

Codec = tuple[Callable[..., int], tuple[np.ndarray, ...]]

# 8N1, as every port here is opened (`hw.serial_port`)
BITS_PER_BYTE = 10
"""Start bit, eight data bits, stop bit."""


class SerialCore:
    """A board on a serial port. `bind` of the subclass makes `_receive` and `_send` for one tick array."""

    provides: frozenset[str]
    consumes: frozenset[str]
    asks = False
    """Whether something is sent in every cycle besides commands."""
    _poll = b""
    """That, if so."""

    def __init__(self, options: Options, rig: Rig) -> None:
        self._path, self._baud = str(options["port"]), int(options["baud"])
        self._rig = rig
        self._port: Port | None = None
        self._tick: np.ndarray | None = None
        self.chunk = np.zeros(CHUNK, np.uint8)
        self.packet = np.zeros(PACKET_MAX, np.uint8)
        self._packet_bytes = self.packet.data
        # sizes go through arrays that stay the same: compiled calls are bound to them once (decision 0004)
        self.meta = np.zeros(2, np.int64)
        self._size = self.meta.data
        self._wire = records(np.zeros(1, PORT))
        self._wire["fd"] = -1
        self._receive: Callable[[], int] | None = None
        self._send: Callable[[], int] | None = None
        self._patience_s = float(options["open_timeout_s"])
        self._reopen_timeout_s = float(options["reopen_timeout_s"])
        self.unsent = 0
        """Commands the line had no room for, since the start."""

    # -- what a subclass gives ---------------------------------------------------------------------
    def _bind(self, tick: np.ndarray) -> tuple[Callable[[], int], Callable[[], int]]:
        """Compiled `receive() -> samples out of order in a row` and `send() -> bytes in packet`."""
        raise NotImplementedError

    def _compiled_codec(self, _tick: np.ndarray) -> tuple[Codec, Codec] | None:
        """The same two with their arguments, where both are compiled all through."""
        return None

    def _stop_packet(self) -> bytes:
        """What makes the board torque-free; empty when the board has no such packet."""
        raise NotImplementedError

    def _greet(self, port: Port) -> None:
        """Make sure the right board answers. Raises BackendError."""

    def _forget(self) -> None:
        """A new connection begins: nothing of the old byte stream may be continued."""

    def _with_backlog(self, text: str) -> list[Words]:
        """The words of a board, and that nothing of it was new because there was too much of it."""
        backlog = (
            f"{BACKLOG} bytes or more came in a cycle (the loop stood still, or the board sends too much)"
        )
        return [Words(", ".join(one for one in (text, backlog if self._wire["behind"][0] else "") if one))]

    @cached_property
    def _stop_bytes(self) -> bytes:
        return self._stop_packet()

    # -- the backend -------------------------------------------------------------------------------
    def open(self) -> None:
        """Open the port and make sure of the board. Idempotent. Raises BackendError."""
        if self._port is not None:
            return
        # a local until all went well: `read` must not find a port whose board was never heard
        port = Port(self._path, self._baud)
        try:
            self.prepare_stop()
            self._forget()
            # what the last connection could not send is no fault of this one
            self._wire["unsent_in_row"] = self._wire["full"] = self._wire["behind"] = 0
            self._greet(port)
        # Ctrl-C in the patience for a board, too: a port that stays locked keeps the next start out
        except BaseException:
            port.close()
            raise
        self._views = [self.chunk.data]
        # from now on a re-plug is waited for, by a loop that makes no ticks meanwhile
        self._patience_s = self._reopen_timeout_s
        self._port = port
        self._wire["fd"] = port.fd

    def fileno(self) -> int:
        """Descriptor of the open port, to wait on; -1 while closed."""
        return -1 if self._port is None else self._port.fd

    def prepare_stop(self) -> None:
        """See `PreparedStop`."""
        _ = self._stop_bytes

    def warm_up(self, tick: np.ndarray) -> None:
        """Compile (or load) what `read` and `write` call, for ticks like `tick`; changes nothing."""
        self._receive, self._send = self._bind(tick)
        self._tick = tick

    def compiled_cycle(self, tick: np.ndarray) -> CompiledCycle | None:
        """See `CompiledCycleBackend`; None where what is sent is put together in Python."""
        codec = self._compiled_codec(tick)
        if codec is None:
            return None
        (receive, received), (send, sent) = codec
        wire = self._wire
        wire["receive_at"], wire["send_at"] = entry_point(receive, *received), entry_point(send, *sent)
        return CompiledCycle(
            read_cycle, (wire, self.chunk, self.meta, received), write_cycle, (wire, self.packet, sent)
        )

    def read(self, tick: np.ndarray) -> None:
        """Write the newest sample into the tick. Never blocks; bounded work. Raises LinkLost.

        A backlog is taken in but nothing of it shown as fresh, nor of the next cycle: the kernel hands on
        what it had left, and after that comes what is really new."""
        port = self._port
        if port is None:
            raise LinkLost(f"serial port {self._path}: not open")
        if tick is not self._tick:
            self.warm_up(tick)
        receive, size = self._receive, self._size
        assert receive is not None
        size[0] = n = port.read_into(self._views)
        size[1] = BACKLOGGED if self._wire["behind"][0] else DRAINED
        self._wire["behind"] = 0
        # half of what the kernel keeps, 20 ms at 1 Mbit/s: the loop has stood still
        if n >= BACKLOG:
            self._catch_up(port, receive)
        # a board that was powered anew counts position from 0: what the joint's angle is, nobody knows
        if receive() >= RESTART_PACKETS:
            raise LinkLost(
                f"serial port {self._path}: the board has started over (its samples are older than those "
                "before); its position is no longer known: stop, and start again"
            )

    def _catch_up(self, port: Port, receive: Callable[[], int]) -> None:
        """Take in a backlog up to its last chunk; that one is left to the caller."""
        size = self._size
        # the end of a chunk is no end of what waits: judged after the last one only
        size[1] = MORE
        for _ in range(CHUNKS_PER_READ - 1):
            receive()  # with size[1] = MORE: taken in, and nothing of it shown
            size[0] = n = port.read_into(self._views)
            if n < BACKLOG:
                break
        size[1] = BACKLOGGED
        self._wire["behind"] = 1

    def write(self, tick: np.ndarray) -> None:
        """Send the tick's command; the newest always goes first. Never blocks. Raises LinkLost."""
        port = self._port
        if port is None:
            raise LinkLost(f"serial port {self._path}: not open")
        if tick is not self._tick:
            self.warm_up(tick)
        send, wire = self._send, self._wire
        assert send is not None
        if not (self.consumes or self.asks):
            return
        if wire["full"][0]:  # the compiled half has tried
            wire["full"] = 0
        elif port.write(self._packet_bytes[: send()]):
            wire["unsent_in_row"] = 0
            return
        self.unsent += 1
        wire["unsent_in_row"] += 1
        # the line is full of old commands: dropped, the next one is not late by all of them
        port.discard_output()  # what waits there is older than this one
        # the board's own time to live has stopped it long before; now the rig is told
        if wire["unsent_in_row"][0] >= RESTART_PACKETS:
            raise LinkLost(f"serial port {self._path}: the board takes no more commands (line full)")

    def ask(self) -> None:
        """See AskedBackend: the poll, where the board has one."""
        if self._port is None:
            raise LinkLost(f"serial port {self._path}: not open")
        if self._poll:
            self._port.write(self._poll)

    def stop(self) -> None:
        """Make the board torque-free: a stop packet ahead of anything queued. Never raises."""
        # made before (`prepare_stop`): a stop compiles nothing, and may come from any thread
        packet = self._stop_bytes
        if not packet:
            return
        port = self._port
        if port is not None:
            port.discard_output()
            with contextlib.suppress(LinkLost):
                if port.write(packet):
                    return
        # by a descriptor of its own: ours may be closed, hung up, or in use by a thread that hangs
        send_once(self._path, self._baud, packet)

    def close(self) -> None:
        """Release the port. Idempotent, never raises."""
        # first of all: a descriptor's number may soon be another file's
        port, self._port = self._port, None
        self._wire["fd"] = -1
        if port is not None:
            port.close()


def require_line_rate(
    path: str, baud: int, bytes_in: int, in_hz: float, bytes_out: int = 0, out_hz: float = 0.0
) -> None:
    """Refuse a bit rate that cannot carry `in_hz` samples and `out_hz` commands a second, and so many samples
    a command that they are a backlog in every cycle. Raises BackendError."""
    ways = [
        ("a sample", bytes_in, in_hz, "the device's rate_hz"),
        ("a command", bytes_out, out_hz, "[loop] rate_hz"),
    ]
    what, n_bytes, rate_hz, key = max(ways, key=lambda way: way[1] * way[2])
    most = bytes_in * (in_hz / out_hz + 1) if out_hz else 0.0  # one more: the clocks of both differ a little
    if most >= BACKLOG:
        raise BackendError(
            f"serial port {path}: {in_hz:g} samples a second of {bytes_in} bytes are up to {most:.0f} bytes "
            f"a cycle: from {BACKLOG} on nothing counts as new (so much waits after the loop stood still); "
            "let the board send fewer or shorter samples, or raise [loop] rate_hz"
        )
    needed = n_bytes * BITS_PER_BYTE * rate_hz
    # a tenth is left: on a line that is just full every sample is later than the one before
    if needed > 0.9 * baud:
        raise BackendError(
            f"serial port {path}: baud {baud} is too slow for {what} of {n_bytes} bytes, {rate_hz:g} times "
            f"a second: they need at least {needed / 0.9:.0f}; raise baud, or lower {key} if it is slower "
            "(USB boards ignore the number: write any high one)"
        )
