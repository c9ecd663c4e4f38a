"""What a board's firmware does with packets: the reference behaviour of docs/serial-protocol.md, as one
class.

No I/O and no clock: bytes in, bytes out, one call per board cycle. Firmware in C is this file in another
language."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hw.jit import records
from hw.serial import frame
from hw.serial.deframer import deframer_dtype, next_packet
from hw.serial.frame import Status
from hw.serial.framing import BODY_MAX, PACKET_MAX, seal, unseal
from hw.serial.link import request

FIRMWARE_VERSION = 1


@dataclass
class Taken:
    """What a chunk of bytes held, in packets."""

    commands: int = 0
    stops: int = 0
    identifies: int = 0
    damaged: int = 0


class Board:
    """Command side of a board: time to live, hold, sequence window; and the packets it sends.

    Parameters
    ----------
    counts_per_rad
        Encoder counts of each axis, for a board that measures velocities and sends packets with them.
    moments
        The board's force sensor measures moments, and its packets have them.

    Attributes
    ----------
    held : bool
        Torque-free until a command with enable 0 comes. True at power-up.
    estop, drive_fault, force_missing, temperature_missing, velocity_missing, moment_missing : bool
        Inputs of the board, shown in its status."""

    def __init__(
        self,
        n_axes: int,
        serial_number: str,
        cycle_us: int,
        counts_per_rad: np.ndarray | None = None,
        *,
        moments: bool = False,
    ) -> None:
        self.n_axes, self.serial_number, self.cycle_us = n_axes, serial_number, cycle_us
        self._counts_per_rad, self._moments = counts_per_rad, moments
        self.command = records(np.zeros(1, frame.command_dtype(n_axes)))
        self._incoming = records(np.zeros(1, frame.command_dtype(n_axes)))
        self._state = records(np.zeros(1, frame.state_dtype(n_axes)))
        self._stream = records(np.zeros(1, deframer_dtype()))
        self._body, self._packet = np.zeros(BODY_MAX + 8, np.uint8), np.zeros(PACKET_MAX, np.uint8)
        self.held, self.expired, self.age, self.sequence = True, False, 255, 0
        self.estop = self.drive_fault = False
        self.force_missing = self.temperature_missing = self.velocity_missing = self.moment_missing = False
        self._damaged_since_state = False

    def take(self, data: bytes) -> Taken:
        """Read packets; the newest good command is in force from now on."""
        chunk, at, taken = np.frombuffer(data, np.uint8), 0, Taken()
        while True:
            at, length = next_packet(self._stream, chunk, at, len(chunk))
            if length == 0:
                return taken
            n = unseal(self._stream[0]["pending"], length, self._body)
            if n < 0:
                taken.damaged += 1
                self._damaged_since_state = True
            elif frame.decode_command(self._body, n, self._incoming):
                taken.commands += self._obey()
            elif frame.is_request(frame.TYPE_STOP, self._body, n):
                # whatever its sequence: a stop that comes late stops all the same
                taken.stops += 1
                self.hold()
            elif frame.is_request(frame.TYPE_IDENTIFY, self._body, n):
                taken.identifies += 1

    def _obey(self) -> int:
        """Put the incoming command in force; 0 if it is older than the one in force and would enable."""
        new, old = self._incoming[0], self.command[0]
        ahead = (int(new["sequence"]) - int(old["sequence"])) & 0xFFFF
        # a command that disables is obeyed however old it is: torque-free is safe at any time
        if not new["enable"]:
            self.held = self.expired = False
        elif not 0 < ahead < 0x8000:
            return 0
        self.command[:] = self._incoming
        self.age = 0
        return 1

    def hold(self) -> None:
        """Torque-free until a command with enable 0 comes."""
        self.held = True
        self.command["enable"] = 0
        self.command["value"] = 0

    def begin_cycle(self, cycles: int = 1) -> None:
        """Let `cycles` of the board's own clock pass: commands grow old."""
        # a byte on the wire: 255 says that or more
        self.age = min(self.age + cycles, 255)
        # once: held until a command with enable 0, so that torque does not come back with the next packet
        if self.age >= int(self.command[0]["time_to_live"]) and not self.expired:
            self.expired = True
            self.hold()

    @property
    def enabled(self) -> bool:
        """Whether the power stage drives the motor."""
        # asked when torque is wanted, not when a button is pressed: none of the three can be forgotten
        blocked = self.held or self.estop or self.drive_fault
        return bool(self.command[0]["enable"]) and not blocked

    @property
    def output(self) -> np.ndarray:
        """Value in force, A or N m by the command's mode, shape (n_axes,); zero unless enabled."""
        value = self.command[0]["value"].astype(float) / frame.MICRO
        return np.asarray(value) if self.enabled else np.zeros(self.n_axes)

    @property
    def status(self) -> Status:
        """The status bits as they would be sent now."""
        bits = (
            (Status.ENABLED, self.enabled),
            (Status.ESTOP, self.estop),
            (Status.DRIVE_FAULT, self.drive_fault),
            (Status.TTL_EXPIRED, self.expired),
            (Status.COMMAND_DAMAGED, self._damaged_since_state),
            (Status.TEMPERATURE_MISSING, self.temperature_missing),
            (Status.FORCE_MISSING, self.force_missing),
            (Status.HELD, self.held),
            (Status.VELOCITY_MISSING, self.velocity_missing),
            (Status.MOMENT_MISSING, self.moment_missing),
        )
        return Status(sum(int(bit) for bit, on in bits if on))

    def state_packet(self, tick: np.ndarray, counts: np.ndarray, time_us: int) -> bytes:
        """Packet with the measured fields of `tick` and encoder `counts`."""
        s = self._state[0]
        self.sequence = (self.sequence + 1) & 0xFFFF
        s["sequence"], s["time_us"], s["status"] = self.sequence, time_us & 0xFFFFFFFF, int(self.status)
        s["command_sequence"], s["command_age"] = self.command[0]["sequence"], self.age
        s["force_un"] = _wire(tick["force_n"][0], frame.MICRO, 31)
        s["position_counts"] = counts
        s["current_ua"] = _wire(tick["current_a"][0], frame.MICRO, 31)
        s["temperature_cdeg"] = _wire(tick["temperature_c"][0], 100, 15)
        if self._counts_per_rad is not None:
            s["has_velocity"] = 1
            s["velocity_dcounts_s"] = _wire(tick["device_velocity_rad_s"][0] * self._counts_per_rad, 10, 31)
        if self._moments:
            s["has_moment"], s["moment_unm"] = 1, _wire(tick["moment_nm"][0], frame.MICRO, 31)
        # told once: the host counts the packets that say so
        self._damaged_since_state = False
        return self._sealed(frame.encode_state(self._state, self._body))

    def identity_packet(self) -> bytes:
        """Answer to an identify packet."""
        record = records(np.zeros(1, frame.identity_dtype()))
        row = record[0]
        row["n_axes"], row["cycle_us"], row["firmware"] = self.n_axes, self.cycle_us, FIRMWARE_VERSION
        name = self.serial_number.encode("ascii")[: frame.SERIAL_NUMBER_BYTES]
        row["serial_number"][: len(name)] = np.frombuffer(name, np.uint8)
        return self._sealed(frame.encode_identity(record, self._body))

    def rehearse(self, tick: np.ndarray) -> None:
        """Go through everything once, so that all of it is compiled. The board is of no use afterwards."""
        command = self._sealed(frame.encode_command(self._incoming, self._body))
        self.take(command + request_packet(frame.TYPE_STOP) + self.identity_packet())
        self.state_packet(tick, np.zeros(self.n_axes, np.int64), 0)

    def _sealed(self, n: int) -> bytes:
        return self._packet[: seal(self._body, n, self._packet)].tobytes()


def _wire(values: np.ndarray, scale: int, bits: int) -> np.ndarray:
    """Values times `scale`, rounded, saturated to a signed number of that many bits besides the sign."""
    return np.asarray(np.clip(np.rint(values * scale), -(2**bits - 1), 2**bits - 1), np.int64)


def request_packet(kind: int, sequence: int = 0) -> bytes:
    """A stop or identify packet (`frame.TYPE_STOP`, `frame.TYPE_IDENTIFY`)."""
    body, packet = np.zeros(BODY_MAX + 8, np.uint8), np.zeros(PACKET_MAX, np.uint8)
    return packet[: request(kind, sequence, body, packet)].tobytes()
