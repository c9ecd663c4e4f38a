"""Arms, disarms and hears one axis of an ODrive over CAN Simple (`hw.can.odrive_codec` has the frames).

arm      Set_Controller_Mode (torque, pass-through), Clear_Errors, Set_Axis_State 8
command  Set_Input_Torque in every cycle, armed or not: it feeds the drive's watchdog
disarm   torque 0, Set_Axis_State 1"""

from __future__ import annotations

import math

from hw.can import odrive_codec as codec
from hw.can.armed import UNBOUNDED, Armed
from hw.can.bus import Bus, Handler, twice_within, wait_for
from hw.can.fields import Buffer, Field, byte_field
from hw.can.names import ODRIVE_STATES, named
from hw.can.odrive_codec import CLOSED_LOOP, IDLE, PAIR, can_id, decode_heartbeat, decode_pair, error_names
from hw.can.odrive_firmware import ADDRESS as ADDRESS_SINCE
from hw.can.odrive_firmware import NAMED_ERRORS, OLD, Version, decode_version, version_text
from hw.can.odrive_frames import OdriveFrames
from hw.can.sample import Sample, Shaft
from hw.can.silence import Silence, longest_s
from hw.can.steady_records import Command, Entry, Frame, Number
from hw.interface import BackendError, LinkFault, Options, Rig

ARM_S = 0.5
"""Longest time from Set_Axis_State 8 to a heartbeat that shows it."""
ADDRESS_S = 0.2
"""Longest wait for the serial number."""
VERSION_S, VERSION_ASKED = 0.05, 3
"""Longest wait for the firmware's version, and how often it is asked."""
RETRY_S = 0.1
"""While disarmed: a drive still in closed loop is told again, one with errors is asked to clear them."""

_DEVICE, _LOST = int(LinkFault.DEVICE), int(LinkFault.LOST)


class OdriveAxis:
    """One ODrive axis on the bus."""

    def __init__(self, table: Options, options: Options, rig: Rig, axis: int, sample: Sample) -> None:
        self.node, self._axis, self._sample = int(table["node"]), axis, sample
        self._shaft = Shaft(table, rig, axis)
        self._encoder_bit, self._iq_bit = sample.need(), sample.need()
        self._request = options["feedback"] == "request"
        self._remote = not options.get("bus", {}).get("fd")  # CAN FD has none: an empty frame asks there
        beat_s = 1e-3 * float(options["heartbeat_ms"])
        # the state comes with a heartbeat: two may pass before it tells
        self._armed = Armed(round(ARM_S / rig.period_s) + round(2 * beat_s / rig.period_s))
        self._silence_s = longest_s(beat_s, rig.period_s)
        self._beat = Silence.of(beat_s, rig.period_s)
        self._heat: Silence | None = None
        if options.get("temperature_ms"):
            self._heat = Silence.of(1e-3 * float(options["temperature_ms"]), rig.period_s)
            # none yet: 0 would be a motor that is cold, and may have all its torque
            sample.temperature_c[axis] = math.nan
        self._beat_ms = 1e3 * beat_s
        self._retry_ticks = max(1, round(RETRY_S / rig.period_s))
        self._on = False
        self._beats = 0
        self.error = self.state = 0
        self.identity: bytes = b""
        self.version: Version = NAMED_ERRORS

    @staticmethod
    def measures(options: Options) -> set[str]:
        """See `Drive`."""
        return {"velocity", "temperature"} if options["temperature_ms"] else {"velocity"}

    def handlers(self) -> dict[int, Handler]:
        """What to do with this axis' frames."""
        return {
            can_id(self.node, codec.GET_ENCODER): self._on_encoder,
            can_id(self.node, codec.GET_IQ): self._on_iq,
            can_id(self.node, codec.GET_TEMPERATURE): self._on_temperature,
            can_id(self.node, codec.HEARTBEAT): self._on_heartbeat,
            can_id(self.node, codec.ADDRESS): self._on_address,
            can_id(self.node, codec.GET_VERSION): self._on_version,
        }

    def steady_frames(self) -> list[Frame]:
        """See `Drive`."""
        at, shaft = self._sample.start, self._shaft

        def _float(byte: int, channel: str, scale: float, offset: float = 0.0) -> Number:
            bits = Field(8, 8 * byte, 32, "little", "float", scale, offset)
            return Number(bits, at[channel] + self._axis)

        angle = _float(0, "position", shaft.rad_per_turn, shaft.offset_rad)
        measured = {
            codec.GET_ENCODER: ([angle, _float(4, "velocity", shaft.rad_per_turn)], self._encoder_bit),
            codec.GET_IQ: ([_float(4, "current", shaft.direction)], self._iq_bit),
        }
        others = (codec.HEARTBEAT, codec.GET_TEMPERATURE, codec.ADDRESS, codec.GET_VERSION)
        return [
            Frame(can_id(self.node, command), 8, numbers, bit=bit)
            for command, (numbers, bit) in measured.items()
        ] + [Frame(can_id(self.node, command)) for command in others]

    def steady_commands(self, current_at: int) -> list[Command]:
        """See `Drive`."""
        shaft, torque = self._shaft, Command(self._out.torque)
        if self._on and self.state == CLOSED_LOOP:
            bits = byte_field(4, 0, 32, kind="float")
            torque.entries = [Entry(bits, current_at, shaft.torque_per_ampere, shaft.current_max_a)]
        asked = (self._out.ask_encoder, self._out.ask_iq) if self._request else ()
        return [torque, *(Command(frame) for frame in asked)]

    def alike(self) -> int:
        """See `Drive`."""
        armed, cycles = self._armed, self._armed.spare
        cycles = min(cycles, self._beat.spare, UNBOUNDED if self._heat is None else self._heat.spare)
        if not armed.wanted and (self.error or self.state == CLOSED_LOOP):  # said again soon
            cycles = min(cycles, self._retry_ticks - armed.ticks % self._retry_ticks - 1)
        return cycles if self._on == (armed.wanted and not armed.dropped) else 0

    def pass_by(self, cycles: int) -> None:
        """See `Drive`."""
        self._armed.ticks += cycles
        self._beat.cycles += cycles
        if self._heat is not None:
            self._heat.cycles += cycles

    def _on_encoder(self, buffer: Buffer, offset: int, length: int) -> None:
        if length != 8:
            self._sample.damaged()
            return
        turns, speed = PAIR.unpack_from(buffer, offset)
        if turns - turns != 0.0 or speed - speed != 0.0:  # NaN or infinite
            self._sample.not_finite()
            return
        self._sample.position_rad[self._axis] = turns * self._shaft.rad_per_turn + self._shaft.offset_rad
        self._sample.velocity_rad_s[self._axis] = speed * self._shaft.rad_per_turn
        self._sample.fresh |= self._encoder_bit

    def _on_iq(self, buffer: Buffer, offset: int, length: int) -> None:
        if length != 8:
            self._sample.damaged()
            return
        current = PAIR.unpack_from(buffer, offset)[1]
        if current - current != 0.0:
            self._sample.not_finite()
            return
        self._sample.current_a[self._axis] = self._shaft.direction * current
        self._sample.fresh |= self._iq_bit

    def _on_temperature(self, buffer: Buffer, offset: int, length: int) -> None:
        pair = decode_pair(buffer, offset, length)
        if pair is not None and self._heat is not None:
            self._sample.temperature_c[self._axis] = pair[1]
            self._heat.cycles = 0

    def _on_heartbeat(self, buffer: Buffer, offset: int, length: int) -> None:
        beat = decode_heartbeat(buffer, offset, length)
        if beat is not None:
            self.error, self.state = beat
            self._beat.cycles = 0
            self._beats += 1
            self._armed.saw(self.state == CLOSED_LOOP)

    def _on_address(self, buffer: Buffer, offset: int, length: int) -> None:
        if length >= 7:  # node, serial number of 6 bytes, connection
            self.identity = bytes(buffer[offset + 1 : offset + 7])

    def _on_version(self, buffer: Buffer, offset: int, length: int) -> None:
        self.version = decode_version(buffer, offset, length) or self.version

    def set_up(self, bus: Bus) -> None:
        """Disarm, learn its firmware, choose torque control, hear every kind of frame. Blocks."""
        self.make_frames(bus)
        self.identity, self.version, self._beats = b"", OLD, 0
        self.stop(bus)
        for frame in (self._out.ask_version, self._out.mode, self._out.clear):
            bus.send(frame)
        self._hear_beat(bus)
        self._learn(bus)
        self.prime(bus)
        if not wait_for(bus, self._heard, 1.0):
            raise BackendError(
                f"odrive node {self.node}: no encoder estimates or no Iq within 1 s: set "
                "encoder_msg_rate_ms and iq_msg_rate_ms of <axis>.config.can to the loop's period, or "
                "feedback = 'request' here (firmware 0.5 sends no Iq by itself)"
            )

    def _hear_beat(self, bus: Bus) -> None:
        """Wait for two heartbeats, the second as soon after the first as the loop wants it."""
        if wait_for(bus, twice_within(lambda: self._beats, self._silence_s), max(1.0, 3e-3 * self._beat_ms)):
            return
        if self._beats == 0:
            raise BackendError(
                f"odrive node {self.node}: no heartbeat within 1 s: check power, wiring and termination, "
                "node id, the bus' bit rate, and can.config.heartbeat_msg_rate_ms on the drive"
            )
        raise BackendError(
            f"odrive node {self.node}: no two heartbeats within {1e3 * self._silence_s:g} ms, but "
            f"heartbeat_ms is {self._beat_ms:g}: they tell that the drive has let go, so set "
            f"heartbeat_msg_rate_ms of <axis>.config.can on the drive to {self._beat_ms:g} (firmware 0.5: "
            "heartbeat_rate_ms)"
        )

    def _learn(self, bus: Bus) -> None:
        """Firmware, and serial number where asking for it means nothing else."""
        for _ in range(VERSION_ASKED):
            if wait_for(bus, lambda: self.version != OLD, VERSION_S):
                break
            bus.send(self._out.ask_version)
        if self.version >= ADDRESS_SINCE:
            bus.send(self._out.ask_address)
            wait_for(bus, lambda: bool(self.identity), ADDRESS_S)
        if self._heat is not None and self.version < NAMED_ERRORS:
            raise BackendError(
                f"odrive node {self.node}: firmware {version_text(self.version)} sends no temperature, "
                "another value has its command: temperature_ms = 0 in [device.options]"
            )

    def prime(self, bus: Bus) -> None:
        """Ask for feedback where the drive does not send it by itself."""
        if self._request:
            bus.send(self._out.ask_encoder)
            bus.send(self._out.ask_iq)

    def _heard(self) -> bool:
        both = self._encoder_bit | self._iq_bit
        return self._sample.fresh & both == both

    def make_frames(self, bus: Bus) -> None:
        """See Drive."""
        self._out = OdriveFrames(bus, self.node, remote=self._remote)

    def write(self, bus: Bus, current_a: float, enabled: bool) -> None:
        """Send this cycle's torque; arm or disarm when `enabled` changes."""
        on = self._armed.order(enabled)
        if on != self._on:
            self._switch(bus, on)
        self._age()
        driving = on and self.state == CLOSED_LOOP
        wanted_nm = self._shaft.limited(current_a) * self._shaft.torque_per_ampere if driving else 0.0
        self._out.send_torque(bus, wanted_nm)
        if not enabled and self._armed.ticks % self._retry_ticks == 0:
            self._quieten(bus)
        if self._request:
            bus.send(self._out.ask_encoder)
            bus.send(self._out.ask_iq)

    def _age(self) -> None:
        """One cycle more since heartbeat and temperature came."""
        self._beat.cycles += 1
        if self._heat is not None:
            self._heat.cycles += 1
            # no part of a sample: its silence would leave the last one standing, cool, while the motor heats
            if self._heat.is_over_long:
                self._sample.temperature_c[self._axis] = math.nan

    def _switch(self, bus: Bus, on: bool) -> None:
        self._on = on
        if on:
            self.state = 0  # what it said before is no answer to this
            bus.send(self._out.mode)
            bus.send(self._out.clear)
        self._out.send_state(bus, CLOSED_LOOP if on else IDLE)

    def _quieten(self, bus: Bus) -> None:
        """Disarmed: what the drive should have heard is said again."""
        if self.state == CLOSED_LOOP:
            self._out.send_state(bus, IDLE)
        if self.error:
            bus.send(self._out.clear)

    def link_faults(self) -> int:
        """DEVICE: an error, out of closed loop again, or never in it; LOST: no heartbeat."""
        faults = 0
        if self.error or self._armed.ill:
            faults |= _DEVICE
        if self._beat.is_over_long:
            faults |= _LOST
        return faults

    def status(self) -> str:
        """What the drive says about itself."""
        return f"node {self.node}: state {named(self.state, ODRIVE_STATES)}" + (
            f", {error_names(self.error, self.version)}" if self.error else ""
        )

    def stop(self, bus: Bus) -> None:
        """Torque 0 and idle."""
        self._on = self._armed.order(False)
        self._out.send_torque(bus, 0.0)
        self._out.send_state(bus, IDLE)
