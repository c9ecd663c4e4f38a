"""Sets a CiA 402 drive up by SDO, with the canopen library, before the loop starts. May block."""

from __future__ import annotations

import struct
import time
from typing import TYPE_CHECKING

from hw.can.bus import Bus
from hw.interface import BackendError, Options

if TYPE_CHECKING:
    from canopen import Network, RemoteNode

CYCLIC_SYNCHRONOUS_TORQUE = 10
SHUT_DOWN = 0x06
_OFF, _NO_REMOTE = 0x8000_0000, 0x4000_0000
"""Bits of a PDO's COB-ID: it does not exist; no remote frame asks for it, which most drives have and refuse
to change."""
_RPDO = (0x6040_0010, 0x6071_0010)  # controlword u16, target torque i16
_TPDO = (0x6041_0010, 0x6064_0020)  # statusword u16, position i32; and one of these:
_CURRENT, _TORQUE = 0x6078_0010, 0x6077_0010  # i16, per mille of rated current, of rated torque
_TPDO2 = (0x606C_0020,)  # velocity i32
_SYNCHRONOUS = 1
_NO_ACTION = 0
"""Value of object 6007 with which a drive goes on as it is when it hears the host no more."""

# an object that is written twice has the same value: asking again does no harm
SDO_ATTEMPTS = 3
"""An object is asked for so often before the drive counts as silent: a frame may be lost on a busy line."""
_SEGMENT, _UPLOADED, _DOWNLOADED, _ABORT = 0, 2, 3, 4
"""What a server's answer is (CiA 301): its command specifier."""
MODE_S, MODE_ASKED = 0.5, 25
"""How long a drive may take to show the mode it was set to, and how often it is asked meanwhile."""


class RefusedError(BackendError):
    """The drive answers that it has no such object, or does not take that value."""


class SdoClient:
    """Reads and writes objects of one node on a network.

    A drive that is slow for once answers a request that was given up and repeated twice, the second time into
    the next request. canopen would take that for the next one's answer, a refusal too. So answers about
    another object are not heard."""

    def __init__(self, network: Network, node: RemoteNode, number: int) -> None:
        from canopen.sdo.exceptions import SdoAbortedError, SdoError

        self._node, self._number = node, number
        self._errors, self._aborted = (SdoError,), SdoAbortedError
        self._asked, self._answer = b"", 0
        # canopen's own way in, which takes every answer for one to what was asked last
        network.unsubscribe(node.sdo.tx_cobid, node.sdo.on_response)
        network.subscribe(node.sdo.tx_cobid, self._hear)

    def _hear(self, can_id: int, data: bytearray, timestamp: float) -> None:
        """Pass an answer on if it is one to what was asked last: command specifier in the three highest bits,
        object behind."""
        kind, of = data[0] >> 5, bytes(data[1:4])
        mine = of == self._asked and kind in (self._answer, _ABORT)
        # segments carry no object; what they belong to was checked when their transfer began
        if mine or kind == _SEGMENT:
            self._node.sdo.on_response(can_id, data, timestamp)

    def _ask(self, index: int, sub: int, answer: int) -> None:
        self._asked, self._answer = struct.pack("<HB", index, sub), answer

    def write(self, index: int, sub: int, value: int, size: int) -> None:
        """Download an unsigned or negative number of `size` bytes. Raises BackendError."""
        # exactly its size: a drive refuses a value that is longer than its object (CiA 301: 0607 0010h)
        data = (value & (1 << 8 * size) - 1).to_bytes(size, "little")  # two's complement of a negative one
        self._ask(index, sub, _DOWNLOADED)
        try:
            self._node.sdo.download(index, sub, data)
        except self._errors as error:
            raise self._error("write", index, sub, error) from error

    def read(self, index: int, sub: int) -> int:
        """Upload an unsigned number. Raises BackendError."""
        self._ask(index, sub, _UPLOADED)
        try:
            return int.from_bytes(self._node.sdo.upload(index, sub), "little")
        except self._errors as error:
            raise self._error("read", index, sub, error) from error

    def try_write(self, index: int, sub: int, value: int, size: int) -> bool:
        """Download where the drive takes it; False where it does not. Raises BackendError if it is silent."""
        try:
            self.write(index, sub, value, size)
        except RefusedError:
            return False
        return True

    def try_read(self, index: int, sub: int) -> int | None:
        """Upload; None where the drive has no such object. Raises BackendError if it is silent."""
        try:
            return self.read(index, sub)
        except RefusedError:
            return None

    def _error(self, what: str, index: int, sub: int, error: Exception) -> BackendError:
        # an abort is an answer: the drive is there. A time-out is none, and never passed over
        kind = RefusedError if isinstance(error, self._aborted) else BackendError
        return kind(
            f"cia402 node {self._number}: cannot {what} object {index:04X}:{sub:02X}: {error}; check power, "
            "wiring, node id, bit rate, and that the drive supports cyclic synchronous torque (mode 10)"
        )


def configure(
    bus: Bus, node: int, table: Options, options: Options, period_s: float
) -> tuple[float, float | None, bytes]:
    """Mode, PDO mapping, heartbeats both ways; then operational.

    Returns
    -------
    rated_torque_nm : float
        From the options, or else from object 6076.
    rated_current_a : float or None
        From the options, or else from object 6075; None: the drive shows its torque (6077) in place of its
        current.
    identity : bytes
        Vendor, product and serial number (object 1018); 0 for what the drive does not tell.

    Raises
    ------
    BackendError
        A drive that does not answer, refuses an object, or says nothing about its rating."""
    try:
        import canopen
    except ModuleNotFoundError as error:
        raise BackendError("cia402 drives need canopen: pip install 'rtctl[can]'") from error
    wire = bus.fresh_python_can()
    network = canopen.Network(bus=wire)
    try:
        network.connect()
        remote = network.add_node(node, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]
        # canopen's own: .3 s, and one attempt
        remote.sdo.RESPONSE_TIMEOUT, remote.sdo.MAX_RETRIES = options["sdo_timeout_s"], SDO_ATTEMPTS
        sdo = SdoClient(network, remote, node)
        # first of all: a strict drive changes no PDO while it is operational
        remote.nmt.state = "PRE-OPERATIONAL"  # no PDO is sent or obeyed in this state (CiA 301)
        _take_down(sdo)
        torque_nm = _rated(sdo, node, table, "torque_nm", 0x6076)
        # 1018: vendor, product, serial number; 3 is the revision. Only the vendor is mandatory (CiA 301)
        vendor, *rest = sdo.read(0x1018, 1), sdo.try_read(0x1018, 2), sdo.try_read(0x1018, 4)
        identity = struct.pack("<3I", vendor, *(number or 0 for number in rest))
        _map(sdo, 0x1400, 0x1600, 0x200 + node, _RPDO)
        current = _map_feedback(sdo, node)
        # not asked for where the torque is mapped in place of the current: such a drive may not have 6075
        current_a = _rated(sdo, node, table, "current_a", 0x6075) if current == _CURRENT else None
        if table["velocity_units"]:
            _map(sdo, 0x1801, 0x1A01, 0x280 + node, _TPDO2)
        # before it is operational: no drive may obey a torque whose host it does not watch
        _supervise(sdo, node, options)
        sdo.write(0x6060, 0, CYCLIC_SYNCHRONOUS_TORQUE, 1)
        _set_period(sdo, node, period_s)
        remote.nmt.state = "OPERATIONAL"
        _require_mode(sdo, node)
    finally:
        if network.notifier is not None:  # its thread would run on beside the loop
            network.notifier.stop(1.0)
        bus.release(wire)
    return torque_nm, current_a, identity


def _take_down(sdo: SdoClient) -> None:
    """Power stage off before anything else: who died may have left it on, and `rtctl stop-rig` has no other
    purpose."""
    sdo.try_write(0x6040, 0, SHUT_DOWN, 2)
    sdo.try_write(0x6071, 0, 0, 2)


def _rated(sdo: SdoClient, node: int, table: Options, what: str, index: int) -> float:
    """Rated torque or current, from the options or the drive. Raises BackendError unless it is above 0."""
    # 6076 is in mN m, 6075 in mA (CiA 402-2)
    rated = float(table[f"rated_{what}"] or 1e-3 * sdo.read(index, 0))
    # a rating of 0 would divide every command by 0
    if rated <= 0:
        raise BackendError(
            f"cia402 node {node}: rated_{what} {rated} (object {index:04X}) must be above 0: set it on the "
            f"drive, or rated_{what} in its [[device.options.axis]]"
        )
    return rated


def _map(sdo: SdoClient, communication: int, mapping: int, cob_id: int, objects: tuple[int, ...]) -> None:
    """Change a PDO the way CiA 301 demands: off, count 0, objects, count, type, id, on.

    Its id may not change while it exists, and bit 30 stays what the drive says."""
    # asked, not assumed: some drives refuse a bit 30 other than theirs
    before = sdo.read(communication, 1)
    wanted = before & _NO_REMOTE | cob_id
    # a PDO that does not exist need not be switched off
    if not before & _OFF:
        sdo.write(communication, 1, _OFF | before, 4)
    # entries may change only while the count is 0 (CiA 301, objects 1600 and 1A00)
    sdo.write(mapping, 0, 0, 1)
    for sub, entry in enumerate(objects, start=1):
        sdo.write(mapping, sub, entry, 4)
    sdo.write(mapping, 0, len(objects), 1)
    sdo.write(communication, 2, _SYNCHRONOUS, 1)
    # off and with its new identifier first, then on: both at once is a change while it exists
    if _OFF | before != _OFF | wanted:
        sdo.write(communication, 1, _OFF | wanted, 4)
    sdo.write(communication, 1, wanted, 4)


def _map_feedback(sdo: SdoClient, node: int) -> int:
    """Map statusword, position and current, or torque where the drive does not show a current; returns
    which."""
    try:
        _map(sdo, 0x1800, 0x1A00, 0x180 + node, (*_TPDO, _CURRENT))
    except RefusedError as current:
        try:
            _map(sdo, 0x1800, 0x1A00, 0x180 + node, (*_TPDO, _TORQUE))
        except RefusedError as torque:
            raise BackendError(f"{torque}; with the current (6078) in its place: {current}") from torque
        return _TORQUE
    return _CURRENT


def interpolation_time(period_s: float) -> tuple[int, int]:
    """Object 60C2 for a period: value of 1 to 255 and exponent of ten, as exact as it gets, in whole ms if
    they do."""
    # the default of CiA 402 (object 60C2)
    best = (1, -3)  # 1 ms, where no exponent gives 1 to 255
    for exponent in (-3, -4, -5, -6):
        # the value is an unsigned byte: 3.33 ms of 300 Hz are 33 of 0.1 ms
        value = round(period_s / 10.0**exponent)
        if not 1 <= value <= 255:
            continue
        best = value, exponent
        if abs(value * 10.0**exponent - period_s) < 1e-9:
            break
    return best


def _set_period(sdo: SdoClient, node: int, period_s: float) -> None:
    """Tell the drive how often a torque comes (60C2), where it has that object; in the order it takes."""
    value, exponent = interpolation_time(period_s)
    wanted = {1: value, 2: exponent & 0xFF}  # an int8
    # not every drive in torque mode has it: without interpolation it needs no period
    if sdo.try_read(0x60C2, 1) is None:
        return
    # a drive that checks each write may refuse the period that lies between the old and the new one
    for order in ((1, 2), (2, 1)):
        if all(sdo.try_write(0x60C2, sub, wanted[sub], 1) for sub in order):
            break
    shown = {sub: sdo.read(0x60C2, sub) & 0xFF for sub in wanted}
    # read back: drives that take the write and keep their own period say so only when asked
    if shown != wanted:
        exponent = shown[2] - 0x100 if shown[2] & 0x80 else shown[2]
        raise BackendError(
            f"cia402 node {node}: wants a torque every {1e3 * shown[1] * 10.0**exponent:g} ms (object 60C2) "
            f"and takes no other period: set it on the drive to {1e3 * period_s:g} ms, or [loop] rate_hz to "
            "what it wants"
        )


def _require_mode(sdo: SdoClient, node: int) -> None:
    """Wait until the drive shows the mode it was set to: a torque meant in another one may be a speed."""
    for _ in range(MODE_ASKED):
        shown = sdo.read(0x6061, 0) & 0xFF
        if shown == CYCLIC_SYNCHRONOUS_TORQUE:
            return
        time.sleep(MODE_S / MODE_ASKED)
    raise BackendError(
        f"cia402 node {node}: set to cyclic synchronous torque (6060 = 10), it shows mode {shown} (6061): "
        "check that it supports mode 10 (object 6502, bit 9), and that nothing else chooses its mode"
    )


def _supervise(sdo: SdoClient, node: int, options: Options) -> None:
    """The drive watches our heartbeat and we watch its; when ours ends it must stop (6007 = 1: fault).

    Raises BackendError if the drive cannot watch it, or would do nothing: nothing else stops it when the host
    dies."""
    # CiA 301: node in bits 16 to 22, milliseconds below
    # the drive watches this one node: heartbeats of others do not feed its watchdog
    consumer = int(options["source"]) << 16 | int(options["time_to_live_ms"])
    sdo.write(0x1016, 1, consumer, 4)
    sdo.write(0x1017, 0, int(options["heartbeat_ms"]), 2)
    # a drive that lets nothing be written may do what is wanted by itself: asked, not assumed
    if not sdo.try_write(0x6007, 0, 1, 2) and sdo.try_read(0x6007, 0) == _NO_ACTION:
        raise BackendError(
            f"cia402 node {node}: goes on as it is when the host's heartbeat ends (object 6007 is 0) and "
            "does not let that be changed: set 6007 to 1 (fault), 2 (off) or 3 (quick stop) on the drive"
        )
