"""`read`, `write` and `recvmmsg` of the C library, in compiled code, on descriptors that do not block."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numba import types

from hw.jit import compiled

_numba: Any = numba  # these have no types
_types: Any = types
carray = _numba.carray

# by symbol, as `rtctl.rt.clock` sleeps: a call through ctypes costs microseconds (decision 0003)
_read: Any = types.ExternalFunction("read", types.intp(types.int32, types.voidptr, types.uintp))
_write: Any = types.ExternalFunction("write", types.intp(types.int32, types.voidptr, types.uintp))
_receive: Any = types.ExternalFunction(
    "recvmmsg", types.int32(types.int32, types.intp, types.uint32, types.int32, types.intp)
)
# glibc's: errno has a place of its own in every thread
_errno: Any = types.ExternalFunction("__errno_location", _types.CPointer(types.int32)())

# below every number of bytes, and none that a call gives with another meaning
FAILED = -1
_NOT_NOW = (
    11,
    4,
    105,
)  # EAGAIN (EWOULDBLOCK is the same), EINTR; ENOBUFS: the queue of a CAN interface is full
_DONT_WAIT = 0x40  # MSG_DONTWAIT


@compiled
def last_error() -> int:
    """Number of the error (errno) of the call that failed just now."""
    return int(carray(_errno(), (1,))[0])


@compiled
def _must_wait() -> bool:
    """Whether the call that failed just now only had nothing to do."""
    number = last_error()
    return bool(number == _NOT_NOW[0] or number == _NOT_NOW[1] or number == _NOT_NOW[2])


@compiled
def read_some(descriptor: int, into: np.ndarray) -> int:
    """Bytes read into `into` (uint8); 0 when none wait, `FAILED` where the line is hung up or broken."""
    # one call: bounded, and a caller that wants more asks again
    n = _read(np.int32(descriptor), into.ctypes, len(into))
    if n > 0:
        return int(n)
    # 0 bytes without an error is a hang-up: the port has VMIN = 1 (`hw.serial_port`)
    return 0 if n < 0 and _must_wait() else FAILED


@compiled
def write_all(descriptor: int, packet: np.ndarray, size: int) -> int:
    """1 when all of `packet[:size]` (uint8) was taken, 0 when the line had no room for all of it, `FAILED`
    where it is broken."""
    n = _write(np.int32(descriptor), packet.ctypes, size)
    if n >= 0:
        # a part counts as no room: what is left of it must not be sent later, behind a newer command
        return 1 if n == size else 0
    return 0 if _must_wait() else FAILED


@compiled
def receive_many(descriptor: int, messages_at: int, most: int) -> int:
    """Datagrams received into the `most` messages (struct mmsghdr) at an address; 0 when none wait, `FAILED`
    where the socket is broken."""
    n = _receive(np.int32(descriptor), messages_at, np.uint32(most), np.int32(_DONT_WAIT), 0)
    if n >= 0:
        return int(n)
    return 0 if _must_wait() else FAILED
