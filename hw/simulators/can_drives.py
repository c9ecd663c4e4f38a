"""Simulated drives: they answer frames as the real ones do, and stop by themselves when commands end.

Each is driven from outside and has no thread or clock: `frame` takes one frame and returns the answers,
`pass_time` lets time go by and returns what the drive sends unasked. Written from the protocols, apart from
the codecs they test."""

from __future__ import annotations

import math
import struct
from typing import Protocol

Frame = tuple[int, bytes]
"""Identifier with SocketCAN's flags, and data."""

REMOTE, EXTENDED = 0x4000_0000, 0x8000_0000


class SimDrive(Protocol):
    """One simulated device."""

    current_a: float
    """Motor current it lets flow now."""

    def frame(self, can_id: int, data: bytes) -> list[Frame]:
        """Take a frame from the bus."""

    def pass_time(self, seconds: float, turns: float, turns_s: float, current_a: float) -> list[Frame]:
        """Let time pass; the motor now stands at `turns`, turns with `turns_s` and carries `current_a`."""


class OdriveSim:
    """ODrive axis: torque control only with state 8 and mode (torque, pass-through); watchdog.

    Firmware before 0.6.9 has Set_Axis_Node_ID where Address is now, and obeys it in a remote frame too; 0.5
    tells no version."""

    def __init__(
        self,
        node: int,
        torque_constant_nm_a: float,
        feedback_s: float | None,
        watchdog_s: float,
        firmware: tuple[int, int, int] = (0, 6, 11),
    ) -> None:
        self.node, self._constant, self.firmware = node, torque_constant_nm_a, firmware
        self._feedback_s, self._watchdog_s = feedback_s, watchdog_s
        self.state, self.error, self.mode = 1, 0, (0, 0)
        self.torque_nm = self.current_a = self._turns = self._turns_s = self._measured_a = 0.0
        self._unfed_s = self._since_feedback_s = self._since_heartbeat_s = 0.0
        self.serial = b"\x12\x34\x56\x78\x9a\xbc"

    def _id(self, command: int) -> int:
        return self.node << 5 | command

    def _estimates(self) -> Frame:
        return self._id(0x09), struct.pack("<ff", self._turns, self._turns_s)

    def _iq(self) -> Frame:
        return self._id(0x14), struct.pack("<ff", self.current_a, self._measured_a)

    def frame(self, can_id: int, data: bytes) -> list[Frame]:
        """See SimDrive."""
        command, remote = can_id & 0x1F, bool(can_id & REMOTE)
        # a standard identifier, and this node's: an ODrive hears its own six bits of node only
        if can_id & 0x7FF != self._id(command):
            return []
        if command == 0x06 and self.firmware < (0, 6, 9):
            self.node = int.from_bytes(data[:4].ljust(4, b"\0"), "little")
            return []
        if remote:
            answers = {0x09: self._estimates, 0x14: self._iq, 0x06: self._address}
            if self.firmware >= (0, 6, 0):
                answers[0x00] = self._version
            return [answers[command]()] if command in answers else []
        if command == 0x0E and len(data) >= 4:
            self.torque_nm, self._unfed_s = struct.unpack_from("<f", data)[0], 0.0
        elif command == 0x07:
            wanted = struct.unpack_from("<I", data)[0]
            # in another mode a torque would mean nothing: the codec is to have set it, each time it arms
            self.state = 8 if wanted == 8 and self.error == 0 and self.mode == (1, 1) else 1
            self._unfed_s = 0.0
        elif command == 0x0B:
            self.mode = struct.unpack_from("<II", data)
        elif command == 0x18:
            self.error, self._unfed_s = 0, 0.0
        self._apply()
        return [self._heartbeat()] if command in (0x07, 0x18) else []

    def _address(self) -> Frame:
        return self._id(0x06), bytes([self.node]) + self.serial + b"\0"

    def _version(self) -> Frame:
        return self._id(0x00), bytes([2, 4, 4, 58, *self.firmware, 0])

    def _heartbeat(self) -> Frame:
        return self._id(0x01), struct.pack("<IBBBB", self.error, self.state, 0, 0, 0)

    def _apply(self) -> None:
        self.current_a = self.torque_nm / self._constant if self.state == 8 else 0.0

    def pass_time(self, seconds: float, turns: float, turns_s: float, current_a: float) -> list[Frame]:
        """See SimDrive."""
        self._turns, self._turns_s, self._measured_a = turns, turns_s, current_a
        self._unfed_s += seconds
        self._since_feedback_s += seconds
        self._since_heartbeat_s += seconds
        if self._unfed_s > self._watchdog_s and self.state == 8:
            self.error, self.state = 0x1000000, 1  # WATCHDOG_TIMER_EXPIRED
        self._apply()
        sent = []
        # steps add up to a hair less than a period
        if self._feedback_s is not None and self._since_feedback_s >= self._feedback_s - 1e-9:
            self._since_feedback_s = 0.0
            sent += [self._estimates(), self._iq()]
        if self._since_heartbeat_s >= 0.01:
            self._since_heartbeat_s = 0.0
            sent.append(self._heartbeat())
        return sent


class MoteusSim:
    """moteus controller: registers by subframes, position mode with kp = kd = 0, time to live per command."""

    def __init__(self, node: int, torque_constant_nm_a: float) -> None:
        self.temperature_c = 31.5
        self._node, self._constant = node, torque_constant_nm_a
        self.mode, self.fault = 0, 0
        self.current_a = self._turns = self._turns_s = self._measured_a = 0.0
        self._life_s = math.nan
        self._serial = (0x11, 0x22, 0x33)

    def frame(self, can_id: int, data: bytes) -> list[Frame]:
        """See SimDrive."""
        if can_id & 0xFF != self._node or not can_id & EXTENDED:
            return []
        source = can_id >> 8 & 0x7F
        reply = self._subframes(data)
        self._apply()
        if not can_id & 0x8000 or not reply:
            return []
        size = next(n for n in (8, 12, 16, 20, 24, 32, 48, 64) if n >= len(reply))
        # above 7 the identifier has more than 11 bits
        return [(self._node << 8 | source | (EXTENDED if self._node > 7 else 0), reply.ljust(size, b"\x50"))]

    def _subframes(self, data: bytes) -> bytes:
        at, reply = 0, b""
        while at < len(data):
            head, at = data[at], at + 1
            if head == 0x50:
                continue
            kind, count = head >> 2 & 3, head & 3
            if not count:
                count, at = data[at], at + 1
            register, at = data[at], at + 1
            if register & 0x80:
                register, at = register & 0x7F | data[at] << 7, at + 1
            if head < 0x10:
                code, size = (("<b", 1), ("<h", 2), ("<i", 4), ("<f", 4))[kind]
                values = [struct.unpack_from(code, data, at + k * size)[0] for k in range(count)]
                at += size * count
                self._write(register, values)
            else:
                reply += self._read(kind, register, count)
        return reply

    def _write(self, register: int, values: list[float]) -> None:
        for k, value in enumerate(values):
            if register + k == 0x000:
                if value == 0:
                    self.mode = self.fault = 0
                # a time-out is left by a stop alone: torque does not come back by itself
                elif self.mode not in (1, 11):  # out of fault (1) and time-out (11) only stopped (0) leads
                    self.mode = int(value)
                self.torque_nm, self._max_nm = 0.0, math.inf
            elif register + k == 0x022:
                self.torque_nm = value
            elif register + k == 0x025:
                self._max_nm = value
            elif register + k == 0x027:
                self._life_s = value

    def _read(self, kind: int, register: int, count: int) -> bytes:
        torque = self.current_a * self._constant
        values = {
            0: self.mode,
            1: self._turns,
            2: self._turns_s,
            3: torque,
            4: self._measured_a,
            14: self.temperature_c,
            15: self.fault,
        }
        values |= {0x120 + k: word for k, word in enumerate(self._serial)}
        code = "bhif"[kind]
        numbers = [values.get(register + k, 0) for k in range(count)]
        typed = [float(n) if kind == 3 else int(n) for n in numbers]
        where = bytes([register]) if register < 0x80 else bytes([register & 0x7F | 0x80, register >> 7])
        return bytes([0x20 | kind << 2 | count]) + where + struct.pack(f"<{count}{code}", *typed)

    def _apply(self) -> None:
        self.current_a = 0.0
        if self.mode == 10:
            limited = min(max(self.torque_nm, -self._max_nm), self._max_nm)
            self.current_a = limited / self._constant

    def pass_time(self, seconds: float, turns: float, turns_s: float, current_a: float) -> list[Frame]:
        """See SimDrive."""
        self._turns, self._turns_s, self._measured_a = turns, turns_s, current_a
        if self.mode == 10:
            self._life_s -= seconds
            if self._life_s < 0.0:
                self.mode = 11
        self._apply()
        return []
