"""A force sensor that streams RDT records over UDP. Runs in the loop process: no pydantic here."""

from __future__ import annotations

import contextlib
import select
import socket
import time

import numpy as np

from hw.force import rdt
from hw.force.axes import moment_matrix
from hw.force.reading import Reading
from hw.force.sample import ForceSample
from hw.interface import BackendError, LinkFault, LinkLost, Options, Rig, Words

# 36 ms of the quickest sensor (7 kHz): more than any cycle leaves, and bounded work where it floods
DRAIN_MOST = 256
"""Datagrams taken in one cycle. A cycle that finds more shows nothing fresh: newer ones wait behind them."""

# rarely: what a sensor that streams already makes of a request is its own affair
ASK_AGAIN_S = 0.5
"""How often a silent sensor is asked to stream: one that was switched off forgets that it was asked."""

_LOST, _CHECKSUM = int(LinkFault.LOST), int(LinkFault.CHECKSUM)
# numbers of 32 bits start over after 7 days at 7 kHz: compared by difference, never by size
_HALF = 1 << 31
_WRAP = (1 << 32) - 1


class RdtBackend:
    """ATI Net F/T, Axia, OnRobot HEX, Schunk: `options` are those of `RdtOptions`, dumped.

    UDP has no hang-up: a sensor that is silent for `lost_after_s` shows as `LinkFault.LOST`, and is asked
    again and again to stream. A record older than the last one is never used."""

    provides: frozenset[str] = frozenset({"force"})
    consumes: frozenset[str] = frozenset()

    def __init__(self, options: Options, rig: Rig) -> None:
        self._where = (str(options["host"]), int(options["port"]))
        self._name = f"RDT sensor {self._where[0]}:{self._where[1]}"
        # counts and axes in one matrix: nine products a sample, not twelve
        scale = 1.0 / options["counts_per_n"]
        self._matrix = [[scale * entry for entry in row] for row in options["matrix"]]
        self._lost_after_ns = round(options["lost_after_s"] * 1e9)
        self._open_timeout_s = float(options["open_timeout_s"])
        self._socket: socket.socket | None = None
        # longer than any record: `recv_into` cuts a datagram off at its buffer, and one that is too long
        # would look like one that fits
        self._buffer = bytearray(2048)
        self._view = memoryview(self._buffer)
        moments = None
        if options["moments"]:
            self.provides = frozenset({"force", "moment"})
            moments = [[entry / options["counts_per_nm"] for entry in row] for row in moment_matrix(options)]
        self._sample = ForceSample(self._matrix, moments)
        self._reset()

    def _reset(self) -> None:
        self._sample.forget()
        # below every number of 32 bits: nothing has come yet
        self._number = -1
        self._behind = False
        self._begun = False  # no sample was shown yet: what came while others were opened is not missed
        self._heard_ns = self._asked_ns = 0
        self._received = self._lost = self._older = self._malformed = 0

    def open(self) -> None:
        """Ask the sensor to stream and wait for its first record. Raises BackendError."""
        if self._socket is not None:
            return
        try:
            # a name is looked up here, once: a name server may take seconds
            family, _, _, _, address = socket.getaddrinfo(*self._where, type=socket.SOCK_DGRAM)[0]
            made = socket.socket(family, socket.SOCK_DGRAM)
        except OSError as error:
            raise BackendError(f"{self._name}: {error.strerror or error}: check host") from error
        try:
            # before anything else: no call of the loop may wait for the network
            made.setblocking(False)
            # UDP knows no connection, but the kernel then drops what others send to this port, and tells of a
            # host that refuses
            made.connect(address)
        except OSError as error:
            made.close()
            raise BackendError(f"{self._name}: {error.strerror}: is the network up?") from error
        self._reset()
        self._socket = made
        # silence counts from here on, not from the start of the machine
        self._heard_ns = time.monotonic_ns()
        self._ask(self._heard_ns)
        if self._open_timeout_s and not self._first(made):
            self.close()
            raise BackendError(
                f"{self._name}: no record within {self._open_timeout_s:g} s: is it on, is RDT enabled on its "
                f"configuration page, does a firewall drop UDP port {self._where[1]}?"
            )

    def _first(self, made: socket.socket) -> bool:
        """Wait for something to arrive; it is left for the first read."""
        end = time.monotonic() + self._open_timeout_s
        while (left := end - time.monotonic()) > 0:
            if select.select([made], [], [], left)[0]:
                try:
                    # looked at, not taken: `read` decodes it, and it alone keeps the counters
                    made.recv(1, socket.MSG_PEEK)
                except OSError:  # refused by the host there: its stream is not up yet
                    time.sleep(0.01)
                    self._ask(time.monotonic_ns())
                else:
                    return True
        return False

    def _ask(self, now_ns: int) -> None:
        self._asked_ns = now_ns
        if self._socket is not None:
            with contextlib.suppress(OSError):
                # a request that does not leave is asked again after ASK_AGAIN_S: silence tells
                self._socket.send(rdt.request(rdt.START_REALTIME))

    def read(self, tick: np.ndarray) -> None:
        """Show the newest record. Raises LinkLost when not open."""
        if self._socket is None:
            raise LinkLost(f"{self._name}: not open")
        before = self._malformed
        newest, drained = self._drain(self._socket)
        # what was left waiting is of this cycle at best: nothing of the next one is known to be new
        behind, self._behind = self._behind, not drained
        faults = 0 if self._malformed == before else _CHECKSUM
        now_ns = time.monotonic_ns()
        if newest is not None:
            self._heard_ns = now_ns
            if drained and not behind:
                faults |= self._sample.take(newest)
                self._begun = True
        # an older record is not heard: a sensor that was switched off and on counts from the beginning, and
        # is taken anew only once it counts as lost
        elif now_ns - self._heard_ns > self._lost_after_ns:
            faults |= _LOST
            self._number = -1  # after a restart the sensor counts from the beginning
            # a sensor that was switched off and on has forgotten that it was asked to stream
            if now_ns - self._asked_ns > ASK_AGAIN_S * 1e9:
                self._ask(now_ns)
        self._sample.show(tick, faults)

    def _drain(self, made: socket.socket) -> tuple[Reading | None, bool]:
        """The newest record waiting, and whether none is left behind it."""
        newest = None
        for _ in range(DRAIN_MOST):
            try:
                n = made.recv_into(self._buffer)
            except BlockingIOError:
                return newest, True
            except OSError:  # refused: nobody listens there just now; silence tells
                return newest, True
            # no record: somebody else's, or cut off on its way
            if n != rdt.LENGTH:
                self._malformed += 1
                continue
            number, reading = rdt.decode(self._view[: rdt.LENGTH])
            # UDP may turn records round or send one twice: 0 is a double, half the range or more an older one
            step = (number - self._number) & _WRAP
            if self._number >= 0 and not 0 < step < _HALF:
                self._older += 1
                continue
            if self._number >= 0 and self._begun:
                # only once a sample was shown: before, records queue up unread while other devices are opened
                self._lost += step - 1
            self._number, newest = number, reading
            self._received += 1
        return newest, False

    def write(self, tick: np.ndarray) -> None:
        """Nothing: a sensor takes no command."""
        if self._socket is None:
            raise LinkLost(f"{self._name}: not open")

    def stop(self) -> None:
        """Nothing: a sensor has no actuator."""

    def close(self) -> None:
        """Ask the sensor to stop streaming and release the socket."""
        made, self._socket = self._socket, None
        if made is not None:
            with contextlib.suppress(OSError):
                # else it floods the port of whoever has that number next
                made.send(rdt.request(rdt.STOP))
            made.close()

    def words(self) -> list[Words]:
        """See `SpeakingBackend`: why the sensor does not vouch for its newest record."""
        status = self._sample.status
        return [Words(f"status 0x{status:08x}" if status else "")]

    def counts(self) -> dict[str, int]:
        """What the link has seen since `open`."""
        return {
            "received": self._received,
            "lost": self._lost,
            "older": self._older,
            "malformed": self._malformed,
            "refused": self._sample.refused,
            "repeated": self._sample.repeated,
        }
