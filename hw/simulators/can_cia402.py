"""A simulated CiA 402 drive: see `hw.simulators.can_drives`."""

from __future__ import annotations

import math
import struct

from hw.simulators.can_drives import Frame


class Cia402Sim:
    """CiA 402 drive: an SDO server for expedited transfers, mapped PDOs, SYNC, heartbeat consumer."""

    def __init__(self, node: int, torque_constant_nm_a: float, counts_per_turn: float) -> None:
        self._node, self._constant, self._counts = node, torque_constant_nm_a, counts_per_turn
        self.objects: dict[tuple[int, int], int] = {
            (0x6075, 0): 5000, (0x6076, 0): round(5000 * torque_constant_nm_a),
            (0x1018, 1): 0xABC, (0x1018, 2): 0x402, (0x1018, 4): 77 + node, (0x6060, 0): 0,
            # COB-IDs: bit 30, no remote frame asks for it; bit 31, it does not exist
            (0x1400, 1): 0x200 + node, (0x1800, 1): 0x4000_0180 + node, (0x1801, 1): 0xC000_0280 + node,
            # 60C2: 1 times 10^-3 s; 6007: 1, a fault when the host is silent
            (0x60C2, 1): 1, (0x60C2, 2): -3, (0x6007, 0): 1,
        }  # fmt: skip
        self.state, self.nmt = 0x40, 0x7F  # switch on disabled; pre-operational
        self.controlword = self._pending_target = 0
        self._pending_control = self._last = 0
        self.current_a = self._turns = self._turns_s = self._measured_a = 0.0
        self._unheard_s, self._watching, self._since_beat_s = 0.0, False, 0.0

    @property
    def _rated_a(self) -> float:
        return 1e-3 * self.objects[0x6076, 0] / self._constant

    def frame(self, can_id: int, data: bytes) -> list[Frame]:
        """See SimDrive."""
        if can_id == 0x600 + self._node and len(data) == 8:
            return [(0x580 + self._node, self._sdo(data))]
        if can_id == 0x000 and len(data) == 2 and data[1] in (0, self._node):  # 0: every node
            # start, to pre-operational, stop (CiA 301)
            self.nmt = {0x01: 0x05, 0x80: 0x7F, 0x02: 0x04}.get(data[0], self.nmt)
        elif can_id == 0x200 + self._node and self.nmt == 0x05:
            self._pending_control, self._pending_target = struct.unpack("<Hh", data)
        elif can_id == 0x080 and self.nmt == 0x05:
            return self._synchronise()
        elif can_id - 0x700 == self.objects.get((0x1016, 1), 0) >> 16 & 0x7F:
            self._unheard_s, self._watching = 0.0, True
        return []

    def _sdo(self, data: bytes) -> bytes:
        command, index, sub = struct.unpack_from("<BHB", data)
        if command & 0xE0 == 0x20:  # an expedited download; bits 2 and 3: how many of four bytes are none
            size = 4 - (command >> 2 & 3)
            self.objects[index, sub] = int.from_bytes(data[4 : 4 + size], "little")
            self.objects[0x6061, 0] = self.objects[0x6060, 0]
            if index == 0x6040:
                self._transition(self.objects[index, sub])
            return struct.pack("<BHB4x", 0x60, index, sub)  # 0x60: downloaded
        if (index, sub) not in self.objects:
            # abort: there is no such object (CiA 301)
            return struct.pack("<BHBI", 0x80, index, sub, 0x0602_0000)
        # 0x43: an expedited upload of four bytes
        return struct.pack("<BHBI", 0x43, index, sub, self.objects[index, sub] & 0xFFFF_FFFF)

    def _synchronise(self) -> list[Frame]:
        # obeyed at the SYNC and not when it came: all drives of a rig act at one instant
        control, self._last = self._pending_control, self.controlword
        self.controlword = control
        self._transition(control)
        # in another mode a torque means nothing: a host that forgot to set it would see no current
        enabled = self.state == 0x27 and self.objects.get((0x6060, 0)) == 10
        self.current_a = 1e-3 * self._pending_target * self._rated_a if enabled else 0.0
        # wrapped to 32 bits; made signed where it is packed
        counts = math.floor(self._turns * self._counts) + 0x8000_0000 & 0xFFFF_FFFF
        rated_a = 1e-3 * self.objects[0x6075, 0]
        actual = max(-32768, min(32767, round(1000 * self._measured_a / rated_a)))
        # bit 4: the power stage has its voltage
        frames = [(0x180 + self._node, struct.pack("<Hih", self.state | 0x10, counts - 0x8000_0000, actual))]
        if (
            self.objects.get((0x1A01, 1)) == 0x606C_0020
            and self.objects[0x1801, 1] & 0x8000_07FF == 0x280 + self._node
        ):
            frames.append((0x280 + self._node, struct.pack("<i", round(self._turns_s * self._counts))))
        return frames

    def _transition(self, control: int) -> None:
        # fault: nothing but an edge of bit 7 leads out (CiA 402-2), whatever else is commanded
        if self.state == 0x08:
            if control & 0x80 and not self._last & 0x80:  # an edge of bit 7 resets a fault
                self.state = 0x40
            return
        if not control & 0x02:  # disable voltage
            self.state = 0x40
        elif control & 0x07 == 0x06:
            self.state = 0x21
        elif control & 0x0F == 0x07 and self.state in (0x21, 0x27):
            self.state = 0x23
        elif control & 0x0F == 0x0F and self.state == 0x23:
            self.state = 0x27

    def pass_time(self, seconds: float, turns: float, turns_s: float, current_a: float) -> list[Frame]:
        """See SimDrive."""
        self._turns, self._turns_s, self._measured_a = turns, turns_s, current_a
        self._unheard_s += seconds
        self._since_beat_s += seconds
        life_s = 1e-3 * (self.objects.get((0x1016, 1), 0) & 0xFFFF)
        if self._watching and self._unheard_s > life_s:
            self.state, self.current_a, self._watching = 0x08, 0.0, False
        producer_s = 1e-3 * self.objects.get((0x1017, 0), 0)
        if producer_s and self._since_beat_s >= producer_s:
            self._since_beat_s = 0.0
            return [(0x700 + self._node, bytes([self.nmt]))]
        return []
