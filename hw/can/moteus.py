"""moteus over CAN-FD: the codec (pure), and what it takes to arm and disarm one controller.

Identifier 0x8000 | source << 8 | destination asks for a reply, which has id << 8 | source. A frame is a row
of subframes, padded with 0x50 (mjbots' register protocol). Every command carries its own time to live
(register 0x27): the drive's watchdog, in mode "timeout" after it, needs no set-up.

    arm      the first frame of mode 10 (position) with kp and kd scaled to 0: pure feed-forward torque
    command  feed-forward torque, greatest torque and time to live, in every cycle; each is answered
    disarm   mode 0 (stopped), in every cycle; it also clears faults

Angles are turns and torques N m of moteus' output shaft: the motor's own unless rotor_to_output_ratio is set.
"""

from __future__ import annotations

import math
import struct
from dataclasses import replace

from hw.can.armed import Armed
from hw.can.bus import EXTENDED, Bus, Handler, wait_for
from hw.can.fields import Buffer, Field, byte_field
from hw.can.load import Traffic, fd_length
from hw.can.names import MOTEUS_FAULTS, MOTEUS_MODES, named
from hw.can.sample import Sample, Shaft
from hw.can.steady_records import LEAVES, NEVER, Command, Entry, Frame, Number
from hw.interface import BackendError, LinkFault, Options, Rig

STOPPED, FAULT, POSITION, TIMEOUT = 0, 1, 10, 11
SERIAL_NUMBER = 0x120
NOP = 0x50

QUERY = bytes([0x11, 0x00, 0x1F, 0x01, 0x1D, 0x04, 0x1D, 0x0E, 0x11, 0x0F])
"""Read: mode int8; position, velocity, torque f32; Q current f32; temperature f32; fault int8."""

COMMAND = bytes([0x01, 0x00, POSITION, 0x0C, 0x08, 0x20])
"""Mode, then eight floats from register 0x20."""
COMMAND_FLOATS = struct.Struct("<8f")
COMMAND_BYTES = len(COMMAND) + COMMAND_FLOATS.size + len(QUERY)

_TORQUE_AT = len(COMMAND) + 8
"""Where the feed-forward torque stands among them."""

STOP = bytes([0x01, 0x00, STOPPED])

_SIZES = {0: 1, 1: 2, 2: 4, 3: 4}
_CODES = {0: "b", 1: "<h", 2: "<i", 3: "<f"}

_REPLY = struct.Struct("<HbHfffHfHfHb")
_REPLY_HEADS = (0x0021, 0x012F, 0x042D, 0x0E2D, 0x0F21)
"""The reply to QUERY as the firmware lays it out, with its subframe heads; another layout is parsed slowly."""
_HEADS_AT, _TOLD_AT = (0, 3, 17, 23, 29), (2, 31)
"""Bytes of it: where its heads are; mode and fault."""
_PADDING = bytes([NOP]) * 64
"""What may follow it. Anything else may say something of the same registers, or be damage: that is parsed slowly, too."""

_REGISTERS = (0x000, 0x001, 0x002, 0x004, 0x00E, 0x00F)
ARM_S = 0.2
_DEVICE = int(LinkFault.DEVICE)


def command_id(node: int, source: int) -> int:
    """Identifier of a frame to `node` (1 to 127) that is to be answered."""
    return (0x8000 | source << 8 | node) | EXTENDED


def reply_ids(node: int, source: int) -> tuple[int, int]:
    """Identifier of the reply, as a standard and as an extended one: firmware may send either."""
    plain = node << 8 | source
    return (plain, plain | EXTENDED) if plain <= 0x7FF else (plain | EXTENDED, plain | EXTENDED)


def encode_command(
    buffer: bytearray, offset: int, torque_nm: float, torque_max_nm: float, ttl_s: float
) -> None:
    """Write the floats of a torque command into a frame made from `command_frame`."""
    nan = math.nan
    COMMAND_FLOATS.pack_into(
        buffer, offset + len(COMMAND), nan, 0.0, torque_nm, 0.0, 0.0, torque_max_nm, nan, ttl_s
    )  # position and stop position "not set"; velocity, kp and kd scale 0


def command_frame() -> bytes:
    """A torque command of 0 with the query, padded to a CAN-FD length."""
    whole = COMMAND + bytes(COMMAND_FLOATS.size) + QUERY
    return whole.ljust(fd_length(len(whole)), bytes([NOP]))


def stop_frame() -> bytes:
    """Stop (torque-free, faults cleared) with the query, padded."""
    whole = STOP + QUERY
    return whole.ljust(fd_length(len(whole)), bytes([NOP]))


def parse_reply(data: Buffer) -> dict[int, float] | None:
    """Registers of a reply by number, in native units of their type; None if it is not a whole reply."""
    found: dict[int, float] = {}
    at, end = 0, len(data)
    while at < end:
        head = data[at]
        if head == NOP:
            at += 1
            continue
        if not 0x20 <= head <= 0x2F or at + 1 >= end:
            return None
        at += 1
        kind, count = head >> 2 & 3, head & 3
        if count == 0:
            count = data[at]
            at += 1
            if count == 0:  # of no registers: nothing follows
                continue
        if at >= end or count > 64:
            return None
        register, at = data[at], at + 1
        if register & 0x80:  # two bytes of register number
            if at >= end or data[at] & 0x80:
                return None
            register, at = register & 0x7F | data[at] << 7, at + 1
        size = _SIZES[kind]
        if at + size * count > end:
            return None
        for k in range(count):
            found[register + k] = struct.unpack_from(_CODES[kind], data, at + k * size)[0]
        at += size * count
    return found


def decode_reply(
    buffer: Buffer, offset: int, length: int
) -> tuple[int, float, float, float, float, int] | None:
    """Mode, position (turns), velocity (turns/s), Q current (A), temperature (degC), fault; None if any is missing.

    A register that reads as integer is taken only where it was asked for as one (mode, fault).
    """
    if length >= _REPLY.size:
        h0, mode, h1, position, velocity, _, h2, current, h3, temperature, h4, fault = _REPLY.unpack_from(
            buffer, offset
        )
        rest = length - _REPLY.size
        if (h0, h1, h2, h3, h4) == _REPLY_HEADS and (
            buffer[offset + _REPLY.size : offset + length] == _PADDING[:rest]
        ):
            return mode, position, velocity, current, temperature, fault
    found = parse_reply(buffer[offset : offset + length])
    if found is None or not all(register in found for register in _REGISTERS):
        return None
    mode, position, velocity, current, temperature, fault = (found[register] for register in _REGISTERS)
    if not all(isinstance(value, float) for value in (position, velocity, current, temperature)):
        return None
    if not (isinstance(mode, int) and isinstance(fault, int)):
        return None
    return mode, position, velocity, current, temperature, fault


def traffic(options: Options, rate_hz: float) -> list[Traffic]:
    """All frames of the drives."""
    frames = []
    for table in options["axis"]:
        name = f"node {table['node']}"
        frames.append(Traffic(f"{name} command", len(command_frame()), rate_hz, extended=True, fd=True))
        frames.append(Traffic(f"{name} reply", fd_length(_REPLY.size), rate_hz, extended=True, fd=True))
    return frames


class MoteusAxis:
    """One moteus controller on the bus."""

    def __init__(self, table: Options, options: Options, rig: Rig, axis: int, sample: Sample) -> None:
        self.node, self._axis, self._sample = int(table["node"]), axis, sample
        self._source = int(options["source"])
        self._shaft = Shaft(table, rig, axis)
        self._bit = sample.need()
        self._ttl_s = 1e-3 * float(options["time_to_live_ms"])
        self._torque_max_nm = abs(self._shaft.current_max_a * self._shaft.torque_per_ampere)
        self._armed = Armed(round(ARM_S / rig.period_s))
        self.mode = self.fault = 0
        self.identity = b""

    @staticmethod
    def measures(options: Options) -> set[str]:
        """See `Drive`."""
        del options
        return {"velocity", "temperature"}

    def handlers(self) -> dict[int, Handler]:
        """What to do with this axis' frames."""
        return dict.fromkeys(reply_ids(self.node, self._source), self._on_reply)

    def steady_frames(self) -> list[Frame]:
        """See `Drive`. A reply is for Python unless it is laid out as `_REPLY`, and tells the mode and fault it told before."""
        size, at, axis, shaft = _REPLY.size, self._sample.start, self._axis, self._shaft

        def _float(byte: int, channel: str, scale: float = 1.0, offset: float = 0.0) -> Number:
            return Number(Field(size, 8 * byte, 32, "little", "float", scale, offset), at[channel] + axis)

        numbers = [
            _float(5, "position", shaft.rad_per_turn, shaft.offset_rad),
            _float(9, "velocity", shaft.rad_per_turn),
            _float(19, "current", shaft.direction),
            _float(25, "temperature"),
        ]
        heads = zip(_REPLY_HEADS, _HEADS_AT, strict=True)
        guards = [Number(byte_field(size, byte, 16), wanted=head, says=LEAVES) for head, byte in heads]
        told = (lambda: self.mode if self._armed.said is not None else NEVER, lambda: self.fault)
        for byte, wanted in zip(_TOLD_AT, told, strict=True):
            guards.append(Number(byte_field(size, byte, 8, kind="int"), wanted=wanted, says=LEAVES))
        return [
            Frame(key, size, [*map(replace, numbers)], [*map(replace, guards)], self._bit, leaves_length=True)
            for key in dict.fromkeys(reply_ids(self.node, self._source))
        ]

    def steady_commands(self, current_at: int) -> list[Command]:
        """See `Drive`."""
        armed, shaft = self._armed, self._shaft
        if not armed.wanted or armed.dropped:
            return [Command(self._stop)]
        bits = byte_field(self._command.length, _TORQUE_AT, 32, kind="float")
        entry = Entry(bits, current_at, shaft.torque_per_ampere, shaft.current_max_a)
        return [Command(self._command, [entry])]

    def alike(self) -> int:
        """See `Drive`."""
        return self._armed.spare if self._armed.said is not None else 0

    def pass_by(self, cycles: int) -> None:
        """See `Drive`."""
        self._armed.ticks += cycles

    def _on_reply(self, buffer: Buffer, offset: int, length: int) -> None:
        values = decode_reply(buffer, offset, length)
        if values is None:
            if not self._on_identity(buffer, offset, length):
                self._sample.damaged()
            return
        self.mode, position, velocity, current, temperature, self.fault = values
        self._armed.saw(self.mode == POSITION)
        finite = position + velocity + current + temperature  # NaN or infinite if one of them is
        if finite - finite != 0.0:
            self._sample.not_finite()
            return
        sample, shaft, axis = self._sample, self._shaft, self._axis
        sample.position_rad[axis] = position * shaft.rad_per_turn + shaft.offset_rad
        sample.velocity_rad_s[axis] = velocity * shaft.rad_per_turn
        sample.current_a[axis] = shaft.direction * current
        sample.temperature_c[axis] = temperature
        sample.fresh |= self._bit

    def _on_identity(self, buffer: Buffer, offset: int, length: int) -> bool:
        found = parse_reply(buffer[offset : offset + length])
        if found is None or SERIAL_NUMBER not in found:
            return False
        words = [int(found.get(SERIAL_NUMBER + k, 0)) & 0xFFFF_FFFF for k in range(3)]
        self.identity = struct.pack("<3I", *words)
        return True

    def set_up(self, bus: Bus) -> None:
        """Stop it, learn its serial number and state. Blocks; before the loop only."""
        self.identity = b""
        to = command_id(self.node, self._source)
        self._command, self._stop = (
            bus.outgoing(to, len(command_frame())),
            bus.outgoing(to, len(stop_frame())),
        )
        for frame, content in ((self._command, command_frame()), (self._stop, stop_frame())):
            frame.buffer[frame.offset : frame.offset + frame.length] = content
        ask = bus.outgoing(to, 8)
        ask.buffer[ask.offset : ask.offset + 8] = bytes([0x1B, 0xA0, 0x02]).ljust(8, bytes([NOP]))
        bus.send(ask)
        wait_for(bus, lambda: bool(self.identity), 0.2)
        bus.send(self._stop)
        if not wait_for(bus, lambda: bool(self._sample.fresh & self._bit), 1.0):
            raise BackendError(
                f"moteus id {self.node}: no reply within 1 s: check power, wiring and termination, the id, and the bus: "
                "CAN-FD at 1 / 5 Mbit/s with bit-rate switching (slcan adapters cannot do that)"
            )

    def prime(self, bus: Bus) -> None:
        """Stopped, and ask for feedback."""
        bus.send(self._stop)

    def write(self, bus: Bus, current_a: float, enabled: bool) -> None:
        """Send this cycle's torque with its time to live, or stop."""
        if not self._armed.order(enabled):
            bus.send(self._stop)
            return
        torque_nm = self._shaft.limited(current_a) * self._shaft.torque_per_ampere
        frame = self._command
        encode_command(frame.buffer, frame.offset, torque_nm, self._torque_max_nm, self._ttl_s)
        bus.send(frame)

    def link_faults(self) -> int:
        """DEVICE: fault, out of position mode again (its time to live was over), or never in it."""
        return _DEVICE if self.mode == FAULT or self._armed.ill else 0

    def status(self) -> str:
        """What the drive says about itself."""
        return f"id {self.node}: mode {named(self.mode, MOTEUS_MODES)}" + (
            f", fault {named(self.fault, MOTEUS_FAULTS)}" if self.fault else ""
        )

    def stop(self, bus: Bus) -> None:
        """Mode stopped."""
        self._armed.order(False)
        bus.send(self._stop)
