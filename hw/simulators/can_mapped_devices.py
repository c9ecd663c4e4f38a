"""Simulated devices of other makers that rig files describe by field maps: MIT mode, VESC, OptoForce on CAN.

See `hw.simulators.can_drives`; written from the makers' descriptions, apart from the codecs they test."""

from __future__ import annotations

import math
import struct

from hw.simulators.can_drives import EXTENDED, Frame


class MitSim:
    """A drive in the MIT mode of T-Motor, CubeMars and the like (an AK80-9): answers every frame it is sent.

    Angle, speed and torque are those of the shaft behind its gear. It drives only after the frame FF..FC."""

    POSITION, SPEED, TORQUE, KP, KD = 12.5, 50.0, 18.0, 500.0, 5.0

    def __init__(
        self, node: int, torque_constant_nm_a: float, gear: float = 9.0, time_to_live_s: float = 0.01
    ) -> None:
        self._node, self._ampere, self._gear = node, 1.0 / (torque_constant_nm_a * gear), gear
        self.on, self.error = False, 0
        self.current_a = self._angle = self._speed = self._measured_a = 0.0
        self._life_s, self._time_to_live_s = 0.0, time_to_live_s

    def frame(self, can_id: int, data: bytes) -> list[Frame]:
        """See SimDrive."""
        if can_id != self._node or len(data) != 8:
            return []
        self._life_s = self._time_to_live_s
        # FC: enter motor mode, FD: leave it, FE: here is 0
        if data[:7] == b"\xff" * 7 and data[7] in (0xFC, 0xFD, 0xFE):
            self.on = data[7] == 0xFC or (self.on and data[7] == 0xFE)
            self.current_a = 0.0
        elif self.on:
            self.current_a = self._torque(int.from_bytes(data, "big")) * self._ampere
        return [self._reply()]

    def _torque(self, command: int) -> float:
        position, speed = _real(command >> 48, 16, self.POSITION), _real(command >> 36, 12, self.SPEED)
        kp, kd = (command >> 24 & 0xFFF) / 4095 * self.KP, (command >> 12 & 0xFFF) / 4095 * self.KD
        feed = _real(command, 12, self.TORQUE)
        return kp * (position - self._angle) + kd * (speed - self._speed) + feed

    def _reply(self) -> Frame:
        torque = self._measured_a / self._ampere
        packed = _whole(self._angle, 16, self.POSITION) << 24 | _whole(self._speed, 12, self.SPEED) << 12
        packed |= _whole(torque, 12, self.TORQUE)
        return 0, bytes([self._node]) + packed.to_bytes(5, "big") + bytes([25, self.error])

    def pass_time(self, seconds: float, turns: float, turns_s: float, current_a: float) -> list[Frame]:
        """See SimDrive."""
        self._angle, self._speed = 2 * math.pi * turns / self._gear, 2 * math.pi * turns_s / self._gear
        self._measured_a = current_a
        self._life_s -= seconds
        if self._life_s < 0.0:
            self.on, self.current_a = False, 0.0
        return []


def _whole(value: float, bits: int, end: float) -> int:
    """Number on the wire of a value from -end to end."""
    top = (1 << bits) - 1
    return int(min(max((value + end) / (2 * end), 0.0), 1.0) * top)


def _real(raw: int, bits: int, end: float) -> float:
    top = (1 << bits) - 1
    return (raw & top) / top * 2 * end - end


class VescSim:
    """A VESC: status 1 and 4 once a millisecond, unasked; a current holds until its time-out."""

    POLE_PAIRS, PERIOD_S = 7, 1e-3

    def __init__(self, node: int, time_to_live_s: float = 0.01) -> None:
        self._node, self._time_to_live_s = node, time_to_live_s
        self.current_a = self._life_s = self._since_s = 0.0

    def frame(self, can_id: int, data: bytes) -> list[Frame]:
        """See SimDrive."""
        if can_id == (EXTENDED | 1 << 8 | self._node) and len(data) == 4:  # packet 1: set current, mA
            self.current_a = 1e-3 * struct.unpack(">i", data)[0]
            self._life_s = self._time_to_live_s
        return []

    def pass_time(self, seconds: float, turns: float, turns_s: float, current_a: float) -> list[Frame]:
        """See SimDrive."""
        self._life_s -= seconds
        if self._life_s < 0.0:
            self.current_a = 0.0
        self._since_s += seconds
        if self._since_s < self.PERIOD_S - 1e-9:  # steps add up to a hair less than a period
            return []
        self._since_s = 0.0
        tenths = max(-32768, min(32767, round(10 * current_a)))
        # speed is that of the electrical field: ERPM
        speed = struct.pack(">ihh", round(60 * turns_s * self.POLE_PAIRS), tenths, 0)
        # packet 16: two temperatures and a current in tenths, the angle in 50ths of a degree
        angle = struct.pack(">hhhh", 312, 287, 0, int(turns % 1.0 * 360.0 * 50))
        return [(EXTENDED | 9 << 8 | self._node, speed), (EXTENDED | 16 << 8 | self._node, angle)]


class OptoForceSim:
    """A three-axis OptoForce on CAN: silent until it is configured, then 16 bytes in two frames of one
    identifier."""

    DATA, CONFIG = 0x100, 0x101

    def __init__(self, _node: int) -> None:
        self.current_a = 0.0
        self.counts, self.status, self.period_s = (0, 0, 0), 0, 0.0
        self._count, self._since_s, self._asked = 0, 0.0, b""

    def frame(self, can_id: int, data: bytes) -> list[Frame]:
        """See SimDrive."""
        if can_id != self.CONFIG:
            return []
        self._asked = data if len(data) == 8 else self._asked + data
        asked = self._asked
        # the checksum's low byte comes in a frame of its own
        if len(asked) == 9 and asked[:4] == b"\xaa\0\x32\3" and sum(asked[:7]) == asked[7] << 8 | asked[8]:
            self.period_s = 1e-3 * asked[4]
        return []

    def pass_time(self, seconds: float, turns: float, turns_s: float, current_a: float) -> list[Frame]:
        """See SimDrive."""
        del turns, turns_s, current_a
        self._since_s += seconds
        if not self.period_s or self._since_s < self.period_s - 1e-9:
            return []
        self._since_s, self._count = 0.0, self._count + 1 & 0xFFFF
        packet = b"\xaa\7\x08\x0a" + struct.pack(">HHhhh", self._count, self.status, *self.counts)
        packet += (sum(packet) & 0xFFFF).to_bytes(2, "big")
        return [(self.DATA, packet[:8]), (self.DATA, packet[8:])]
