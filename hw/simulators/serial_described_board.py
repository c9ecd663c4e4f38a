"""A board with a described frame, for the simulator: the same plan read the other way round."""

from __future__ import annotations

import numpy as np

from hw.interface import Options, Rig
from hw.jit import records
from hw.serial.described_codec import write_number
from hw.serial.described_plan import Target, fields_of, layout_of
from hw.serial.layout import next_frame, read_raw, seal_frame, stream_dtype, write_bytes
from hw.simulators.serial_commanded_board import CommandedBoard
from hw.simulators.serial_firmware import Taken

TIME_TO_LIVE = 10
"""Board cycles; such boards have theirs built in."""


class Words:
    """Bytes besides commands that a board understands: start, poll, stop, enter, idle; and what they did to
    it."""

    def __init__(self, options: Options, command: Options) -> None:
        self._start = [bytes(packet) for packet in options["start"]]
        self._stops = [bytes(packet) for packet in options["stop"]]
        self._halt = bytes(command.get("stop", ()))
        self._poll = bytes(options["poll"])
        self._enter, self._idle = bytes(command.get("enter", ())), bytes(command.get("idle", ()))
        self._heard: set[bytes] = set()
        self._asked = False
        self.on = not self._enter
        """Whether commands are obeyed."""

    def take(self, data: bytes) -> tuple[bytes, bool]:
        """What is left of `data`, and whether the motor is to be let go."""
        held = False
        # found by search: a word has no frame of its own, and may come in one read with commands
        for word in (*self._stops, *self._start, self._halt, self._idle, self._enter, self._poll):
            if not word or word not in data:
                continue
            # taken out: what looks for frames next would count the word as damage
            data = data.replace(word, b"")
            if word in self._stops:
                self._heard.clear()
            elif word in self._start:
                self._heard.add(word)
            self._asked |= word == self._poll
            # a word of the start only lets it speak: the motor is let go by those that end its work
            held |= word in (self._halt, self._idle)
            if self._enter:
                self.on = word == self._enter or (self.on and word not in (self._halt, self._idle))
        return data, held

    def speaks(self) -> bool:
        """Whether a sample goes out now."""
        # a question is answered once; a board that has no word for one speaks in every cycle
        asked, self._asked = self._asked or not self._poll, False
        return asked and self._heard == set(self._start)


class DescribedBoard(CommandedBoard):
    """As `hw.simulators.serial_firmware.Board`, but for a described frame: a plain board that holds nothing
    after a stop."""

    def __init__(self, options: Options, rig: Rig, identity: int) -> None:
        super().__init__(rig.n_axes, TIME_TO_LIVE)
        self.serial_number = str(identity)
        self._layout, self._fields = (
            records(layout_of(options["sample"])),
            records(fields_of(options["sample"], rig, "sample")),
        )
        command = options["command"]
        self._command_layout = None if command is None else records(layout_of(command))
        self._command_fields = () if command is None else records(fields_of(command, rig, "command"))
        self._words = Words(options, command or {})
        self._stream = records(np.zeros(1, stream_dtype()))
        if command is not None:
            self.command["torque_mode"] = any(field["channel"] == "torque" for field in command["field"])

    def take(self, data: bytes) -> Taken:
        """Read commands; the newest good one is in force from now on."""
        taken = Taken()
        data, held = self._words.take(data)
        if held:
            taken.stops += 1
            self.hold()
        # a frame may end in the next read: `_stream` keeps its beginning
        chunk, at = np.frombuffer(data, np.uint8), 0
        while self._command_layout is not None:
            at, found, broken = next_frame(self._stream, chunk, at, len(chunk), self._command_layout)
            taken.damaged += broken
            if not found:
                return taken
            # counted though nothing obeys it before the word `enter`: with --step each command is a cycle of
            # the board
            taken.commands += 1
            if self._words.on:
                self._obey(self._stream[0]["pending"])
        return taken

    def _obey(self, frame: np.ndarray) -> None:
        assert self._command_layout is not None
        big, self._enable, self.age = int(self._command_layout["big_endian"][0]), True, 0
        for field in self._command_fields:
            raw = read_raw(frame, 0, field, big)
            if field["target"] == Target.COMMAND:
                self._value[field["index"]] = (raw - field["zero"]) * field["scale"]
            elif field["target"] == Target.ENABLE:
                self._enable = bool(int(raw) & int(field["mask"])) != bool(field["invert"])
            elif field["target"] == Target.SEQUENCE:
                self.command["sequence"] = int(raw)

    def rehearse(self, tick: np.ndarray) -> None:
        """Go through everything once, so that all of it is compiled. The board is of no use afterwards."""
        if self._command_layout is not None:
            frame = self._command_layout[0]["template"].copy()
            seal_frame(frame, self._command_layout)
            self.take(bytes(frame[: int(self._command_layout["length"][0])].tobytes()))
        self.state_packet(tick, np.zeros(self.n_axes, np.int64), 0)

    def state_packet(self, tick: np.ndarray, counts: np.ndarray, time_us: int) -> bytes:
        """Frame with the measured fields of `tick` and encoder `counts`; empty from a board that waits to be
        asked."""
        del time_us
        if not self._words.speaks():
            return b""
        frame, layout = self._layout[0]["template"].copy(), self._layout
        big = int(layout["big_endian"][0])
        self.sequence += 1
        names = {
            Target.POSITION: "position_rad",
            Target.CURRENT: "current_a",
            Target.TEMPERATURE: "temperature_c",
            Target.VELOCITY: "device_velocity_rad_s",
            Target.FORCE: "force_n",
            Target.MOMENT: "moment_nm",
        }
        for field in self._fields:
            target, at, size = Target(int(field["target"])), int(field["at"]), int(field["n_bytes"])
            if target == Target.POSITION and field["bits"]:
                write_bytes(
                    frame, at, size, big, int(counts[field["index"]]) & ((1 << int(field["bits"])) - 1)
                )
            elif target in names:
                # an encoder of one turn starts over at its period; the host is to go on counting
                value = float(tick[names[target]][0][field["index"]])
                write_number(frame, field, big, value % field["period"] if field["period"] else value)
            elif target == Target.SEQUENCE:
                write_bytes(frame, at, size, big, self.sequence)
            elif target == Target.IDENTITY:
                write_bytes(frame, at, size, big, int(self.serial_number))
            else:
                on = {Target.ESTOP: self.estop, Target.ENABLED: self.enabled}.get(target, self.drive_fault)
                # the template has zeros here, and several flags share a byte: what is on is or-ed into it
                if on != bool(field["invert"]):
                    for k in range(size):
                        frame[at + (size - 1 - k if big else k)] |= (int(field["mask"]) >> (8 * k)) & 0xFF
        # last: the checksum is over what was written
        seal_frame(frame, layout)
        return bytes(frame[: int(layout["length"][0])].tobytes())
