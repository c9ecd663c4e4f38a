"""The `serial-lines` backend: a board that prints numbers as text and is told numbers as text
(docs/serial-lines.md)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hw.interface import CHANNEL_FIELDS, BackendError, Options, Rig, Words
from hw.serial.asking import await_first, switched
from hw.serial.backend import SerialCore, require_line_rate
from hw.serial.described_plan import MEASURED, NEEDED, PER_AXIS, unit_of
from hw.serial.lines_codec import INVALID, LINE_MAX, LineReader, Lines, LineWriter
from hw.serial.lines_sample import LineSample
from hw.serial.link import BACKLOGGED, MORE
from hw.serial_port import Port, usb_identity

STOP_REPEATS = 3


class LinesBackend(SerialCore):
    """One board that speaks in lines.

    Attributes
    ----------
    sample : LineSample
        Newest numbers, and counts of lines by what became of them."""

    def __init__(self, options: Options, rig: Rig) -> None:
        super().__init__(options, rig)
        self._options, sample, command = options, options["sample"], options["command"]
        given = {field["channel"] for field in sample["field"]}
        for channel in NEEDED:
            self._require_axes(sample, channel, "sample")
        self.provides = frozenset(given & set(MEASURED))
        self.sample = LineSample(sample["field"], rig)
        self._reader, self._lines = LineReader(sample), Lines()
        self._end: bytes = options["end"].encode()
        self._writer: LineWriter | None = None
        self._channel = ""
        self.consumes = frozenset()
        if command is not None:
            self._channel = next(f["channel"] for f in command["field"] if f["channel"] in PER_AXIS)
            self._require_axes(command, self._channel, "command")
            self.consumes = frozenset({self._channel})
            self._writer = LineWriter(command, [unit_of(field, rig) for field in command["field"]])
        self._poll = self._line(options["poll"])
        self.asks = bool(self._poll)
        self.packet = np.zeros(4 * LINE_MAX, np.uint8)
        self._packet_bytes = self.packet.data
        self._identity: str | None = None
        self._opened = False
        # at least a digit and a separator for each number
        # a board may print more digits: a rate that is refused here is too slow for certain
        shortest = len(sample["prefix"]) + 2 * sample["columns"]
        sent = len(self._poll) + (
            len(self._writer.write([0.0] * rig.n_axes, enabled=True)) + 1 if self._writer else 0
        )
        own_hz = options.get("rate_hz") or 1.0 / rig.period_s
        require_line_rate(self._path, self._baud, shortest, own_hz, sent, 1.0 / rig.period_s)

    def _require_axes(self, table: Options, channel: str, where: str) -> None:
        """Each axis once, or (of what is measured) none."""
        axes = sorted(field["axis"] for field in table["field"] if field["channel"] == channel)
        wrong = [
            field
            for field in table["field"]
            if field["channel"] in PER_AXIS and field["axis"] >= self._rig.n_axes
        ]
        if wrong or (axes and axes != list(range(self._rig.n_axes))):
            raise BackendError(
                f"serial-lines: {where}: {channel} is given for axes {axes}; each of axes 0 to "
                f"{self._rig.n_axes - 1} needs it once, and there are no others"
            )

    def _line(self, text: str) -> bytes:
        return text.encode() + self._end if text else b""

    def _stop_packet(self) -> bytes:
        """An end of line, should half a line wait at the board; then the idle line, or a command of zeros."""
        last = b"".join(self._line(text) for text in self._options["stop"])
        if self._writer is None:
            return last
        command = self._options["command"]
        # made like any command: with the prefixes and the checksum that the board expects
        zero = self._writer.write([0.0] * self._rig.n_axes, enabled=False) + self._end
        # the idle word behind zeros: torque ends before the power stage does
        # three times: a line that is damaged is dropped by the board, and one of three is heard
        return self._end + (zero + self._line(command["idle"])) * STOP_REPEATS + last

    def _bind(self, tick: np.ndarray) -> tuple[Callable[[], int], Callable[[], int]]:
        row = tick.view(np.ndarray)
        chunk, size, sample = self.chunk.data, self._size, self.sample
        shown = sample.bind(row)
        faults, count = row["link_faults"].view(np.int64).data, row["sample_count"].data

        def _receive() -> int:
            # a copy: lines are cut by `bytes`, and the chunk is read into again in the next cycle
            self._absorb(bytes(chunk[: size[0]]))
            end = size[1]
            if end != MORE:
                faults[0] = sample.judge(backlogged=end == BACKLOGGED)
                shown()
                count[0] = sample.count
            return sample.older_in_row

        return _receive, self._sender(row)

    def _sender(self, row: np.ndarray) -> Callable[[], int]:
        writer, end, buffer, order = self._writer, self._end, self._packet_bytes, self.sample.order
        unsent = self._wire["unsent_in_row"]
        if writer is None:
            return switched(row, self.packet, lambda: 0, {"enter": b"", "idle": b""}, self._poll, unsent)
        values, enabled = row[CHANNEL_FIELDS[self._channel]][0].data, row["enabled"].data

        def _send() -> int:
            # the line before may have gone out in part: it ends here
            cut = end if unsent[0] else b""
            line = cut + writer.write(values, enabled=order(enabled[0] != 0)) + end
            buffer[: len(line)] = line
            return len(line)

        command = self._options["command"]
        words = {name: self._line(command[name]) for name in ("enter", "idle")}
        return switched(row, self.packet, _send, words, self._poll, unsent, end)

    def _absorb(self, data: bytes) -> None:
        sample, reader = self.sample, self._reader
        for line in self._lines.cut(data):
            numbers = None if line is None else reader.read(line)
            # a greeting, a warning, another table of the board: no damage, and no fault
            if line is not None and numbers is None:
                sample.counts["foreign"] += 1
            elif isinstance(numbers, list):
                sample.take(numbers)
            elif numbers == INVALID:
                sample.invalid()
            else:
                sample.damaged()

    def _forget(self) -> None:
        self._lines.forget()
        self.sample.forget()

    def counts(self) -> dict[str, int]:
        """Lines since the start by what became of them, and commands that found the line full."""
        return {**self.sample.counts, "skipped": self._lines.skipped, "unsent": self.unsent}

    def words(self) -> list[Words]:
        """See `SpeakingBackend`: whether the board's own fault flag is set, or a number of it is none."""
        return self._with_backlog(
            "its fault flag is set, or a number in its line is none" if self.sample.fault else ""
        )

    @property
    def sample_waits(self) -> bool:
        """True when a sample came that no `read` has shown yet (while opening)."""
        return self.sample.fresh

    def _greet(self, port: Port) -> None:
        """Wait for the first good line; refuse another USB device than before."""
        texts = [*self._options["start"], self._options["poll"]]
        questions = [self._line(text) for text in texts if text]

        def _take_in(n: int) -> None:
            self._absorb(self.chunk[:n].tobytes())

        seen = await_first(port, self.chunk, self._patience_s, questions, _take_in, lambda: self.sample_waits)
        if seen is not None:
            raise BackendError(self._silence(seen))
        found = usb_identity(self._path)
        if self._opened and found != self._identity:
            raise BackendError(
                f"serial port {self._path}: another device than before: {found}, it was {self._identity}; "
                "plug the same one in, or start again"
            )
        self._identity, self._opened = found, True

    def _silence(self, bytes_seen: int) -> str:
        text = f"serial port {self._path}: no line of numbers within {self._patience_s:g} s: "
        if bytes_seen:
            return text + (
                f"{bytes_seen} bytes came "
                f"({', '.join(f'{n} {name}' for name, n in self.sample.counts.items())}): compare "
                f"[device.options.sample] with what the board prints, and baud {self._baud} with its bit "
                "rate"
            )
        return (
            text + "not a byte came: is the board powered and printing, or does it want a start or poll line?"
        )
