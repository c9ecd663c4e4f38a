"""Sets a CiA 402 drive up by SDO, with the canopen library, before the loop starts. May block."""

from __future__ import annotations

import struct
from typing import Any

from hw.can.bus import Bus
from hw.interface import BackendError, Options

CYCLIC_SYNCHRONOUS_TORQUE = 10
_OFF = 0x8000_0000
_RPDO = (0x6040_0010, 0x6071_0010)  # controlword u16, target torque i16
_TPDO = (0x6041_0010, 0x6064_0020, 0x6078_0010)  # statusword u16, position i32, current i16
_TPDO2 = (0x606C_0020,)  # velocity i32
_SYNCHRONOUS = 1

SDO_ATTEMPTS = 3
"""An object is asked for so often before the drive counts as silent: a frame may be lost on a busy line."""


class SdoClient:
    """Reads and writes objects of one node."""

    def __init__(self, node: Any, number: int) -> None:  # noqa: ANN401
        from canopen.sdo.exceptions import SdoError

        self._node, self._number = node, number
        self._errors = (SdoError,)

    def write(self, index: int, sub: int, value: int, size: int) -> None:
        """Download an unsigned or negative number of `size` bytes. Raises BackendError."""
        data = (value & (1 << 8 * size) - 1).to_bytes(size, "little")
        try:
            self._node.sdo.download(index, sub, data)
        except self._errors as error:
            raise self._error("write", index, sub, error) from error

    def read(self, index: int, sub: int) -> int:
        """Upload an unsigned number. Raises BackendError."""
        try:
            return int.from_bytes(self._node.sdo.upload(index, sub), "little")
        except self._errors as error:
            raise self._error("read", index, sub, error) from error

    def try_write(self, index: int, sub: int, value: int, size: int) -> bool:
        """Download where the drive has the object; False where it has not."""
        try:
            self.write(index, sub, value, size)
        except BackendError:
            return False
        return True

    def _error(self, what: str, index: int, sub: int, error: Exception) -> BackendError:
        return BackendError(
            f"cia402 node {self._number}: cannot {what} object {index:04X}:{sub:02X}: {error}; check power, wiring, "
            "node id, bit rate, and that the drive supports cyclic synchronous torque (mode 10)"
        )


def configure(bus: Bus, node: int, table: Options, options: Options) -> tuple[float, float, bytes]:
    """Mode, PDO mapping, heartbeats both ways; then operational.

    Returns
    -------
    rated_torque_nm, rated_current_a : float
        From the options, or else from objects 6076 and 6075.
    identity : bytes
        Vendor, product and serial number (object 1018).

    Raises
    ------
    BackendError
        A drive that does not answer, refuses an object, or says nothing about its rating.
    """
    try:
        import canopen
    except ModuleNotFoundError as error:
        raise BackendError("cia402 drives need canopen: pip install 'rtctl[can]'") from error
    wire = bus.fresh_python_can()
    network = canopen.Network(bus=wire)
    try:
        network.connect()
        remote = network.add_node(node, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]
        remote.sdo.RESPONSE_TIMEOUT, remote.sdo.MAX_RETRIES = options["sdo_timeout_s"], SDO_ATTEMPTS
        sdo = SdoClient(remote, node)
        remote.nmt.state = "PRE-OPERATIONAL"
        found = _rated(sdo, node, table)
        identity = struct.pack("<3I", *(sdo.read(0x1018, sub) for sub in (1, 2, 4)))
        _map(sdo, 0x1400, 0x1600, 0x200 + node, _RPDO)
        _map(sdo, 0x1800, 0x1A00, 0x180 + node, _TPDO)
        if table["velocity_units"]:
            _map(sdo, 0x1801, 0x1A01, 0x280 + node, _TPDO2)
        _supervise(sdo, options)
        sdo.write(0x6060, 0, CYCLIC_SYNCHRONOUS_TORQUE, 1)
        remote.nmt.state = "OPERATIONAL"
    finally:
        if network.notifier is not None:
            network.notifier.stop(1.0)
        bus.release(wire)
    return (*found, identity)


def _rated(sdo: SdoClient, node: int, table: Options) -> tuple[float, float]:
    torque_nm = table["rated_torque_nm"] or 1e-3 * sdo.read(0x6076, 0)
    current_a = table["rated_current_a"] or 1e-3 * sdo.read(0x6075, 0)
    if torque_nm <= 0 or current_a <= 0:
        raise BackendError(
            f"cia402 node {node}: rated torque {torque_nm} N m (object 6076) and current {current_a} A (6075) must be "
            "above 0: set them on the drive, or rated_torque_nm and rated_current_a in its [[device.options.axis]]"
        )
    return torque_nm, current_a


def _map(sdo: SdoClient, communication: int, mapping: int, cob_id: int, objects: tuple[int, ...]) -> None:
    """Change a PDO the way CiA 301 demands: off, count 0, objects, count, type, on."""
    sdo.write(communication, 1, _OFF | cob_id, 4)
    sdo.write(mapping, 0, 0, 1)
    for sub, entry in enumerate(objects, start=1):
        sdo.write(mapping, sub, entry, 4)
    sdo.write(mapping, 0, len(objects), 1)
    sdo.write(communication, 2, _SYNCHRONOUS, 1)
    sdo.write(communication, 1, cob_id, 4)


def _supervise(sdo: SdoClient, options: Options) -> None:
    """The drive watches our heartbeat and we watch its; when ours ends it must stop (6007 = 1: fault).

    Raises BackendError if the drive cannot watch it: without that, nothing stops it when the host dies.
    """
    consumer = int(options["source"]) << 16 | int(options["time_to_live_ms"])
    sdo.write(0x1016, 1, consumer, 4)
    sdo.write(0x1017, 0, int(options["heartbeat_ms"]), 2)
    sdo.try_write(0x6007, 0, 1, 2)
