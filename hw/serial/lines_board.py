"""A board that speaks in lines of text, for the simulator: the description read the other way round."""

from __future__ import annotations

import re

import numpy as np

from hw.interface import Options, Rig
from hw.serial.described_plan import unit_of
from hw.serial.firmware import Taken
from hw.serial.frame import Status
from hw.serial.lines_codec import Lines, nmea, sealed

_TICK = {
    "position": "position_rad",
    "velocity": "device_velocity_rad_s",
    "current": "current_a",
    "temperature": "temperature_c",
    "force": "force_n",
}


class LineBoard:
    """As `hw.serial.described_board.DescribedBoard`, in text. Its time to live is that of the description."""

    def __init__(self, options: Options, rig: Rig, identity: str) -> None:
        self.n_axes, self.serial_number, self._rig = rig.n_axes, identity, rig
        self._options, self._sample, self._command = options, options["sample"], options["command"]
        self._lines = Lines()
        self._end: bytes = options["end"].encode()
        self._lines.cut(b"\n")
        command = self._command or {"field": (), "enter": "", "idle": "", "time_to_live_ms": 10.0}
        self._fields, self._enter, self._idle = command["field"], command["enter"], command["idle"]
        # one row like the command record of `Board`: what the simulation asks of it
        self.command = np.zeros(1, [("sequence", "<i8"), ("torque_mode", "<i8")])
        self.command["torque_mode"] = any(field["channel"] == "torque" for field in self._fields)
        pattern = "".join(re.escape(field["prefix"]) + r"([-+.0-9]+)" for field in self._fields)
        self._pattern = re.compile(pattern.encode())
        self._cycles = max(round(1e-3 * command["time_to_live_ms"] / rig.period_s), 1)
        self._value, self._on, self._enable = np.zeros(rig.n_axes), not self._enter, False
        self._heard: set[str] = set()
        self._asked = False
        self.age, self.sequence = 255, 0
        self.estop = self.drive_fault = False
        self.force_missing = self.temperature_missing = self.velocity_missing = False

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
        self._enable = enable and self._on
        return True

    def hold(self) -> None:
        """Torque-free until the next command."""
        self._enable = False
        self._value[:] = 0.0

    def begin_cycle(self, cycles: int = 1) -> None:
        """Let `cycles` of the board's own clock pass: commands grow old."""
        self.age = min(self.age + cycles, 1000)
        if self.age >= self._cycles:
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
        """Nothing to compile."""
        del tick

    def identity_packet(self) -> bytes:
        """It has none."""
        return b""

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
            return str(self.sequence)
        if channel in ("estop", "fault", "enabled"):
            on = {"estop": self.estop, "fault": self.drive_fault, "enabled": self.enabled}[channel]
            return str(field["mask"] if on != field["invert"] else 0)
        unit = unit_of(field, self._rig)
        value = float(tick[_TICK[channel]][0][field["component" if channel == "force" else "axis"]])
        if field["wrap_at"]:
            value %= unit * field["wrap_at"]
        number = value / (unit * field["scale"]) + field["zero"]
        return f"{number:.{4 if field['decimals'] is None else field['decimals']}f}"
