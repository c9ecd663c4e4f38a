"""The `serial` backend: a board that speaks `rtctl-frame` (docs/serial-protocol.md)."""

from __future__ import annotations

import math
import select
import time
from collections.abc import Callable

import numpy as np

from hw.interface import BackendError, Options, Rig, Words
from hw.jit import bound, records
from hw.serial import frame, link
from hw.serial.backend import Codec, SerialCore, require_line_rate
from hw.serial.declared import command_packet_bytes, state_packet_bytes
from hw.serial.deframer import deframer_dtype
from hw.serial.framing import BODY_MAX, PACKET_MAX
from hw.serial_port import Port

ASK_AGAIN_S = 0.2
"""Pause between identify packets while a board boots."""

_MISSING = int(sum(flag for flag in frame.Status if str(flag.name).endswith("_MISSING")))
"""Bits of a sensor that the board does not have: no news where the rig file does not ask for it, and no
cause of a fault, beside which words stand."""

# where one packet in 1000 is damaged, all three are once in 10^9 stops
STOP_REPEATS = 3
"""Copies of the stop packet in one write: one damaged copy on the wire does not matter."""


class SerialBackend(SerialCore):
    """One board with position, and what else the options say it has.

    Attributes
    ----------
    link : ndarray
        One-row record (`hw.serial.link.link_dtype`): newest sample, counts of good, damaged, older, lost
        and foreign packets.
    identity : str
        Serial number of the board first opened; a re-plug must find the same one."""

    def __init__(self, options: Options, rig: Rig) -> None:
        super().__init__(options, rig)
        if rig.n_axes > frame.AXES_MAX:
            raise BackendError(f"serial: at most {frame.AXES_MAX} axes per board, not {rig.n_axes}")
        require_line_rate(
            self._path,
            self._baud,
            state_packet_bytes(
                rig.n_axes, **{name: name in options["channels"] for name in ("velocity", "moment")}
            ),
            options.get("rate_hz") or 1.0 / rig.period_s,
            command_packet_bytes(rig.n_axes),
            1.0 / rig.period_s,
        )
        self._torque = options["command"] == "torque"
        self.provides = frozenset({"position", *options["channels"]})
        self.consumes = frozenset({"torque" if self._torque else "current_command"})
        self._wanted: str | None = options["identity"]
        self.identity: str | None = None
        self._body = np.zeros(BODY_MAX + 8, np.uint8)
        self._state = records(np.zeros(1, frame.state_dtype(rig.n_axes)))
        self._command = records(np.zeros(1, frame.command_dtype(rig.n_axes)))
        self._board = records(np.zeros(1, frame.identity_dtype()))
        self._stream = records(np.zeros(1, deframer_dtype()))
        self.link = records(_settings(options, rig, self._torque))
        self._before = self.link[0].copy()

    def counts(self) -> dict[str, int]:
        """Packets since the start by what became of them, and commands that found the line full."""
        row = self.link[0]
        names = ("good", "damaged", "older", "lost", "foreign")
        return {**{name: int(row[name]) for name in names}, "unsent": self.unsent}

    def words(self) -> list[Words]:
        """See `SpeakingBackend`: the flags of the board's status, by name."""
        row = self.link[0]
        unwanted = _MISSING & ~int(row["unusable_status"])
        flags = frame.Status(int(row["status"]) & ~unwanted)
        return self._with_backlog(", ".join(str(flag.name) for flag in frame.Status if flag in flags))

    @property
    def sample_waits(self) -> bool:
        """True when a sample came that no `read` has shown yet (while opening)."""
        return bool(self.link[0]["fresh"])

    def _packet(self, kind: int) -> bytes:
        packet = np.zeros(PACKET_MAX, np.uint8)
        return packet[: link.request(kind, 0, self._body, packet)].tobytes()

    def _stop_packet(self) -> bytes:
        return self._packet(frame.TYPE_STOP) * STOP_REPEATS

    def _compiled_codec(self, tick: np.ndarray) -> tuple[Codec, Codec]:
        row = records(tick)
        held = (self.link, self._stream, self._state, self._board, self._body)
        sent = (row, self.link, self._command, self._body, self.packet)
        return (link.receive, (row, self.chunk, self.meta, *held)), (link.send, sent)

    def _bind(self, tick: np.ndarray) -> tuple[Callable[[], int], Callable[[], int]]:
        (receive, received), (send, sent) = self._compiled_codec(tick)
        return bound(receive, *received), bound(send, *sent)

    def _forget(self) -> None:
        self._stream[:] = np.zeros(1, self._stream.dtype)
        row = self.link[0]
        row["started"] = row["fresh"] = row["older_in_row"] = row["identified"] = 0
        # of a board before: a fault flag of it would be shown until this one has sent its first sample
        row["status"] = 0
        row["damaged_now"] = row["older_now"] = row["enabled_in_row"] = row["driven"] = row["dropped"] = 0
        self._before = row.copy()

    def _greet(self, port: Port) -> None:
        """Ask until the board says who it is; refuse another board than before."""
        self._take_in(0)  # compiles before the clock below starts
        end = time.monotonic() + self._patience_s
        views: list[memoryview] = [self.chunk.data]
        ask, ask_at = self._packet(frame.TYPE_IDENTIFY), 0.0
        # samples alone do not do: they say nothing of who sends them
        while not self.link[0]["identified"]:
            now = time.monotonic()
            if now > end:
                raise BackendError(self._silence())
            if now >= ask_at:
                port.write(ask)
                ask_at = now + ASK_AGAIN_S
            # 1 ms more: a wait that ends a hair early would turn once more for nothing
            select.select([port.fd], [], [], min(ask_at, end) - now + 1e-3)
            self._take_in(port.read_into(views))
        self._check_identity()

    def _take_in(self, n: int) -> None:
        link.absorb(self.chunk, n, self.link, self._stream, self._state, self._board, self._body)

    def _silence(self) -> str:
        """Why no board was found, from what came instead."""
        row, before = self.link[0], self._before
        came = {name: int(row[name] - before[name]) for name in ("foreign", "good", "damaged")}
        text = f"serial port {self._path}: no board answered within {self._patience_s:g} s: "
        if came["foreign"]:
            return text + (
                "packets of another protocol version or number of axes came "
                f"(this side: version {frame.VERSION}, {self._rig.n_axes} axes)"
            )
        if came["good"]:
            return text + "samples came, but no identity: does the firmware answer identify packets?"
        if came["damaged"]:
            return (
                text + f"{came['damaged']} damaged packets came: is baud {self._baud} that of the firmware?"
            )
        return text + "not a packet came: is the board powered, its firmware one of docs/serial-protocol.md?"

    def _check_identity(self) -> None:
        board = self._board[0]
        name = bytes(board["serial_number"]).rstrip(b"\0").decode("ascii", "backslashreplace")
        # the board of this run before the one of the file: after a re-plug the joint's angle goes on with it
        wanted = self.identity or self._wanted
        if wanted is not None and name != wanted:
            raise BackendError(
                f"serial port {self._path}: board {name!r} answered, {wanted!r} is wanted: plug that one in, "
                "or name this one in [device.options] identity and start again"
            )
        if board["n_axes"] != self._rig.n_axes:
            raise BackendError(
                f"serial port {self._path}: board {name!r} has {board['n_axes']} axes, the rig file "
                f"{self._rig.n_axes}"
            )
        self._require_short_life(name, 1e-6 * float(board["cycle_us"]))
        self.identity = name

    def _require_short_life(self, name: str, cycle_s: float) -> None:
        """Refuse a time to live, which is in cycles of the board, that is too long or too short for the
        loop."""
        cycles, period_s = int(self.link[0]["time_to_live"]), self._rig.period_s
        life_s = cycles * cycle_s
        # the safety contract: without the host no torque after 10 periods (never asked below 10 ms); and one
        # command that comes late must not stop the motor. The clocks of board and loop differ a little.
        least_s, most_s = 2 * period_s, max(0.01, 10 * period_s)
        if not 0.99 * least_s <= life_s <= 1.01 * most_s:
            raise BackendError(
                f"serial port {self._path}: board {name!r} has a cycle of {1e6 * cycle_s:g} us: "
                f"time_to_live_cycles {cycles} are {1e3 * life_s:g} ms, and must be {1e3 * least_s:g} to "
                f"{1e3 * most_s:g}: 2 to 10 periods"
            )


def _settings(options: Options, rig: Rig, torque: bool) -> np.ndarray:
    """The link record of these options, its state zero."""
    record = np.zeros(1, link.link_dtype(rig.n_axes))
    row, channels = record[0], set(options["channels"])
    axes = list(options["axis"]) * (rig.n_axes if len(options["axis"]) == 1 else 1)
    if len(axes) != rig.n_axes:
        raise BackendError(
            f"serial: axis has {len(axes)} tables; give one for all, or {rig.n_axes}, one per axis"
        )
    for k, axis in enumerate(axes):
        # sign and resolution in one factor: angle and velocity cannot get different signs
        row["rad_per_count"][k] = axis["position_sign"] * 2 * math.pi / rig.encoder_counts_per_rev[k]
        row["offset_rad"][k] = axis["position_offset_rad"]
        row["motor_sign"][k] = axis["motor_sign"]
    row["torque_mode"], row["time_to_live"] = int(torque), options["time_to_live_cycles"]
    for channel in link.SHOWN:
        row["show_" + channel] = channel in channels
    # what the rig does not use may be missing: a board without a force sensor serves a rig without one
    unusable = frame.Status.DRIVE_FAULT
    unusable |= frame.Status.FORCE_MISSING if "force" in channels else 0
    unusable |= frame.Status.TEMPERATURE_MISSING if "temperature" in channels else 0
    unusable |= frame.Status.VELOCITY_MISSING if "velocity" in channels else 0
    unusable |= frame.Status.MOMENT_MISSING if "moment" in channels else 0
    row["unusable_status"] = int(unusable)
    return record
