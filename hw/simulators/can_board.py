"""A simulated board of one's own kind of frames, for field maps: see `hw.simulators.can_drives`."""

from __future__ import annotations

import math
import struct

from hw.simulators.can_drives import Frame


class BoardSim:
    """A board with a 16-bit encoder counter: answers every command; current holds for its time to live.

    Command 0x200: i16 mA, u8 enable, u8 counter. Feedback 0x101: u16 counts (wraps), i16 mA, u8 counter,
    u8 flags, u8 unused, checksum (crc8 J1850); and 0x102: i32 millicounts/s."""

    COUNTS_PER_TURN = 4096

    def __init__(self, time_to_live_s: float = 0.01) -> None:
        self.current_a = self._turns = self._turns_s = self._measured_a = 0.0
        self._life_s, self._time_to_live_s, self._counter = 0.0, time_to_live_s, 0
        self.estop = 0

    def frame(self, can_id: int, data: bytes) -> list[Frame]:
        """See SimDrive."""
        if can_id != 0x200 or len(data) != 4:
            return []
        milliamps, enable, _ = struct.unpack("<hBB", data)
        self.current_a, self._life_s = 1e-3 * milliamps * bool(enable), self._time_to_live_s
        return [self._feedback(), self._speed()]

    def _speed(self) -> Frame:
        return 0x102, struct.pack("<i", round(1e3 * self._turns_s * self.COUNTS_PER_TURN))

    def _feedback(self) -> Frame:
        self._counter = self._counter + 1 & 0xFF  # & binds last: the sum is wrapped
        counts = math.floor(self._turns * self.COUNTS_PER_TURN) & 0xFFFF
        milliamps = max(-32768, min(32767, round(1e3 * self._measured_a)))
        data = struct.pack("<HhBBB", counts, milliamps, self._counter, self.estop, 0)
        return 0x101, data + bytes([self.crc(data)])

    @staticmethod
    def crc(data: bytes) -> int:
        """CRC-8 SAE J1850, bit by bit."""
        crc = 0xFF
        for byte in data:
            crc ^= byte
            for _ in range(8):
                crc = (crc << 1 ^ (0x1D if crc & 0x80 else 0)) & 0xFF
        return crc ^ 0xFF

    def pass_time(self, seconds: float, turns: float, turns_s: float, current_a: float) -> list[Frame]:
        """See SimDrive."""
        self._turns, self._turns_s, self._measured_a = turns, turns_s, current_a
        self._life_s -= seconds
        if self._life_s < 0.0:
            self.current_a = 0.0
        return []
