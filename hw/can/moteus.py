"""What it takes to arm and disarm one moteus over CAN-FD, and to hear it (`hw.can.moteus_codec` has the
frames).

Every command carries its own time to live (register 0x27): the drive's watchdog, in mode "timeout" after it,
needs no set-up.

    arm      the first frame of mode 10 (position) with kp and kd scaled to 0: pure feed-forward torque
    command  feed-forward torque, greatest torque and time to live, in every cycle; each is answered
    disarm   mode 0 (stopped), in every cycle; it also clears faults"""

from __future__ import annotations

import struct
from dataclasses import replace

from hw.can.armed import Armed
from hw.can.bus import Bus, Handler, wait_for
from hw.can.fields import Buffer, Field, byte_field
from hw.can.moteus_codec import (
    FAULT,
    HEADS_AT,
    NOP,
    POSITION,
    REPLY,
    REPLY_HEADS,
    SERIAL_NUMBER,
    TOLD_AT,
    TORQUE_AT,
    command_frame,
    command_id,
    decode_reply,
    encode_command,
    parse_reply,
    reply_ids,
    stop_frame,
)
from hw.can.names import MOTEUS_FAULTS, MOTEUS_MODES, named
from hw.can.sample import Sample, Shaft
from hw.can.steady_records import LEAVES, NEVER, Command, Entry, Frame, Number
from hw.interface import BackendError, LinkFault, Options, Rig

# between stopped and position a drive passes mode 2 (enabling)
ARM_S = 0.2
_DEVICE = int(LinkFault.DEVICE)


class MoteusAxis:
    """One moteus controller on the bus."""

    def __init__(self, table: Options, options: Options, rig: Rig, axis: int, sample: Sample) -> None:
        self.node, self._axis, self._sample = int(table["node"]), axis, sample
        self._source = int(options["source"])
        self._shaft = Shaft(table, rig, axis)
        # one for all: a moteus answers with everything in one frame
        self._bit = sample.need()
        self._ttl_s = 1e-3 * float(options["time_to_live_ms"])
        # the drive's own limit in each command, too: a damaged feed-forward torque would meet it
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
        # both, for either kind of identifier may come; below id 8 they differ, from there on it is one
        return dict.fromkeys(reply_ids(self.node, self._source), self._on_reply)

    def steady_frames(self) -> list[Frame]:
        """See `Drive`. A reply is for Python unless it is laid out as `REPLY`, and tells the mode and fault
        it told before."""
        size, at, axis, shaft = REPLY.size, self._sample.start, self._axis, self._shaft

        def _float(byte: int, channel: str, scale: float = 1.0, offset: float = 0.0) -> Number:
            return Number(Field(size, 8 * byte, 32, "little", "float", scale, offset), at[channel] + axis)

        numbers = [
            _float(5, "position", shaft.rad_per_turn, shaft.offset_rad),
            _float(9, "velocity", shaft.rad_per_turn),
            _float(19, "current", shaft.direction),
            _float(25, "temperature"),
        ]
        heads = zip(REPLY_HEADS, HEADS_AT, strict=True)
        guards = [Number(byte_field(size, byte, 16), wanted=head, says=LEAVES) for head, byte in heads]
        told = (lambda: self.mode if self._armed.said is not None else NEVER, lambda: self.fault)
        for byte, wanted in zip(TOLD_AT, told, strict=True):
            guards.append(Number(byte_field(size, byte, 8, kind="int"), wanted=wanted, says=LEAVES))
        return [
            Frame(key, size, [*map(replace, numbers)], [*map(replace, guards)], self._bit, leaves_length=True)
            # a row each, numbers and guards too: a row of compiled cycles has one place in their tables
            for key in dict.fromkeys(reply_ids(self.node, self._source))
        ]

    def steady_commands(self, current_at: int) -> list[Command]:
        """See `Drive`."""
        armed, shaft = self._armed, self._shaft
        if not armed.wanted or armed.dropped:
            return [Command(self._stop)]
        # the torque alone changes from cycle to cycle; mode, limits and life were written by `encode_command`
        bits = byte_field(self._command.length, TORQUE_AT, 32, kind="float")
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
        # the mode before the numbers: a drive in fault may tell NaN, and its fault must be known
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
        # int32 in the reply: without the mask a high bit would be a negative number, which `I` refuses
        words = [int(found.get(SERIAL_NUMBER + k, 0)) & 0xFFFF_FFFF for k in range(3)]
        self.identity = struct.pack("<3I", *words)
        return True

    def make_frames(self, bus: Bus) -> None:
        """See Drive."""
        to = command_id(self.node, self._source)
        self._command, self._stop = (
            bus.outgoing(to, len(command_frame())),
            bus.outgoing(to, len(stop_frame())),
        )
        for frame, content in ((self._command, command_frame()), (self._stop, stop_frame())):
            frame.buffer[frame.offset : frame.offset + frame.length] = content

    def set_up(self, bus: Bus) -> None:
        """Stop it, learn its serial number and state. Blocks; before the loop only."""
        self.make_frames(bus)
        self.identity = b""
        ask = bus.outgoing(command_id(self.node, self._source), 8)
        # 0x1B: read three int32; 0xA0 0x02: from register 0x120, the serial number, as varuint
        ask.buffer[ask.offset : ask.offset + 8] = bytes([0x1B, 0xA0, 0x02]).ljust(8, bytes([NOP]))
        # once and no more: firmware that does not tell it is no fault, it is only not known again
        bus.send(ask)
        wait_for(bus, lambda: bool(self.identity), 0.2)
        # stopped, and asked in one frame: a drive that somebody left in position mode lets go now
        bus.send(self._stop)
        if not wait_for(bus, lambda: bool(self._sample.fresh & self._bit), 1.0):
            raise BackendError(
                f"moteus id {self.node}: no reply within 1 s: check power, wiring and termination, the id, "
                "and the bus: CAN-FD at 1 / 5 Mbit/s with bit-rate switching (slcan adapters cannot do "
                "that)"
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
