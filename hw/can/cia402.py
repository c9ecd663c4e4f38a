"""CiA 402 drives over CANopen in cyclic synchronous torque: the codec (pure), and arming one axis.

Every cycle the host sends one RPDO per drive (controlword, target torque) and then one SYNC; at the SYNC
the drives apply the torque and answer with their TPDO1 (statusword, position, actual current), which is full;
one whose velocity (606C) is wanted answers with a TPDO2 too. Set-up by SDO is `hw.can.cia402_setup`, before
the loop.

    arm      controlwords 06, 07, 0F, each once the statusword shows that the one before has worked
    command  target torque (per mille of the rated torque), and 0F, in every cycle
    disarm   controlword 06 (ready, power stage off) with torque 0; a fault is reset by 80 while disarmed
    dead man the drive watches the host's heartbeat (object 1016) and stops when it ends"""

from __future__ import annotations

import struct

from hw.can.armed import Armed
from hw.can.bus import Bus, Handler, wait_for
from hw.can.fields import Buffer, Field, Unwrap
from hw.can.load import Traffic
from hw.can.names import emergency_name
from hw.can.sample import Sample, Shaft
from hw.can.silence import Silence
from hw.can.steady_records import ENDLESS, LEAVES, NEVER, Command, Entry, Frame, Number
from hw.interface import BackendError, LinkFault, Options, Rig

RPDO1, TPDO1, TPDO2, SYNC, HEARTBEAT, EMERGENCY = 0x200, 0x180, 0x280, 0x080, 0x700, 0x080
PER_NODE = (EMERGENCY, TPDO1, RPDO1, 0x580, 0x600, HEARTBEAT)
"""Each node's own identifiers, besides its number; 580 and 600 are its SDO server's. With a velocity also
TPDO2."""
# state of a node in its heartbeat (CiA 301): only then PDOs are sent and obeyed
OPERATIONAL = 0x05
NMT, START = 0x000, 0x01

COMMAND = struct.Struct("<Hh")
FEEDBACK = struct.Struct("<Hih")
VELOCITY = struct.Struct("<i")

SHUT_DOWN, SWITCH_ON, ENABLE, DISABLE_VOLTAGE, FAULT_RESET = 0x06, 0x07, 0x0F, 0x00, 0x80

SWITCH_ON_DISABLED, READY, SWITCHED_ON, ENABLED, QUICK_STOP, FAULT, NOT_READY = (
    "switch on disabled", "ready to switch on", "switched on", "operation enabled", "quick stop active",
    "fault",
    "not ready to switch on",
)  # fmt: skip

# some drives charge capacitors or release a brake on the way to operation enabled
ARM_S = 1.0
RESET_TICKS = 100
"""While disarmed a fault is reset this often: 80 for one cycle, an edge of bit 7."""
_DEVICE, _LOST = int(LinkFault.DEVICE), int(LinkFault.LOST)


def drive_state(statusword: int) -> str:
    """State of the drive (CiA 402-2, statusword table)."""
    # 0F: fault reaction active, on its way to fault
    if statusword & 0x4F == 0x08 or statusword & 0x4F == 0x0F:
        return FAULT
    if statusword & 0x4F == 0x40:
        return SWITCH_ON_DISABLED
    return {0x21: READY, 0x23: SWITCHED_ON, 0x27: ENABLED, 0x07: QUICK_STOP}.get(statusword & 0x6F, NOT_READY)


_STATES = tuple(drive_state(statusword) for statusword in range(0x80))
_NEXT = {SWITCH_ON_DISABLED: SHUT_DOWN, READY: SWITCH_ON, SWITCHED_ON: ENABLE, ENABLED: ENABLE}


def controlword(state: str, enabled: bool, tick: int) -> int:
    """What to send to a drive in `state` that shall be enabled, or not."""
    # a fault is only ever reset while disarmed: a drive that came back while armed would have torque again
    if not enabled:
        if state == FAULT and tick % RESET_TICKS == 0:
            return FAULT_RESET
        # the way out of quick stop that every drive has is by "switch on disabled" (CiA 402-2)
        return DISABLE_VOLTAGE if state in (FAULT, QUICK_STOP) else SHUT_DOWN
    return _NEXT.get(state, DISABLE_VOLTAGE)


def per_mille(value: float, rated: float) -> int:
    """`value` as per mille of `rated`, saturated to 16 bits; NaN is 0."""
    # 6071 and 6077 are per mille of 6076, 6078 of 6075 (CiA 402-2)
    share = 1000.0 * value / rated
    if share != share:  # NaN
        return 0
    return 32767 if share >= 32767 else -32768 if share <= -32768 else round(share)


def traffic(options: Options, rate_hz: float) -> list[Traffic]:
    """All frames of the drives and the host."""
    frames = [Traffic("SYNC", 0, rate_hz), Traffic("host heartbeat", 1, 1000.0 / options["heartbeat_ms"])]
    for table in options["axis"]:
        name = f"node {table['node']}"
        frames += [
            Traffic(f"{name} RPDO1", COMMAND.size, rate_hz),
            Traffic(f"{name} TPDO1", FEEDBACK.size, rate_hz),
            Traffic(f"{name} heartbeat", 1, 1000.0 / options["heartbeat_ms"]),
        ]
        if table["velocity_units"]:
            frames.append(Traffic(f"{name} TPDO2", VELOCITY.size, rate_hz))
    return frames


class Cia402Axis:
    """One CiA 402 drive on the bus."""

    def __init__(self, table: Options, options: Options, rig: Rig, axis: int, sample: Sample) -> None:
        self.node, self._axis, self._sample = int(table["node"]), axis, sample
        self._shaft = Shaft(table, rig, axis)
        self._table, self._options, self._period_s = table, options, rig.period_s
        self._bit = sample.need()
        self._rad_per_count = self._shaft.rad_per_turn / float(table["counts_per_turn"])
        self._torque_rated_nm = float(table["rated_torque_nm"] or 0.0)
        self._current_rated_a = float(table["rated_current_a"] or 0.0)
        units = float(table["velocity_units"])
        self._velocity_bit = sample.need() if units else 0
        self._rad_s_per_unit = self._shaft.rad_per_turn / units if units else 0.0
        self._unwrap = Unwrap(32)
        self._armed = Armed(round(ARM_S / rig.period_s))
        # five heartbeats, which are in ms
        self._beat = Silence(max(1, round(5e-3 * options["heartbeat_ms"] / rig.period_s)))
        self._tick = self._word = 0
        self.state, self.emergency, self.nmt = NOT_READY, 0, OPERATIONAL
        self.identity = b""

    @staticmethod
    def measures(options: Options) -> set[str]:
        """See `Drive`."""
        return {"velocity"} if options["axis"][0]["velocity_units"] else set()

    def handlers(self) -> dict[int, Handler]:
        """What to do with this axis' frames."""
        found: dict[int, Handler] = {
            TPDO1 + self.node: self._on_feedback,
            HEARTBEAT + self.node: self._on_heartbeat,
            EMERGENCY + self.node: self._on_emergency,
        }
        # not heard where it is not wanted: a drive that sends it all the same costs no cycle of Python
        if self._velocity_bit:
            found[TPDO2 + self.node] = self._on_velocity
        return found

    def steady_frames(self) -> list[Frame]:
        """See `Drive`. Feedback is for Python whenever the state it tells has changed."""
        at, shaft, axis = self._sample.start, self._shaft, self._axis
        count = Field(8, 16, 32, "little", "int", self._rad_per_count, shaft.offset_rad)
        current = Field(8, 48, 16, "little", "int", shaft.direction * 1e-3)
        numbers = [
            Number(count, at["position"] + axis, ENDLESS, state=self._unwrap),
            Number(current, at["current"] + axis, factor=self._current_rated_a),
        ]
        same = Number(
            Field(8, 0, 7), wanted=lambda: NEVER if self._armed.said is None else self._word, says=LEAVES
        )
        frames = [Frame(TPDO1 + self.node, FEEDBACK.size, numbers, [same], self._bit)]
        if self._velocity_bit:
            speed = Field(4, 0, 32, "little", "int", self._rad_s_per_unit)
            numbers = [Number(speed, at["velocity"] + axis)]
            frames.append(Frame(TPDO2 + self.node, VELOCITY.size, numbers, bit=self._velocity_bit))
        return [*frames, Frame(HEARTBEAT + self.node), Frame(EMERGENCY + self.node)]

    def steady_commands(self, current_at: int) -> list[Command]:
        """See `Drive`."""
        shaft, command = self._shaft, Command(self._command)
        armed = self._armed
        if armed.wanted and not armed.dropped and self.state == ENABLED:
            target = Field(COMMAND.size, 16, 16, "little", "int", self._torque_rated_nm)
            entry = Entry(target, current_at, shaft.torque_per_ampere, shaft.current_max_a, 1000.0)
            command.entries = [entry]
        return [command]

    def alike(self) -> int:
        """See `Drive`. A fault is reset now and then, and a state that is new is answered."""
        # FAULT_RESET goes out in one cycle of RESET_TICKS, which compiled cycles cannot count
        if (self.state == FAULT and not self._armed.wanted) or self._armed.said is None:
            return 0
        return min(self._armed.spare, self._beat.spare)

    def pass_by(self, cycles: int) -> None:
        """See `Drive`."""
        self._armed.ticks += cycles
        self._tick += cycles
        self._beat.cycles += cycles

    def _on_feedback(self, buffer: Buffer, offset: int, length: int) -> None:
        if length != FEEDBACK.size:
            self._sample.damaged()
            return
        statusword, counts, current = FEEDBACK.unpack_from(buffer, offset)
        self._word = statusword & 0x7F  # bits 0 to 6 tell the state (CiA 402-2)
        self.state = _STATES[self._word]
        # before the numbers: whether the drive still drives is judged by the frame that they came with
        self._armed.saw(self.state == ENABLED)
        sample, shaft, axis = self._sample, self._shaft, self._axis
        sample.position_rad[axis] = self._unwrap(counts) * self._rad_per_count + shaft.offset_rad
        sample.current_a[axis] = shaft.direction * 1e-3 * current * self._current_rated_a
        sample.fresh |= self._bit

    def _on_velocity(self, buffer: Buffer, offset: int, length: int) -> None:
        if length != VELOCITY.size:
            self._sample.damaged()
            return
        units = VELOCITY.unpack_from(buffer, offset)[0]
        self._sample.velocity_rad_s[self._axis] = units * self._rad_s_per_unit
        self._sample.fresh |= self._velocity_bit

    def _on_heartbeat(self, buffer: Buffer, offset: int, length: int) -> None:
        if length == 1:
            # bit 7 is the toggle of node guarding (CiA 301)
            self.nmt, self._beat.cycles = buffer[offset] & 0x7F, 0

    def _on_emergency(self, buffer: Buffer, offset: int, length: int) -> None:
        if length >= 2:
            self.emergency = buffer[offset] | buffer[offset + 1] << 8

    def make_frames(self, bus: Bus) -> None:
        """See Drive."""
        self._command = bus.outgoing(RPDO1 + self.node, COMMAND.size)
        self._sync = bus.outgoing(SYNC, 0)
        # what the first RPDO says that the drive obeys, whatever was in it before a re-plug
        self._set(SHUT_DOWN, 0)

    def set_up(self, bus: Bus) -> None:
        """Configure by SDO, start the node, hear its first TPDO. Blocks; before the loop only."""
        from hw.can.cia402_setup import configure

        self.make_frames(bus)
        found = configure(bus, self.node, self._table, self._options, self._period_s)
        self._torque_rated_nm, current_a, self.identity = found
        if current_a is None:  # its full scale is the current that gives the rated torque
            current_a = self._torque_rated_nm / abs(self._shaft.torque_per_ampere)
        self._current_rated_a = current_a
        # a drive that is set up anew may count from elsewhere: who re-plugs it tares (decision 0007)
        self._unwrap = Unwrap(32)
        # this drive alone: a TPDO of one that is set up already would be counted as its part of a sample
        bus.subscribe(self.handlers())
        start = bus.outgoing(NMT, 2)
        start.buffer[start.offset : start.offset + 2] = bytes([START, self.node])
        for _ in range(5):
            # again: nobody acknowledges it, and one that was lost leaves a drive that says nothing
            bus.send(start)
            bus.send(self._command)
            bus.send(self._sync)
            if wait_for(bus, self._heard, 0.2):
                return
        raise BackendError(
            f"cia402 node {self.node}: no TPDO after SYNC within 1 s though it answers SDOs: "
            "check that its PDO mapping may be changed (objects 1600, 1A00, 1A01) and its NMT state"
        )

    def _heard(self) -> bool:
        both = self._bit | self._velocity_bit
        return self._sample.fresh & both == both

    def prime(self, bus: Bus) -> None:
        """Ready, torque 0; the backend sends SYNC."""
        self._set(SHUT_DOWN, 0)
        bus.send(self._command)

    def _set(self, control: int, target: int) -> None:
        COMMAND.pack_into(self._command.buffer, self._command.offset, control, target)

    def write(self, bus: Bus, current_a: float, enabled: bool) -> None:
        """Send this cycle's controlword and torque."""
        on = self._armed.order(enabled)
        self._tick += 1
        self._beat.cycles += 1
        target = 0
        # 0 on the way up: a torque that was sent before would act at once when the power stage closes
        if on and self.state == ENABLED:
            torque_nm = self._shaft.limited(current_a) * self._shaft.torque_per_ampere
            target = per_mille(torque_nm, self._torque_rated_nm)
        tick = 1 if enabled else self._tick  # no fault is reset while the host wants torque
        self._set(controlword(self.state, on, tick), target)
        bus.send(self._command)

    def link_faults(self) -> int:
        """DEVICE: fault, out of operation enabled again, or never in it; LOST: no heartbeat."""
        faults = 0
        if self.state == FAULT or self._armed.ill or self.nmt != OPERATIONAL:
            faults |= _DEVICE
        if self._beat.is_over_long:
            faults |= _LOST
        return faults

    def status(self) -> str:
        """What the drive says about itself."""
        return f"node {self.node}: {self.state}" + (
            f", emergency {emergency_name(self.emergency)}" if self.emergency else ""
        )

    def stop(self, bus: Bus) -> None:
        """Power stage off, torque 0. The drive takes an RPDO over at a SYNC only, so one follows at once."""
        self._armed.order(False)
        self._set(SHUT_DOWN, 0)
        bus.send(self._command)
        bus.send(self._sync)
