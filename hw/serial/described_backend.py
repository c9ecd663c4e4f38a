"""The `serial-described` backend: a board whose frame the rig file describes (docs/serial-described.md)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hw.interface import BackendError, Options, Rig, Words
from hw.jit import bound, records
from hw.serial import described_codec as codec
from hw.serial.asking import await_first, switched
from hw.serial.backend import Codec, SerialCore, require_line_rate
from hw.serial.described_plan import (
    MEASURED,
    NEEDED,
    TARGETS,
    TYPES,
    Target,
    fields_of,
    layout_of,
    require_every_axis,
)
from hw.serial.layout import LENGTH_MAX, stream_dtype
from hw.serial_port import Port, usb_identity
from hw.stop_sequence import stop_numbers

STOP_REPEATS = 3


class DescribedBackend(SerialCore):
    """One board with a frame of its own.

    Attributes
    ----------
    link : ndarray
        One-row record (`hw.serial.described_codec.described_dtype`): newest sample and counts.
    identity : tuple
        Identity field and USB identity of the board first opened; a re-plug must find the same."""

    def __init__(self, options: Options, rig: Rig) -> None:
        super().__init__(options, rig)
        self._options = options
        sample, command = options["sample"], options["command"]
        self.layout, self.fields = records(layout_of(sample)), records(fields_of(sample, rig, "sample"))
        channels = {field["channel"] for field in sample["field"]}
        for channel in NEEDED:
            if channel in channels:
                require_every_axis(self.fields, TARGETS[channel], rig.n_axes, "sample")
        self._has_identity = Target.IDENTITY in self.fields["target"]
        self._wanted = options["identity"]
        # else every board would be refused when it answers, for an identity of 0
        if self._wanted is not None and not self._has_identity:
            raise BackendError(
                "serial-described: identity is given, but the sample has no field of that channel"
            )
        self.provides = frozenset(channels & set(MEASURED))
        self._set_command(command, rig)
        self.identity: tuple[int, str | None] | None = None
        self._stopped_at: int | None = None
        self._poll, self.asks = bytes(options["poll"]), bool(options["poll"])
        self.packet = np.zeros(3 * LENGTH_MAX, np.uint8)  # a command and a poll
        self._packet_bytes = self.packet.data
        # what is sent in one cycle must be gone before the next one
        sent = len(self._poll) + (0 if command is None else command["length"])
        own_hz = options.get("rate_hz") or 1.0 / rig.period_s
        require_line_rate(self._path, self._baud, sample["length"], own_hz, sent, 1.0 / rig.period_s)
        self._stream = records(np.zeros(1, stream_dtype()))
        self.link = records(np.zeros(1, codec.described_dtype(rig.n_axes)))
        self.link["angle"][..., 0] = np.nan  # NaN: no angle has been seen yet
        # of an axis without this sensor; 0 would be a motor that is cold, or stands
        self.link["temperature_c"] = self.link["velocity_rad_s"] = np.nan
        for channel in MEASURED:
            self.link["show_" + channel] = channel in channels
        self.link["torque_mode"] = "torque" in self.consumes
        self._command = command

    def _set_command(self, command: Options | None, rig: Rig) -> None:
        self.command_layout = self.command_fields = None
        self.consumes = frozenset()
        if command is None:
            return
        self.command_layout = records(layout_of(command))
        self.command_fields = records(fields_of(command, rig, "command"))
        require_every_axis(self.command_fields, Target.COMMAND, rig.n_axes, "command")
        given = {field["channel"] for field in command["field"]}
        self.consumes = frozenset(given & {"torque", "current_command"})

    def _stop_packet(self) -> bytes:
        """The bytes of the rig file, or a command of zeros, disabled."""
        command, layout, numbers = self._command, self.command_layout, self.command_fields
        last = b"".join(bytes(packet) for packet in self._options["stop"])
        if command is None or layout is None or numbers is None:
            return last
        # what the rig file says goes before what can be guessed: zeros do not open a power stage
        for given in (command["stop"], command["idle"]):
            if given:
                return bytes(given) * STOP_REPEATS + last
        fields = [
            ("enabled", "<i8"),
            ("torque_applied_nm", "<f8", (self._rig.n_axes,)),
            ("current_command_a", "<f8", (self._rig.n_axes,)),
        ]
        tick = records(np.zeros(1, fields))

        def _zeros(number: int) -> bytes:
            self.link["command_sequence"] = number - 1  # `send` counts first
            return self.packet[: codec.send(tick, self.link, self.packet, layout, numbers)].tobytes()

        counted = [f["type"] for f in command["field"] if f["channel"] == "sequence"]
        if not counted:
            return _zeros(0) * STOP_REPEATS + last
        row = stop_numbers(1 << 8 * TYPES[counted[0]][1])
        self._stopped_at = row[-1]
        # twice: of a board that obeys only the last number of the first row, one copy may be damaged
        return b"".join(_zeros(number) for number in row) * 2 + last

    def stop(self) -> None:
        """See `SerialCore.stop`. Commands after it count on from its last number."""
        super().stop()
        # the board has seen that number: a command with a smaller one would be older to it
        if self._stopped_at is not None:
            self.link["command_sequence"] = self._stopped_at

    def _codec(self, tick: np.ndarray) -> tuple[Codec, Codec | None]:
        """What takes samples in, and what makes commands, where there are any."""
        row = records(tick)
        receive = (
            codec.receive,
            (row, self.chunk, self.meta, self.link, self._stream, self.layout, self.fields),
        )
        if self.command_layout is None or self.command_fields is None:
            return receive, None
        return receive, (codec.send, (row, self.link, self.packet, self.command_layout, self.command_fields))

    @property
    def _is_switched(self) -> bool:
        """Whether more is sent than commands."""
        command = self._command
        return command is None or bool(command["enter"] or command["idle"] or self._poll)

    def _compiled_codec(self, tick: np.ndarray) -> tuple[Codec, Codec] | None:
        receive, send = self._codec(tick)
        # `enter` and `idle` are bytes of a moment: compiled cycles send one kind of frame
        return None if send is None or self._is_switched else (receive, send)

    def _bind(self, tick: np.ndarray) -> tuple[Callable[[], int], Callable[[], int]]:
        (receive, received), sending = self._codec(tick)
        taken, unsent = bound(receive, *received), self._wire["unsent_in_row"]
        if sending is None:
            none = {"enter": b"", "idle": b""}
            return taken, switched(tick, self.packet, lambda: 0, none, self._poll, unsent)
        send = bound(sending[0], *sending[1])
        if self._is_switched:
            send = switched(tick, self.packet, send, self._command, self._poll, unsent)
        return taken, send

    def _forget(self) -> None:
        self._stream[:] = np.zeros(1, self._stream.dtype)
        for name in (
            "started",
            "fresh",
            "older_in_row",
            "damaged_now",
            "older_now",
            "fault",
            "asked",
            "driven",
            "dropped",
        ):
            self.link[name] = 0

    def counts(self) -> dict[str, int]:
        """Frames since the start by what became of them, and commands that found the line full."""
        names = ("good", "damaged", "older", "lost", "invalid")
        return {**{name: int(self.link[name][0]) for name in names}, "unsent": self.unsent}

    def words(self) -> list[Words]:
        """See `SpeakingBackend`: whether the board's own fault flag is set, or a number of it is none."""
        return self._with_backlog(
            "its fault flag is set, or a number in its frame is none" if self.link["fault"][0] else ""
        )

    @property
    def sample_waits(self) -> bool:
        """True when a sample came that no `read` has shown yet (while opening)."""
        return bool(self.link["fresh"][0])

    def _greet(self, port: Port) -> None:
        """Wait for the first good frame; refuse another board than before."""
        # a patience of .2 s would be over while Numba compiles for seconds
        self._take_in(0)  # compiles before the clock below starts
        questions = [
            *(bytes(packet) for packet in self._options["start"]),
            *([self._poll] if self._poll else []),
        ]
        seen = await_first(
            port, self.chunk, self._patience_s, questions, self._take_in, lambda: self.sample_waits
        )
        if seen is not None:
            raise BackendError(self._silence(seen))
        # both: boards of one make may have no number, and adapters of one make may have none either
        found = (int(self.link["identity"][0]), usb_identity(self._path))
        if self._wanted is not None and found[0] != self._wanted:
            raise BackendError(
                f"serial port {self._path}: board {found[0]} answered, {self._wanted} is wanted: plug that "
                "one in, or name this one in [device.options] identity"
            )
        if self.identity is not None and found != self.identity:
            raise BackendError(
                f"serial port {self._path}: another board than before: {found}, it was {self.identity}; "
                "plug the same one in, or start again"
            )
        self.identity = found

    def _take_in(self, n: int) -> None:
        codec.absorb(self.chunk, n, self.link, self._stream, self.layout, self.fields)

    def _silence(self, bytes_seen: int) -> str:
        text = f"serial port {self._path}: no frame within {self._patience_s:g} s: "
        if bytes_seen:
            return text + (
                f"{bytes_seen} bytes came, none of them a frame with these sync bytes, length and checksum: "
                f"compare [device.options.sample] with the board, and baud {self._baud} with its bit rate"
            )
        return text + "not a byte came: is the board powered and sending?"
