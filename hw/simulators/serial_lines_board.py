"""A board that speaks in lines of text, for the simulator: the description read the other way round."""

from __future__ import annotations

import re

import numpy as np

from hw.interface import Options, Rig
from hw.serial.described_plan import unit_of
from hw.serial.lines_codec import Lines, nmea, sealed
from hw.simulators.serial_commanded_board import CommandedBoard
from hw.simulators.serial_firmware import Taken

_TICK = {
    "position": "position_rad",
    "velocity": "device_velocity_rad_s",
    "current": "current_a",
    "temperature": "temperature_c",
    "force": "force_n",
    "moment": "moment_nm",
}


class LineBoard(CommandedBoard):
    """As `hw.simulators.serial_described_board.DescribedBoard`, in text. Its time to live is that of the
    description."""

    def __init__(self, options: Options, rig: Rig, identity: str) -> None:
        self._options, self._sample, self._command = options, options["sample"], options["command"]
        self._lines = Lines()
        self._end: bytes = options["end"].encode()
        # a board knows where its own lines begin; `Lines` passes over what is before the first end
        self._lines.cut(b"\n")
        command = self._command or {"field": (), "enter": "", "idle": "", "time_to_live_ms": 10.0}
        # one cycle at least: with none a command would be too old before it acted
        super().__init__(rig.n_axes, max(round(1e-3 * command["time_to_live_ms"] / rig.period_s), 1))
        self.serial_number, self._rig = identity, rig
        self._fields, self._enter, self._idle = command["field"], command["enter"], command["idle"]
        self.command["torque_mode"] = any(field["channel"] == "torque" for field in self._fields)
        pattern = "".join(re.escape(field["prefix"]) + r"([-+.0-9]+)" for field in self._fields)
        self._pattern = re.compile(pattern.encode())
        self._on = not self._enter
        self._heard: set[str] = set()
        self._asked = False

    def take(self, data: bytes) -> Taken:
        """Read lines; the newest good command is in force from now on."""
        taken = Taken()
        for line in self._lines.cut(data):
            text = (line or b"").decode(errors="replace")
            if text in self._options["stop"]:
                self._heard.clear()
            elif text in self._options["start"]:
                self._heard.add(text)
            elif text and text == self._options["poll"]:
                self._asked = True
            # text: an empty line is no word, though a board without words has empty ones
            elif text and text in (self._enter, self._idle):
                self._on = text == self._enter
                taken.stops += not self._on
                self.hold()
            elif line is not None and self._obey(line):
                taken.commands += 1
            else:
                taken.damaged += 1
        return taken

    def _obey(self, line: bytes) -> bool:
        if self._command is None:
            return False
        if self._command["checksum"] == "nmea":
            line, _, digits = line.rpartition(b"*")
            if digits != b"%02X" % nmea(line.removeprefix(b"$")):
                return False
        found = self._pattern.fullmatch(line)
        if found is None:
            return False
        enable, self.age = True, 0
        for field, digits in zip(self._fields, found.groups(), strict=True):
            number = float(digits)
            if field["channel"] == "enable":
                enable = bool(number) != field["invert"]
            elif field["channel"] != "time_to_live":
                scale = field["scale"] * unit_of(field, self._rig)
                self._value[field["axis"]] = (number - field["zero"]) * scale
        # what is sent to a board that was not entered is read, and drives nothing
        self._enable = enable and self._on
        return True

    def rehearse(self, tick: np.ndarray) -> None:
        """Nothing to compile."""
        del tick

    def state_packet(self, tick: np.ndarray, counts: np.ndarray, time_us: int) -> bytes:
        """A line with the measured fields of `tick`; empty from a board that waits to be asked or started."""
        del counts, time_us
        asked, self._asked = self._asked or not self._options["poll"], False
        if not asked or self._heard != set(self._options["start"]):
            return b""
        self.sequence += 1
        table, cells = self._sample, ["0"] * self._sample["columns"]
        for field in table["field"]:
            cells[field["column"]] = self._cell(field, tick)
        line = (table["prefix"] + table["separator"].join(cells)).encode()
        return sealed(line, table["checksum"]) + self._end

    def _cell(self, field: Options, tick: np.ndarray) -> str:
        channel = field["channel"]
        if channel == "sequence":
            return str(self.sequence % int(field["wrap_at"] or 1 << 32))
        if channel in ("estop", "fault", "enabled"):
            on = {"estop": self.estop, "fault": self.drive_fault, "enabled": self.enabled}[channel]
            return str(field["mask"] if on != field["invert"] else 0)
        unit = unit_of(field, self._rig)
        value = float(
            tick[_TICK[channel]][0][field["component" if channel in ("force", "moment") else "axis"]]
        )
        if field["wrap_at"]:
            value %= unit * field["wrap_at"]
        number = value / (unit * field["scale"]) + field["zero"]
        return f"{number:.{4 if field['decimals'] is None else field['decimals']}f}"
