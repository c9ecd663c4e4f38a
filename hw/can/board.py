"""A board described by its frames: which bits of which identifier are which channel. Kind `can`.

The map is plain data (`hw.can.options` makes it, also from a DBC) and is compiled here into functions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from hw.can.armed import Armed
from hw.can.backend import CanBackend
from hw.can.bus import EXTENDED, Bus, Handler, wait_for
from hw.can.fields import CHECKSUMS, Buffer, Encode, Field, Sequence, Unwrap, decoder, encoder, raw_decoder
from hw.can.load import Traffic
from hw.can.sample import Sample
from hw.interface import BackendError, LinkFault, Options, Rig, Words

UNITS = {
    "rad": 1.0, "deg": math.pi / 180, "turn": 2 * math.pi, "count": 1.0,
    "rad/s": 1.0, "deg/s": math.pi / 180, "turn/s": 2 * math.pi, "rpm": math.pi / 30, "count/s": 1.0,
    "A": 1.0, "mA": 1e-3, "N": 1.0, "mN": 1e-3, "Nm": 1.0, "mNm": 1e-3, "degC": 1.0, "1": 1.0,
}  # fmt: skip
"""Unit of a field's physical value -> factor to SI. Counts are those of the axis' encoder_counts_per_rev."""

CHANNELS = ("position", "velocity", "current", "force", "temperature", "estop", "fault", "enabled")
COMMANDS = ("current_command", "torque", "enable", "counter", "constant")

OPEN_S, OPEN_ASKED = 1.0, 10
"""How long `open` waits for a first sample, and how often it asks: one lost frame is no missing board."""

ARM_S = 0.5
"""Longest time from `enable` to `enabled`, where the board tells it."""

_DEVICE = int(LinkFault.DEVICE)


def make_field(table: Options, length: int) -> Field:
    """The `Field` that a dumped table of the options says."""
    return Field(
        length,
        table["start_bit"],
        table["bits"],
        table["order"],
        table["type"],
        table["scale"],
        table["offset"],
    )


def _factor(table: Options, rig: Rig) -> float:
    if table["unit"] in ("count", "count/s"):
        return 2 * math.pi / float(rig.encoder_counts_per_rev[table["axis"]])
    return UNITS[table["unit"]]


def identifier(table: Options) -> int:
    """Identifier of a frame table, with the flag of an extended one."""
    return int(table["id"]) | (EXTENDED if table["extended"] else 0)


def traffic(options: Options, rate_hz: float) -> list[Traffic]:
    """All frames of the board, both ways."""
    received = [
        (table, 1000.0 / table["period_ms"] if table["period_ms"] else rate_hz)
        for table in options["receive"]
    ]
    sent = [(table, rate_hz) for table in options["send"]]
    fd = bool(options["bus"]["fd"])
    return [
        Traffic(f"frame 0x{table['id']:x}", table["length"], per_s, extended=table["extended"], fd=fd)
        for table, per_s in received + sent
    ]


class ReceivedFrame:
    """One kind of frame from the board: checks it, decodes its fields into the sample."""

    def __init__(self, table: Options, rig: Rig, sample: Sample) -> None:
        self._sample, self._length = sample, int(table["length"])
        self.id = int(table["id"])
        self.bit = sample.need() if table["required"] else 0
        counter, checksum = table["counter"], table["checksum"]
        self._count = raw_decoder(make_field(counter, self._length)) if counter else None
        self._sequence = Sequence(counter["bits"]) if counter else None
        self._checksum = (CHECKSUMS[checksum["kind"]], checksum["byte"]) if checksum else None
        self.fault = False
        told = [field for field in table["field"] if field["channel"] == "enabled"]
        self.armed = [Armed(round(ARM_S / rig.period_s)) for _ in told]
        self._tells = iter(self.armed)
        self._fields = [self._compile(field, rig) for field in table["field"]]
        self._values = [0.0] * len(self._fields)

    def _compile(self, table: Options, rig: Rig) -> tuple[Callable[[Buffer, int], float], Any, int]:
        field, factor = make_field(table, self._length), _factor(table, rig)
        channel, axis = table["channel"], int(table["axis"])
        if channel == "enabled":
            channel = next(self._tells)
        target: Any = {
            "position": self._sample.position_rad,
            "velocity": self._sample.velocity_rad_s,
            "current": self._sample.current_a,
            "temperature": self._sample.temperature_c,
            "force": self._sample.force_n,
        }.get(table["channel"], channel)
        if table["wrap"]:
            raw, unwrap = raw_decoder(field), Unwrap(field.bits)
            scale, offset = factor * field.scale, factor * field.offset
            return (lambda buffer, at: scale * unwrap(int(raw(buffer, at))) + offset), target, axis
        decode = decoder(field)
        if factor == 1.0:
            return decode, target, axis
        return (lambda buffer, at: factor * decode(buffer, at)), target, axis

    def handler(self, buffer: Buffer, offset: int, length: int) -> None:
        """Decode one frame; a damaged, repeated or not finite one changes nothing but counters."""
        sample = self._sample
        if length != self._length or not self._intact(buffer, offset):
            sample.damaged()
            return
        if self._sequence is not None and not self._sequence.newer(int(self._count(buffer, offset))):  # type: ignore[misc]
            sample.not_newer()
            return
        values = self._values
        for i, (decode, _, _) in enumerate(self._fields):
            value = decode(buffer, offset)
            if value - value != 0.0:  # NaN or infinite
                sample.not_finite()
                return
            values[i] = value
        for value, (_, target, axis) in zip(values, self._fields, strict=True):
            if isinstance(target, str):
                self._flag(target, value)
            elif isinstance(target, Armed):
                target.saw(value != 0)
            else:
                target[axis] = value
        sample.fresh |= self.bit

    def _intact(self, buffer: Buffer, offset: int) -> bool:
        if self._checksum is None:
            return True
        checksum, byte = self._checksum
        data = bytes(buffer[offset : offset + self._length])
        return bool(checksum(data[:byte] + data[byte + 1 :]) == data[byte])

    def _flag(self, channel: str, value: float) -> None:
        if channel == "estop":
            self._sample.estop = int(value != 0)
        else:
            self.fault = value != 0


class SentFrame:
    """One kind of frame to the board: every cycle's commands encoded into it."""

    def __init__(self, table: Options, rig: Rig, bus: Bus) -> None:
        self._frame = bus.outgoing(identifier(table), int(table["length"]))
        self._fields: list[tuple[Encode, str, int, float, float]] = []
        self._counter: tuple[Encode, int] | None = None
        self._count = 0
        checksum = table["checksum"]
        self._checksum = (CHECKSUMS[checksum["kind"]], checksum["byte"]) if checksum else None
        for entry in table["field"]:
            field = make_field(entry, int(table["length"]))
            encode, channel = encoder(field), entry["channel"]
            if channel == "constant":
                encode(self._frame.buffer, self._frame.offset, entry["value"])
            elif channel == "counter":
                self._counter = encode, 1 << field.bits
            else:
                limit = abs(entry["limit"]) if channel != "enable" else 1.0
                self._fields.append((encode, channel, int(entry["axis"]), 1.0 / _factor(entry, rig), limit))

    def send(self, bus: Bus, currents_a: Any, torques_nm: Any, enabled: bool) -> None:  # noqa: ANN401
        """Encode and send; a command that is not finite disables the board in this frame."""
        frame = self._frame
        buffer, offset = frame.buffer, frame.offset
        for encode, channel, axis, factor, limit in self._fields:
            value = 0.0
            if channel == "enable":
                value = 1.0 if enabled else 0.0
            elif enabled:
                wanted = (currents_a if channel == "current_command" else torques_nm)[axis]
                if wanted - wanted != 0.0:
                    self.send(bus, currents_a, torques_nm, False)
                    return
                value = factor * (limit if wanted > limit else -limit if wanted < -limit else wanted)
            encode(buffer, offset, value)
        if self._counter is not None:
            encode_count, modulus = self._counter
            self._count = (self._count + 1) % modulus
            encode_count(buffer, offset, self._count)
        if self._checksum is not None:
            self._seal(frame)
        bus.send(frame)

    def _seal(self, frame: Any) -> None:  # noqa: ANN401
        checksum, byte = self._checksum  # type: ignore[misc]
        data = bytes(frame.buffer[frame.offset : frame.offset + frame.length])
        frame.buffer[frame.offset + byte] = checksum(data[:byte] + data[byte + 1 :])


class BoardBackend(CanBackend):
    """The board of a field map."""

    def __init__(self, options: Options, rig: Rig) -> None:
        super().__init__(options, rig)
        for table in (*options["receive"], *options["send"]):
            for field in table["field"]:
                axes = 3 if field["channel"] == "force" else rig.n_axes
                if field["axis"] >= axes:
                    raise BackendError(
                        f"can: {field['channel']} of frame 0x{table['id']:x} names axis {field['axis']}; "
                        f"there are 0 to {axes - 1}"
                    )
        given = {field["channel"] for table in options["receive"] for field in table["field"]}
        wanted = {field["channel"] for table in options["send"] for field in table["field"]}
        self.provides = frozenset(given - {"fault", "enabled"})
        self.consumes = frozenset(wanted & {"current_command", "torque"})
        self._received: list[ReceivedFrame] = []
        self._sent: list[SentFrame] = []
        self._armed: list[Armed] = []

    def _set_up(self, bus: Bus) -> Mapping[int, Handler]:
        self.sample.needed = self.sample.fresh = 0
        self._received = [ReceivedFrame(table, self._rig, self.sample) for table in self._options["receive"]]
        self._sent = [SentFrame(table, self._rig, bus) for table in self._options["send"]]
        self._armed = [armed for frame in self._received for armed in frame.armed]
        handlers: dict[int, Handler] = {}
        for table, frame in zip(self._options["receive"], self._received, strict=True):
            handlers[identifier(table)] = frame.handler
        bus.subscribe(handlers)
        if not self._heard(bus):
            ids = ", ".join(f"0x{table['id']:x}" for table in self._options["receive"] if table["required"])
            raise BackendError(
                f"can board on {self._options['bus']['channel']}: not all of the frames {ids} came within 1 s: check power, "
                "wiring and termination, the bit rate, and the ids and lengths (candump shows what is on the bus)"
            )
        return handlers

    def _heard(self, bus: Bus) -> bool:
        """Whether a whole sample comes within about 1 s; a board that answers commands is asked again and again."""
        for _ in range(OPEN_ASKED):
            self._stop(bus)
            if wait_for(bus, lambda: self.sample.fresh == self.sample.needed, OPEN_S / OPEN_ASKED):
                return True
        return False

    def _prime(self, bus: Bus) -> None:
        self._stop(bus)

    def send(self, bus: Bus, *, enabled: bool) -> None:
        """See CanBackend."""
        on = enabled
        for armed in self._armed:
            on = armed.order(enabled) and on
        for frame in self._sent:
            frame.send(bus, self._current, self._torque, on)

    def _stop(self, bus: Bus) -> None:
        for frame in self._sent:
            frame.send(bus, None, None, False)

    def _device_faults(self) -> int:
        for frame in self._received:
            if frame.fault:
                return _DEVICE
        for armed in self._armed:
            if armed.ill:
                return _DEVICE
        return 0

    def words(self) -> list[Words]:
        """See `SpeakingBackend`: which frame carries the fault flag, and which frames have not come."""
        told = [f"frame 0x{f.id:x} sets its fault flag" for f in self._received if f.fault]
        waiting = self.sample.needed & ~self.sample.fresh if self.silent_cycles else 0
        told += [f"frame 0x{f.id:x} does not come" for f in self._received if waiting & f.bit]
        return [Words(", ".join(told), self._device_faults(), bool(waiting))]
