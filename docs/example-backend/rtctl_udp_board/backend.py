"""The board as a backend. Runs in rtctl's loop process: imports no pydantic, blocks nowhere.

State packet, board to host, 25 bytes little endian: count u32, angle f32 rad, current f32 A, force 3 x f32 N,
emergency stop u8. Command packet, host to board, 9 bytes: count u32, enabled u8, torque f32 N m. The board
drops the torque by itself when no command came for 10 ms, and streams its state to whoever commanded last.
"""

from __future__ import annotations

import contextlib
import math
import socket
import struct
import time

import numpy as np

from hw.interface import BackendError, LinkFault, LinkLost, Options, Rig

STATE = struct.Struct("<I5fB")
COMMAND = struct.Struct("<IBf")


class UdpBoard:
    """One axis; `options` are those of `UdpBoardOptions`, dumped."""

    provides = frozenset({"position", "current", "force", "estop"})
    consumes = frozenset({"torque"})

    def __init__(self, options: Options, rig: Rig) -> None:
        """Keep what is needed. The device is not touched before `open`."""
        self._where = (str(options["host"]), int(options["port"]))
        if rig.n_axes != 1:
            raise BackendError(f"udp-board {self._where[0]}: serves one axis, not {rig.n_axes}: set axes")
        self._most_nm = float(options["torque_max_nm"])
        self._lost_after_ns = round(options["lost_after_s"] * 1e9)
        self._socket: socket.socket | None = None
        self._board_count, self._count, self._sent, self._heard_ns = -1, 0, 0, 0
        self._state: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0, 0)

    def open(self) -> None:
        """Connect and send a disabled command, which makes the board stream to this address."""
        if self._socket is not None:
            return
        try:
            made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            made.setblocking(False)
            made.connect(self._where)
        except OSError as error:
            raise BackendError(f"udp-board {self._where[0]}: {error.strerror}: check host") from error
        self._socket, self._board_count, self._heard_ns = made, -1, time.monotonic_ns()
        self._send(0, 0.0)

    def read(self, tick: np.ndarray) -> None:
        """Show the newest state; only one newer than the last, and of numbers, counts as fresh."""
        if self._socket is None:
            raise LinkLost(f"udp-board {self._where[0]}: not open")
        newest, faults = None, 0
        for _ in range(64):  # bounded: a flood must not hold up the cycle
            try:
                data = self._socket.recv(64)
            except OSError:  # nothing there, or nobody: silence tells
                break
            if len(data) != STATE.size:
                faults |= LinkFault.CHECKSUM
                continue
            count, *state = STATE.unpack(data)
            if self._board_count < 0 or 0 < (count - self._board_count) & 0xFFFFFFFF < 1 << 31:
                self._board_count, newest = count, state
        now_ns = time.monotonic_ns()
        if newest is None:
            if now_ns - self._heard_ns > self._lost_after_ns:
                faults |= LinkFault.LOST
        else:
            self._heard_ns = now_ns
            if all(map(math.isfinite, newest)):
                self._state, self._count = tuple(newest), self._count + 1
            else:
                faults |= LinkFault.DEVICE
        angle, current, fx, fy, fz, estop = self._state
        tick["position_rad"][0, 0], tick["current_a"][0, 0] = angle, current
        tick["force_n"][0] = fx, fy, fz
        tick["estop"], tick["sample_count"], tick["link_faults"] = estop, self._count, int(faults)

    def write(self, tick: np.ndarray) -> None:
        """Send the torque. A torque that is no number is sent as zero, one too large saturates."""
        if self._socket is None:
            raise LinkLost(f"udp-board {self._where[0]}: not open")
        torque_nm = float(tick["torque_applied_nm"][0, 0])
        if not math.isfinite(torque_nm):
            torque_nm = 0.0
        self._send(int(tick["enabled"][0]), min(max(torque_nm, -self._most_nm), self._most_nm))

    def _send(self, enabled: int, torque_nm: float) -> None:
        self._sent = (self._sent + 1) & 0xFFFFFFFF
        if self._socket is not None:
            with contextlib.suppress(OSError):  # a full buffer or nobody there: the board's time-to-live acts
                self._socket.send(COMMAND.pack(self._sent, enabled, torque_nm))

    def stop(self) -> None:
        """Zero and disabled, three times over: a datagram may be lost. Never raises."""
        for _ in range(3):
            self._send(0, 0.0)

    def close(self) -> None:
        """Stop and release the socket."""
        self.stop()
        made, self._socket = self._socket, None
        if made is not None:
            made.close()
