"""slcan adapters (LAWICEL's ASCII protocol: CANable, CANtact, USBtin) on the bare serial port.

python-can reads such a port byte by byte, which costs some 45 us a frame; one read of all that waits and a
split cost a few. Classic frames only; with `raw = false`, CAN FD or arguments of python-can's, its own bus
is used. Measured by `rtctl bench io`."""

from __future__ import annotations

import contextlib
import struct
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING

from hw.can.batch import STRIDE, Batch
from hw.can.bus import EXTENDED, LINE_FULL, LINE_MAX, LINE_READS, REMOTE, Handler
from hw.can.health import BusHealth
from hw.interface import BackendError, LinkLost, Options
from hw.serial_port import CHUNK, Port

if TYPE_CHECKING:
    from can import BusABC

RATES = {
    10_000: 0,
    20_000: 1,
    50_000: 2,
    100_000: 3,
    125_000: 4,
    250_000: 5,
    500_000: 6,
    800_000: 7,
    1_000_000: 8,
}
ARGUMENTS = frozenset({"tty_baudrate", "sleep_after_open", "timeout"})
"""Arguments of python-can's adapter that are accepted here; `timeout` is accepted and has no effect."""

# as struct can_frame: compiled cycles then know one layout, whichever way a frame came
HEAD = struct.Struct("=IB3x")
"""What lies before the data of a frame as the kernel's CAN has it."""

_BELL = b"\x07"
_STANDARD, _EXTENDED, _STANDARD_REMOTE, _EXTENDED_REMOTE = b"tTrR"
_LONGEST = LINE_MAX
# an adapter answers within a USB frame or two; many never do
_ANSWER_S = 0.2


def parse(line: bytes) -> tuple[int, bytes] | None:
    """Identifier with flags and data of one line (without its end); None unless it is a whole frame."""
    # `int` takes blanks, signs and _, and `fromhex` blanks
    # t, three digits and a length are the least
    if len(line) < 5 or not line.isalnum():
        return None
    kind = line[0]
    digits = 8 if kind in (_EXTENDED, _EXTENDED_REMOTE) else 3
    if kind not in (_STANDARD, _EXTENDED, _STANDARD_REMOTE, _EXTENDED_REMOTE) or len(line) < digits + 2:
        return None
    length = line[digits + 1] - 48
    remote = kind in (_STANDARD_REMOTE, _EXTENDED_REMOTE)
    end = digits + 2 + (0 if remote else 2 * length)
    if not 0 <= length <= 8 or len(line) not in (end, end + 4):  # four more: a time stamp
        return None
    if line[2] in b"xX":  # `int` would take 0x for a prefix
        return None
    try:
        can_id, data = int(line[1 : digits + 1], 16), bytes.fromhex(line[digits + 2 : end].decode())
    except ValueError:
        return None
    if can_id > (0x1FFF_FFFF if digits == 8 else 0x7FF):
        return None
    return can_id | (EXTENDED if digits == 8 else 0) | (REMOTE if remote else 0), data


class SlcanFrame:
    """A frame whose data is changed in place and written as a line."""

    __slots__ = ("buffer", "can_id", "head", "length", "offset")

    def __init__(self, can_id: int, length: int) -> None:
        self.can_id = can_id
        remote = bool(can_id & REMOTE)
        letter = ("R" if remote else "T") if can_id & EXTENDED else ("r" if remote else "t")
        digits = 8 if can_id & EXTENDED else 3
        # upper case, as LAWICEL's manual has it
        self.head = f"{letter}{can_id & 0x1FFF_FFFF:0{digits}X}{length}"
        # a remote frame says a length and carries no data
        self.buffer, self.offset, self.length = bytearray(0 if remote else length), 0, length


class SlcanBus:
    """One adapter. Raises BackendError if it cannot be opened or refuses the bit rate."""

    lines = True
    """See `SteadyBus`."""

    def __init__(self, options: Options) -> None:
        self.health = BusHealth()
        self._options, self._name = options, f"CAN slcan {options['channel']}"
        self._handlers: dict[int, Handler] = {}
        self._buffer = bytearray(CHUNK)
        self._views = [memoryview(self._buffer)]
        self._open()

    def _open(self) -> None:
        arguments = self._options["arguments"]
        self._left, self._lost = b"", ""
        self._cut = self._belled = False
        self._kept = 0, 0
        # 115200 is what python-can takes; adapters with USB of their own ignore it
        self._port = Port(self._options["channel"], int(arguments.get("tty_baudrate", 115200)))
        # Arduino boards reset when DTR rises at opening, and hear nothing for a second or two
        time.sleep(float(arguments.get("sleep_after_open", 0.0)))
        rate = self._options["bitrate"]
        try:
            # refused before anything is sent: S0 to S8 are all the rates that the protocol has
            if rate not in RATES:
                raise BackendError(f"{self._name}: bitrate {rate} is none of {sorted(RATES)}")
            # closed first: the bit rate of an open channel cannot be changed (LAWICEL: BELL)
            self._command(b"\rC\r", 0.02)  # the first end of line ends what another program has left half
            for command in (b"S%d\r" % RATES[rate], b"O\r"):
                if _BELL in self._command(command, _ANSWER_S):
                    raise BackendError(
                        f"{self._name}: the adapter refused {command.decode().strip()!r}: is it in use, or "
                        "another kind?"
                    )
        except BackendError:
            self._port.close()
            raise

    def _command(self, command: bytes, seconds: float) -> bytes:
        """Send a command and collect its answer; an adapter that does not answer is no error."""
        self._port.write(command)
        deadline, answer = time.monotonic() + seconds, b""
        # CR says yes, BELL says no; no answer is taken for yes: old firmware has none
        while time.monotonic() < deadline and not answer.endswith((b"\r", _BELL)):
            n = self._port.read_into(self._views)
            answer += self._buffer[:n]
            if n == 0:
                time.sleep(1e-3)
        return answer

    def fileno(self) -> int:
        """Descriptor of the port."""
        return self._port.fd

    def use(self, batch: Batch) -> None:
        """See `SteadyBus`."""
        self._batch = batch

    def packed(self, frame: SlcanFrame) -> bytes:
        """See `SteadyBus`."""
        return HEAD.pack(frame.can_id, frame.length) + frame.buffer

    def keep(self, begin: int, end: int, rest: bytes, error: int) -> None:
        """See `SteadyBus`; an error of a port comes again."""
        del error
        self._kept, self._left = (begin, end), rest

    def _take_kept(self) -> None:
        """Look at what compiled code has left: frames, then the bytes behind them."""
        (begin, end), self._kept = self._kept, (0, 0)
        for at in range(begin * STRIDE, end * STRIDE, STRIDE):
            can_id, length = HEAD.unpack_from(self._batch.buffer, at)
            handler = self._handlers.get(can_id)
            if handler is not None:
                handler(self._batch.buffer, at + HEAD.size, length)
        # what compiled code could not read as a frame: it may be whole lines by now, or a refusal
        if self._left:
            self._take(b"")

    def rest(self) -> bytes:
        """See `SteadyBus`: the beginning of a line."""
        rest, self._left = self._left, b""
        return rest

    def subscribe(self, handlers: Mapping[int, Handler]) -> None:
        """Have `receive` call these; all other frames are dropped."""
        self._handlers = dict(handlers)

    def receive(self) -> bool:
        """Hand every waiting frame to its handler. Raises LinkLost."""
        if self._lost:
            raise LinkLost(self._lost)
        self._take_kept()
        for k in range(LINE_READS):
            try:
                n = self._port.read_into(self._views)
            except LinkLost as error:
                self._lost = f"{self._name}: {error}"
                raise
            if n:
                self._take(bytes(self._buffer[:n]))
            if n < LINE_FULL:
                return k == 0  # else the line has been full: what was read last may be of any age
        return False

    def _take(self, data: bytes) -> None:
        data = self._left + data
        if refused := _BELL in data:  # the adapter has refused a frame
            self.health.refused()
            self._belled = True
            data = data.replace(_BELL, b"")
        *lines, self._left = data.split(b"\r")
        # no adapter writes so long a line: it is noise, or another bit rate
        if len(self._left) > _LONGEST:
            self.health.counts["damaged"] += 1
            self._left = b""
        for line in lines:
            if not line or line in (b"z", b"Z"):  # the adapter has taken a frame
                # only its own word ends a refusal: the port takes what the adapter then refuses
                if self._belled and not refused:
                    self._belled = False
                    self.health.taken()
                continue
            found = parse(line)
            if found is None:
                self.health.counts["damaged"] += 1
                continue
            handler = self._handlers.get(found[0])
            if handler is not None:
                handler(found[1], 0, len(found[1]))

    def outgoing(self, can_id: int, length: int) -> SlcanFrame:
        """Make a frame that can be sent; its data is all zero."""
        return SlcanFrame(can_id, length)

    def send(self, frame: SlcanFrame) -> bool:
        """Write a frame; False when the port takes no more. Raises LinkLost.

        A port that is nearly full takes a part of a line: the line after it begins with an end of line."""
        if self._lost:
            raise LinkLost(self._lost)
        # not behind a BELL alone: some adapters answer an empty line by one, which would never end
        cut = self._cut or (self.health.refused_in_a_row and not self._belled)
        begin = "\r" if cut else ""
        try:
            # one write for head, data and end: a line in two writes may be cut between them
            sent = self._port.write(f"{begin}{frame.head}{frame.buffer.hex().upper()}\r".encode())
        except LinkLost as error:
            self._lost = f"{self._name}: {error}"
            raise
        # the adapter holds a part of the line: an end of line goes before the next one
        self._cut = not sent
        if not sent:
            self.health.refused()
        elif self.health.refused_in_a_row and not self._belled:
            self.health.taken()
        return sent

    def discard(self) -> None:
        """Throw away what waits for the adapter: a stop is not to queue behind older commands."""
        self._port.discard_output()

    def fresh_python_can(self) -> BusABC:
        """python-can's bus on the port, in place of ours until `release`."""
        from hw.can.adapter import AdapterBus

        self._port.close()
        # one port, one reader: two would each get a part of the answers
        self._other = AdapterBus(self._options)
        return self._other.fresh_python_can()

    def release(self, bus: object) -> None:
        """Take the port back."""
        self._other.close()
        self._open()

    def close(self) -> None:
        """Close the channel of the adapter and the port."""
        if not self._lost:
            self._lost = f"{self._name}: closed"
            with contextlib.suppress(LinkLost):
                # a channel that stays open would acknowledge frames on the bus, and hide that nobody listens
                self._port.write(b"C\r")
        self._port.close()
