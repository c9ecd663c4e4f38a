"""ODrive over CAN Simple: the codec (pure), and what it takes to arm and disarm one axis.

Identifier = node << 5 | command, little endian, 11 bits. Layouts from ODrive's CAN protocol page and DBC
(firmware 0.6). Angles are turns of the encoder's shaft, torques N m at it.

    arm      Set_Controller_Mode (torque, pass-through), Clear_Errors, Set_Axis_State 8
    command  Set_Input_Torque in every cycle, armed or not: it feeds the drive's watchdog
    disarm   torque 0, Set_Axis_State 1
"""

from __future__ import annotations

import math
import struct
from typing import Any

from hw.can.bus import REMOTE, Bus, Handler, wait_for
from hw.can.fields import Buffer
from hw.can.load import Traffic
from hw.can.names import ODRIVE_STATES, named
from hw.can.sample import Sample, Shaft
from hw.interface import BackendError, LinkFault, Options, Rig

HEARTBEAT, GET_VERSION, GET_ERROR, ADDRESS, SET_AXIS_STATE = 0x01, 0x00, 0x03, 0x06, 0x07
GET_ENCODER, SET_CONTROLLER_MODE, SET_INPUT_TORQUE = 0x09, 0x0B, 0x0E
GET_IQ, GET_TEMPERATURE, CLEAR_ERRORS = 0x14, 0x15, 0x18
IDLE, CLOSED_LOOP = 1, 8
TORQUE_CONTROL, PASS_THROUGH = 1, 1

ERRORS = {
    0x1: "INITIALIZING", 0x2: "SYSTEM_LEVEL", 0x4: "TIMING_ERROR", 0x8: "MISSING_ESTIMATE", 0x10: "BAD_CONFIG",
    0x20: "DRV_FAULT", 0x40: "MISSING_INPUT", 0x100: "DC_BUS_OVER_VOLTAGE", 0x200: "DC_BUS_UNDER_VOLTAGE",
    0x400: "DC_BUS_OVER_CURRENT", 0x800: "DC_BUS_OVER_REGEN_CURRENT", 0x1000: "CURRENT_LIMIT_VIOLATION",
    0x2000: "MOTOR_OVER_TEMP", 0x4000: "INVERTER_OVER_TEMP", 0x8000: "VELOCITY_LIMIT_VIOLATION",
    0x10000: "POSITION_LIMIT_VIOLATION", 0x1000000: "WATCHDOG_TIMER_EXPIRED", 0x2000000: "ESTOP_REQUESTED",
    0x4000000: "SPINOUT_DETECTED", 0x8000000: "BRAKE_RESISTOR_DISARMED", 0x10000000: "THERMISTOR_DISCONNECTED",
    0x40000000: "CALIBRATION_ERROR",
}  # fmt: skip

PAIR = struct.Struct("<ff")
HEARTBEAT_STRUCT = struct.Struct("<IBBB")
TORQUE = struct.Struct("<f")
WORD = struct.Struct("<I")
TWO_WORDS = struct.Struct("<II")

ARM_S = 0.5
"""Longest time from Set_Axis_State 8 to a heartbeat that shows it."""
ADDRESS_S = 0.2
"""Longest wait for the serial number."""
RETRY_S = 0.1
"""While disarmed: a drive still in closed loop is told again, one with errors is asked to clear them."""

_DEVICE, _LOST = int(LinkFault.DEVICE), int(LinkFault.LOST)


def can_id(node: int, command: int) -> int:
    """Identifier of a command of a node (0 to 63)."""
    return node << 5 | command


def error_names(error: int) -> str:
    """The error bits in ODrive's words."""
    return ", ".join(name for bit, name in ERRORS.items() if error & bit) or f"0x{error:x}"


def decode_pair(buffer: Buffer, offset: int, length: int) -> tuple[float, float] | None:
    """Two finite numbers of a frame of 8 bytes: turns and turns/s, wanted and measured A, FET and motor degC."""
    if length != 8:
        return None
    first, second = PAIR.unpack_from(buffer, offset)
    return (first, second) if math.isfinite(first) and math.isfinite(second) else None


def decode_heartbeat(buffer: Buffer, offset: int, length: int) -> tuple[int, int] | None:
    """Axis error bits and axis state; None for a frame too short."""
    if length < 7:
        return None
    error, state, _, _ = HEARTBEAT_STRUCT.unpack_from(buffer, offset)
    return error, state


def traffic(options: Options, rate_hz: float) -> list[Traffic]:
    """All frames of the drives."""
    frames = []
    for table in options["axis"]:
        name = f"node {table['node']}"
        asked = options["feedback"] == "request"
        feedback_hz = rate_hz if asked else 1000.0 / options["feedback_ms"]
        frames += [
            Traffic(f"{name} torque", 4, rate_hz),
            Traffic(f"{name} encoder estimates", 8, feedback_hz),
            Traffic(f"{name} Iq", 8, feedback_hz),
            Traffic(f"{name} heartbeat", 8, 1000.0 / options["heartbeat_ms"]),
        ]
        if options["temperature_ms"]:
            frames.append(Traffic(f"{name} temperature", 8, 1000.0 / options["temperature_ms"]))
        if asked:
            frames += [Traffic(f"{name} requests", 0, 2 * rate_hz, remote=True)]
    return frames


class OdriveAxis:
    """One ODrive axis on the bus."""

    def __init__(self, table: Options, options: Options, rig: Rig, axis: int, sample: Sample) -> None:
        self.node, self._axis, self._sample = int(table["node"]), axis, sample
        self._shaft = Shaft(table, rig, axis)
        self._encoder_bit, self._iq_bit = sample.need(), sample.need()
        self._request = options["feedback"] == "request"
        self._arm_ticks = round(ARM_S / rig.period_s) + round(2e-3 * options["heartbeat_ms"] / rig.period_s)
        self._heartbeat_ticks = round(max(0.2, 5e-3 * options["heartbeat_ms"]) / rig.period_s)
        self._retry_ticks = max(1, round(RETRY_S / rig.period_s))
        self._enabled = False
        self._armed_for = self._silent_for = 0
        self.error = self.state = 0
        self.identity: bytes = b""
        self._seen_heartbeat = False

    def handlers(self) -> dict[int, Handler]:
        """What to do with this axis' frames."""
        return {
            can_id(self.node, GET_ENCODER): self._on_encoder,
            can_id(self.node, GET_IQ): self._on_iq,
            can_id(self.node, GET_TEMPERATURE): self._on_temperature,
            can_id(self.node, HEARTBEAT): self._on_heartbeat,
            can_id(self.node, ADDRESS): self._on_address,
        }

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
        if pair is not None:
            self._sample.temperature_c[self._axis] = pair[1]

    def _on_heartbeat(self, buffer: Buffer, offset: int, length: int) -> None:
        beat = decode_heartbeat(buffer, offset, length)
        if beat is not None:
            self.error, self.state = beat
            self._silent_for = 0
            self._seen_heartbeat = True

    def _on_address(self, buffer: Buffer, offset: int, length: int) -> None:
        if length >= 7:  # node, serial number of 6 bytes, connection
            self.identity = bytes(buffer[offset + 1 : offset + 7])

    def set_up(self, bus: Bus) -> None:
        """Disarm, choose torque control, and hear every kind of frame once. Blocks; before the loop only."""
        self._make_frames(bus)
        self.identity, self._seen_heartbeat = b"", False
        self.stop(bus)
        bus.send(self._mode)
        bus.send(self._clear)
        bus.send(self._ask_address)
        if not wait_for(bus, lambda: self._seen_heartbeat, 1.0):
            raise BackendError(
                f"odrive node {self.node}: no heartbeat within 1 s: check power, wiring and termination, node id, "
                "the bus' bit rate, and can.config.heartbeat_msg_rate_ms on the drive"
            )
        wait_for(bus, lambda: bool(self.identity), ADDRESS_S)  # older firmware has no Address: unknown then
        self.prime(bus)
        if not wait_for(bus, self._heard, 1.0):
            raise BackendError(
                f"odrive node {self.node}: no encoder estimates or no Iq within 1 s: set encoder_msg_rate_ms and "
                "iq_msg_rate_ms of <axis>.config.can to the loop's period, or feedback = 'request' here"
            )

    def prime(self, bus: Bus) -> None:
        """Ask for feedback where the drive does not send it by itself."""
        if self._request:
            bus.send(self._ask_encoder)
            bus.send(self._ask_iq)

    def _heard(self) -> bool:
        both = self._encoder_bit | self._iq_bit
        return self._sample.fresh & both == both

    def _make_frames(self, bus: Bus) -> None:
        def _frame(command: int, length: int, *, remote: bool = False) -> Any:  # noqa: ANN401
            return bus.outgoing(can_id(self.node, command) | (REMOTE if remote else 0), length)

        self._torque = _frame(SET_INPUT_TORQUE, 4)
        self._state = _frame(SET_AXIS_STATE, 4)
        self._mode = _frame(SET_CONTROLLER_MODE, 8)
        TWO_WORDS.pack_into(self._mode.buffer, self._mode.offset, TORQUE_CONTROL, PASS_THROUGH)
        self._clear = _frame(CLEAR_ERRORS, 1)
        self._ask_encoder, self._ask_iq = (_frame(c, 0, remote=True) for c in (GET_ENCODER, GET_IQ))
        self._ask_address = _frame(ADDRESS, 0, remote=True)

    def _request_state(self, bus: Bus, state: int) -> None:
        WORD.pack_into(self._state.buffer, self._state.offset, state)
        bus.send(self._state)

    def write(self, bus: Bus, current_a: float, enabled: bool) -> None:
        """Send this cycle's torque; arm or disarm when `enabled` changes."""
        if enabled != self._enabled:
            self._switch(bus, enabled)
        self._armed_for += 1
        self._silent_for += 1
        torque = self._torque
        armed = enabled and self.state == CLOSED_LOOP
        wanted_nm = self._shaft.limited(current_a) * self._shaft.torque_per_ampere if armed else 0.0
        TORQUE.pack_into(torque.buffer, torque.offset, wanted_nm)
        bus.send(torque)
        if not enabled and self._armed_for % self._retry_ticks == 0:
            self._quieten(bus)
        if self._request:
            bus.send(self._ask_encoder)
            bus.send(self._ask_iq)

    def _switch(self, bus: Bus, enabled: bool) -> None:
        self._enabled, self._armed_for = enabled, 0
        if enabled:
            bus.send(self._mode)
            bus.send(self._clear)
        self._request_state(bus, CLOSED_LOOP if enabled else IDLE)

    def _quieten(self, bus: Bus) -> None:
        """Disarmed: what the drive should have heard is said again."""
        if self.state == CLOSED_LOOP:
            self._request_state(bus, IDLE)
        if self.error:
            bus.send(self._clear)

    def link_faults(self) -> int:
        """DEVICE: an error, or not armed though told so; LOST: no heartbeat."""
        faults = 0
        if self.error or (self._enabled and self._armed_for > self._arm_ticks and self.state != CLOSED_LOOP):
            faults |= _DEVICE
        if self._silent_for > self._heartbeat_ticks:
            faults |= _LOST
        return faults

    def status(self) -> str:
        """What the drive says about itself."""
        return f"node {self.node}: state {named(self.state, ODRIVE_STATES)}" + (
            f", {error_names(self.error)}" if self.error else ""
        )

    def stop(self, bus: Bus) -> None:
        """Torque 0 and idle."""
        self._enabled = False
        TORQUE.pack_into(self._torque.buffer, self._torque.offset, 0.0)
        bus.send(self._torque)
        self._request_state(bus, IDLE)
