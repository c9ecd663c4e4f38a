"""Lines of an slcan adapter to frames as the kernel's CAN gives them, and back, compiled. What is no plain
frame is for `hw.can.slcan`."""

from __future__ import annotations

import numpy as np

from hw.can.bus import EXTENDED, LINE_MAX, REMOTE
from hw.jit import compiled

END, _ZERO = 13, 48
_STANDARD, _EXTENDED_DATA, _STANDARD_REMOTE, _EXTENDED_REMOTE = 116, 84, 114, 82  # t T r R
_DONE, _DONE_EXTENDED = 122, 90  # z Z: the adapter has taken a frame


@compiled
def _nibble(byte: int) -> int:
    """Value of a hexadecimal digit, -1 for anything else."""
    if _ZERO <= byte < 58:
        return byte - _ZERO
    # the lower-case letter of either: both are taken, as by `hw.can.slcan`
    small = byte | 32
    return small - 87 if 97 <= small <= 102 else -1  # 87: `a` is 10


@compiled
def _number(chunk: np.ndarray, at: int, digits: int) -> int:
    """Hexadecimal number, -1 where it is none."""
    value = np.int64(0)
    for k in range(digits):
        digit = _nibble(int(chunk[at + k]))
        if digit < 0:
            return -1
        value = value << 4 | digit
    return int(value)


@compiled
def _put_head(frame: np.ndarray, key: int, length: int) -> None:
    for k in range(4):
        frame[k] = np.uint8((key >> (8 * k)) & 0xFF)
    frame[4] = np.uint8(length)


@compiled
def _parsed(chunk: np.ndarray, at: int, size: int, frame: np.ndarray) -> bool:
    """Put a line of `size` bytes into `frame`; False where it is no plain data frame."""
    kind = np.int64(chunk[at])
    if kind != _STANDARD and kind != _EXTENDED_DATA:
        return False
    digits = 3 if kind == _STANDARD else 8
    # before its digits are read: a short line ends in the middle of the next one
    if size < digits + 2:
        return False
    key, length = _number(chunk, at + 1, digits), int(chunk[at + digits + 1]) - _ZERO
    # exactly: with a time stamp it is four longer, and `hw.can.slcan` knows that
    if not 0 <= length <= 8 or size != digits + 2 + 2 * length:
        return False
    # three digits can say 0xFFF, which no standard frame has: it is noise
    if not 0 <= key <= (0x7FF if kind == _STANDARD else 0x1FFF_FFFF):
        return False
    for k in range(length):
        byte = _number(chunk, at + digits + 2 + 2 * k, 2)
        if byte < 0:
            return False
        frame[8 + k] = np.uint8(byte)
    _put_head(frame, key if kind == _STANDARD else key | EXTENDED, length)
    return True


@compiled
def next_line(chunk: np.ndarray, begin: int, n: int, frame: np.ndarray) -> tuple[int, bool]:
    """Take one line of `chunk[begin:begin + n]`.

    Returns
    -------
    used : int
        Bytes of it with its end; 0 when no whole line is there, -1 where `hw.can.slcan` must look at it.
    is_frame : bool
        Whether `frame` holds one now; an empty line and the adapter's word that it has sent one are none."""
    for k in range(n):
        if chunk[begin + k] == END:
            if k == 0 or (k == 1 and (chunk[begin] == _DONE or chunk[begin] == _DONE_EXTENDED)):
                return k + 1, False
            return (k + 1, True) if _parsed(chunk, begin, k, frame) else (-1, False)
    return (-1 if n > LINE_MAX else 0), False


@compiled
def put_line(packet: np.ndarray, key: int, length: int, line: np.ndarray) -> int:
    """Write the line of a frame; returns its length."""
    extended, remote = key & EXTENDED != 0, key & REMOTE != 0
    if remote:
        line[0] = _EXTENDED_REMOTE if extended else _STANDARD_REMOTE
    else:
        line[0] = _EXTENDED_DATA if extended else _STANDARD
    digits = 8 if extended else 3
    for k in range(digits):
        # 29 bits in 8 digits: the first has one
        line[1 + k] = _digit(key >> (4 * (digits - 1 - k)) & (1 if k == 0 and extended else 15))
    line[digits + 1] = _ZERO + length
    at = digits + 2
    for k in range(0 if remote else length):
        line[at], line[at + 1] = _digit(int(packet[8 + k]) >> 4), _digit(int(packet[8 + k]) & 15)
        at += 2
    line[at] = END
    return at + 1


@compiled
def _digit(value: int) -> int:
    return _ZERO + value if value < 10 else 55 + value  # 55: `A` is 10
