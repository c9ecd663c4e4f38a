"""A board with a described frame, for the simulator: the same plan read the other way round."""

from __future__ import annotations

import numpy as np

from hw.interface import Options, Rig
from hw.jit import records
from hw.serial.described_codec import write_number
from hw.serial.described_plan import Target, fields_of, layout_of
from hw.serial.firmware import Taken
from hw.serial.frame import Status
from hw.serial.layout import next_frame, read_raw, seal_frame, stream_dtype, write_bytes

TIME_TO_LIVE = 10
"""Board cycles; such boards have theirs built in."""


class DescribedBoard:
    """As `hw.serial.firmware.Board`, but for a described frame: a plain board that holds nothing after a stop."""

    def __init__(self, options: Options, rig: Rig, identity: int) -> None:
        self.n_axes, self.serial_number = rig.n_axes, str(identity)
        self._layout, self._fields = (
            records(layout_of(options["sample"])),
            records(fields_of(options["sample"], rig, "sample")),
        )
        command = options["command"]
        self._command_layout = records(layout_of(command))
        self._command_fields = records(fields_of(command, rig, "command"))
        self._stop = bytes(command["stop"])
        self._stream = records(np.zeros(1, stream_dtype()))
        # one row like the command record of `Board`: what the simulation asks of it
        self.command = np.zeros(1, [("sequence", "<i8"), ("torque_mode", "<i8")])
        self.command["torque_mode"] = any(field["channel"] == "torque" for field in command["field"])
        self._value, self._enable = np.zeros(rig.n_axes), False
        self.age, self.sequence = 255, 0
        self.estop = self.drive_fault = False
        self.force_missing = self.temperature_missing = self.velocity_missing = False

    def take(self, data: bytes) -> Taken:
        """Read commands; the newest good one is in force from now on."""
        chunk, at, taken = np.frombuffer(data, np.uint8), 0, Taken()
        if self._stop and self._stop in data:
            taken.stops += 1
            self.hold()
        while True:
            at, found, broken = next_frame(self._stream, chunk, at, len(chunk), self._command_layout)
            taken.damaged += broken
            if not found:
                return taken
            taken.commands += 1
            self._obey(self._stream[0]["pending"])

    def _obey(self, frame: np.ndarray) -> None:
        big, self._enable, self.age = int(self._command_layout["big_endian"][0]), True, 0
        for field in self._command_fields:
            raw = read_raw(frame, 0, field, big)
            if field["target"] == Target.COMMAND:
                self._value[field["index"]] = (raw - field["zero"]) * field["scale"]
            elif field["target"] == Target.ENABLE:
                self._enable = bool(int(raw) & int(field["mask"])) != bool(field["invert"])
            elif field["target"] == Target.SEQUENCE:
                self.command["sequence"] = int(raw)

    def hold(self) -> None:
        """Torque-free until the next command."""
        self._enable = False
        self._value[:] = 0.0

    def begin_cycle(self, cycles: int = 1) -> None:
        """Let `cycles` of the board's own clock pass: commands grow old."""
        self.age = min(self.age + cycles, 255)
        if self.age >= TIME_TO_LIVE:
            self.hold()

    @property
    def enabled(self) -> bool:
        """Whether the power stage drives the motor."""
        return self._enable and not (self.estop or self.drive_fault)

    @property
    def output(self) -> np.ndarray:
        """Value in force, A or N m, shape (n_axes,); zero unless enabled."""
        return self._value.copy() if self.enabled else np.zeros(self.n_axes)

    @property
    def status(self) -> Status:
        """As far as it has one."""
        return Status(int(self.enabled) + 2 * int(self.estop) + 4 * int(self.drive_fault))

    def rehearse(self, tick: np.ndarray) -> None:
        """Go through everything once, so that all of it is compiled. The board is of no use afterwards."""
        frame = self._command_layout[0]["template"].copy()
        seal_frame(frame, self._command_layout)
        self.take(bytes(frame[: int(self._command_layout["length"][0])].tobytes()))
        self.state_packet(tick, np.zeros(self.n_axes, np.int64), 0)

    def identity_packet(self) -> bytes:
        """It has none."""
        return b""

    def state_packet(self, tick: np.ndarray, counts: np.ndarray, time_us: int) -> bytes:
        """Frame with the measured fields of `tick` and encoder `counts`."""
        del time_us
        frame, layout = self._layout[0]["template"].copy(), self._layout
        big = int(layout["big_endian"][0])
        self.sequence += 1
        names = {
            Target.POSITION: "position_rad",
            Target.CURRENT: "current_a",
            Target.TEMPERATURE: "temperature_c",
            Target.VELOCITY: "device_velocity_rad_s",
        }
        for field in self._fields:
            target, at, size = Target(int(field["target"])), int(field["at"]), int(field["n_bytes"])
            if target == Target.POSITION and field["bits"]:
                write_bytes(
                    frame, at, size, big, int(counts[field["index"]]) & ((1 << int(field["bits"])) - 1)
                )
            elif target in names or target == Target.FORCE:
                value = tick[names.get(target, "force_n")][0][field["index"]]
                write_number(frame, field, big, float(value))
            elif target == Target.SEQUENCE:
                write_bytes(frame, at, size, big, self.sequence)
            elif target == Target.IDENTITY:
                write_bytes(frame, at, size, big, int(self.serial_number))
            else:
                on = {Target.ESTOP: self.estop, Target.ENABLED: self.enabled}.get(target, self.drive_fault)
                if on != bool(field["invert"]):
                    for k in range(size):
                        frame[at + (size - 1 - k if big else k)] |= (int(field["mask"]) >> (8 * k)) & 0xFF
        seal_frame(frame, layout)
        return bytes(frame[: int(layout["length"][0])].tobytes())
