"""Force sensors that stream frames on a serial port. Run in the loop process: no pydantic here."""

from __future__ import annotations

import contextlib
import select
import time
from collections.abc import Callable, Sequence

import numpy as np

from hw.force import optoforce, rokubi
from hw.force.axes import moment_matrix
from hw.force.frames import Frames
from hw.force.reading import Reading
from hw.force.sample import ForceSample
from hw.interface import BackendError, LinkFault, LinkLost, Options, Rig, Words
from hw.serial.backend import require_line_rate
from hw.serial_port import CHUNK, Port

FULL = CHUNK - 1
"""The kernel holds no more than this; what came after it is lost, so nothing in it is the newest."""

_CHECKSUM = int(LinkFault.CHECKSUM)


class SerialSensor:
    """The part all serial force sensors share: port, frames, freshness.

    Parameters
    ----------
    options
        Those of `SerialSensorOptions`, dumped.
    frames
        Cuts the stream.
    decode
        From an intact frame to a reading.
    scale, moment_scale
        Force and moment per unit of the reading's x, y, z, N and N m.
    start, farewell
        Bytes sent when opening and before closing.
    explain
        From the sensor's status to its words."""

    provides: frozenset[str] = frozenset({"force"})
    consumes: frozenset[str] = frozenset()

    def __init__(
        self,
        options: Options,
        frames: Frames,
        decode: Callable[[bytes], Reading],
        *,
        scale: tuple[float, float, float],
        moment_scale: tuple[float, float, float] = (1.0, 1.0, 1.0),
        start: bytes,
        farewell: bytes,
        explain: Callable[[int], str],
    ) -> None:
        self._path, self._baud = str(options["port"]), int(options["baud"])
        self._open_timeout_s = float(options["open_timeout_s"])
        self._frames, self._decode = frames, decode
        self._start, self._farewell, self._explain = start, farewell, explain
        moments = None
        if options["moments"]:
            self.provides = frozenset({"force", "moment"})
            moments = _scaled(moment_matrix(options), moment_scale)
        self._sample = ForceSample(_scaled(options["matrix"], scale), moments)
        self._port: Port | None = None
        self._buffer = bytearray(CHUNK)
        self._views = [memoryview(self._buffer)]
        self._overflows, self._behind = 0, False
        self._waiting: Reading | None = None

    def open(self) -> None:
        """Open the port, start the stream and wait for its first intact frame. Raises BackendError."""
        if self._port is not None:
            return
        self._port = Port(self._path, self._baud)
        # the port was flushed: half a frame from before must not be completed by bytes of today
        self._frames.forget()
        self._sample.forget()
        self._waiting, self._behind = None, False
        try:
            self._port.write(self._start)
            # a sensor may be powered by the rig itself, later: with 0 its silence shows as a stale sample
            if self._open_timeout_s:
                self._first(self._port)
        # Ctrl-C in the wait for a sensor, too: a port that stays locked keeps the next start out
        except BaseException:
            self.close()
            raise

    def _first(self, port: Port) -> None:
        end = time.monotonic() + self._open_timeout_s
        seen = 0
        while (left := end - time.monotonic()) > 0:
            # one wait for all that is left: a sensor that sends bytes and no frame ends after the same time
            select.select([port.fd], [], [], left)
            n = port.read_into(self._views)
            seen += n
            frame = self._frames.newest(bytes(self._buffer[:n]))
            if frame is not None:
                self._waiting = self._decode(frame)
                return
        what = f"{seen} bytes came, but no frame of this sensor" if seen else "nothing came"
        raise BackendError(
            f"force sensor on {self._path}: {what} within {self._open_timeout_s:g} s at {self._baud} baud: "
            "is it powered, is this its port, is baud its own?"
        )

    def read(self, tick: np.ndarray) -> None:
        """Show the newest intact frame that came since the last cycle. Raises LinkLost."""
        if self._port is None:
            raise LinkLost(f"force sensor on {self._path}: not open")
        frames, faults = self._frames, 0
        # the frame that opening has read, unless a newer one has come since
        newest, self._waiting = self._waiting, None
        n = self._port.read_into(self._views)
        # the loop stood still: the kernel keeps the oldest bytes and drops the newest, and may hand on in the
        # next cycle what it had no room for
        full, behind = n >= FULL, self._behind
        self._behind = full
        if full or behind:
            # before the first sample nobody was there to read
            self._overflows += full and self._sample.count > 0
            # the frame of opening, too: so much has come since that it is of no age that is known
            newest = None
            frames.forget()
        elif n:
            damaged = frames.damaged
            frame = frames.newest(bytes(self._buffer[:n]))
            if frame is not None:
                newest = self._decode(frame)
            if frames.damaged != damaged:
                faults = _CHECKSUM
        if newest is not None:
            faults |= self._sample.take(newest)
        self._sample.show(tick, faults)

    def write(self, tick: np.ndarray) -> None:
        """Nothing: a sensor takes no command."""
        if self._port is None:
            raise LinkLost(f"force sensor on {self._path}: not open")

    def stop(self) -> None:
        """Nothing: a sensor has no actuator."""

    def close(self) -> None:
        """Say farewell and release the port."""
        # first: a read from now on says that it is not open, in place of one from a closed descriptor
        port, self._port = self._port, None
        if port is not None:
            # a sensor that is unplugged needs no farewell; its port is released all the same
            with contextlib.suppress(LinkLost):
                if self._farewell:
                    port.write(self._farewell)
            port.close()

    def words(self) -> list[Words]:
        """See `SpeakingBackend`: why the sensor does not vouch for its newest reading."""
        status = self._sample.status
        return [Words(f"status {self._explain(status)}" if status else "")]

    def counts(self) -> dict[str, int]:
        """What the link has seen since it was made."""
        return {
            "received": self._frames.good,
            "checksum": self._frames.damaged,
            "refused": self._sample.refused,
            "repeated": self._sample.repeated,
            "overflows": self._overflows,
        }


def _scaled(matrix: Sequence[Sequence[float]], scale: tuple[float, float, float]) -> list[list[float]]:
    return [[entry * k for entry, k in zip(row, scale, strict=True)] for row in matrix]


def make_rokubi(options: Options, rig: Rig) -> SerialSensor:
    """Bota Systems' serial sensors; `options` are those of `RokubiOptions`, dumped."""
    return SerialSensor(
        options,
        Frames(rokubi.HEADER, rokubi.LENGTH, rokubi.intact),
        rokubi.decode,
        scale=(1.0, 1.0, 1.0),
        start=rokubi.START,
        farewell=rokubi.STOP if options["stop_at_close"] else b"",
        explain=rokubi.explain,
    )


def make_optoforce(options: Options, rig: Rig) -> SerialSensor:
    """The OptoForce / OnRobot DAQ; `options` are those of `OptoForceOptions`, dumped."""
    layout, sensor = options["layout"], int(options["sensor"]) - 1

    def _decode(frame: bytes) -> Reading:
        return optoforce.decode(frame, sensor)

    x, y, z = options["counts_per_n"]
    require_line_rate(
        options["port"], int(options["baud"]), optoforce.length(layout), float(options["output_hz"])
    )
    return SerialSensor(
        options,
        Frames(optoforce.header(layout), optoforce.length(layout), optoforce.intact),
        _decode,
        scale=(1.0 / x, 1.0 / y, 1.0 / z),
        moment_scale=tuple(1.0 / counts for counts in options["counts_per_nm"]),
        start=optoforce.configure(options["output_hz"], options["filter_hz"]),
        farewell=optoforce.configure(0, options["filter_hz"]),
        explain=optoforce.explain,
    )
