"""Numbers in a frame: any run of bits, scaled. Pure: bytes in, numbers out, and back.

    physical = scale * raw + offset

A field is compiled once into a plain function. Whole bytes of a struct type take one `struct` call; any
other run of bits is shifted out of the frame as one integer. Encoding saturates at the ends of the raw
type and never wraps; a value that is not a number is encoded as physical 0."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from hw.interface import BackendError

Buffer = bytes | bytearray | memoryview
Kind = Literal["uint", "int", "float"]
Order = Literal["little", "big"]
Decode = Callable[[Buffer, int], float]
"""`decode(buffer, offset)`: the number in the frame whose data begins at `buffer[offset]`."""
Encode = Callable[[bytearray, int, float], None]
"""`encode(buffer, offset, value)`: put it there; the field's other bits must be zero or its own."""

_STRUCT = {
    ("uint", 8): "B", ("uint", 16): "H", ("uint", 32): "I", ("uint", 64): "Q",
    ("int", 8): "b", ("int", 16): "h", ("int", 32): "i", ("int", 64): "q",
    ("float", 32): "f", ("float", 64): "d",
}  # fmt: skip
# a value beyond would make `struct` raise in the loop, where encoding has to saturate
_FLOAT_MAX = {32: 3.4028234663852886e38, 64: 1.7976931348623157e308}


@dataclass(frozen=True)
class Field:
    """One number of a frame of `length` bytes.

    Attributes
    ----------
    start_bit
        As a DBC counts: bit `8 * byte + bit`, bit 0 being the lowest of its byte. The field's lowest bit
        for little endian, its highest for big endian.
    bits
        1 to 64; 32 or 64 for `float`."""

    length: int
    start_bit: int
    bits: int
    order: Order = "little"
    kind: Kind = "uint"
    scale: float = 1.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        if not 1 <= self.bits <= 64 or (self.kind == "float" and self.bits not in _FLOAT_MAX):
            raise BackendError(f"a {self.kind} field of {self.bits} bits: 1 to 64 bits, a float 32 or 64")
        if not (math.isfinite(self.scale) and self.scale != 0.0 and math.isfinite(self.offset)):
            raise BackendError(
                f"field scale {self.scale} and offset {self.offset} must be finite, scale not 0"
            )
        # of big endian fields the lowest bit may lie before the frame: a negative shift
        if self.start_bit < 0 or self.shift < 0 or self.shift + self.bits > 8 * self.length:
            raise BackendError(
                f"field at start_bit {self.start_bit} with {self.bits} bits ({self.order} endian) "
                f"does not fit into a frame of {self.length} bytes"
            )

    @property
    def shift(self) -> int:
        """Place of the lowest bit when the whole frame is read as one integer of the field's byte order."""
        if self.order == "little":
            return self.start_bit
        byte, bit = divmod(self.start_bit, 8)
        # bytes count from the front, bits from the low end of theirs: the last byte is the integer's lowest
        # the highest bit is given: the lowest is `bits - 1` below it
        return 8 * (self.length - 1 - byte) + bit - self.bits + 1

    @property
    def raw_range(self) -> tuple[float, float]:
        """Lowest and highest raw value."""
        if self.kind == "float":
            return -_FLOAT_MAX[self.bits], _FLOAT_MAX[self.bits]
        if self.kind == "int":
            return -(1 << (self.bits - 1)), (1 << (self.bits - 1)) - 1
        return 0, (1 << self.bits) - 1

    def aligned(self) -> tuple[struct.Struct, int] | None:
        """Struct and first byte, for a field of whole bytes of a struct type."""
        code = _STRUCT.get((self.kind, self.bits))
        # 24 bits, or a number that does not begin at a byte: there is no struct type for it
        if code is None or self.shift % 8:
            return None
        first = self.shift // 8
        if self.order == "big":
            first = self.length - (self.shift + self.bits) // 8
        return struct.Struct(("<" if self.order == "little" else ">") + code), first


def byte_field(length: int, byte: int, bits: int, order: Order = "little", kind: Kind = "uint") -> Field:
    """A field of whole bytes beginning at `byte`, in either order."""
    start = 8 * byte if order == "little" else 8 * byte + 7
    return Field(length, start, bits, order, kind)


def raw_decoder(field: Field) -> Decode:
    """Function that reads the raw value: an int, or the float itself."""
    packed = field.aligned()
    # the usual case, for every frame: a struct call takes less than half of what shifting does
    if packed is not None:
        unpack_from, first = packed[0].unpack_from, packed[1]
        return lambda buffer, offset: unpack_from(buffer, offset + first)[0]
    length, shift, order = field.length, field.shift, field.order
    mask, sign = (1 << field.bits) - 1, 1 << (field.bits - 1)
    if field.kind == "float":
        code = struct.Struct("<f" if field.bits == 32 else "<d")
        size = field.bits // 8

        def _float(buffer: Buffer, offset: int) -> float:
            raw = int.from_bytes(buffer[offset : offset + length], order) >> shift & mask
            number: float = code.unpack(raw.to_bytes(size, "little"))[0]
            return number

        return _float
    if field.kind == "int":
        return lambda buffer, offset: (
            # ^ sign, - sign: extends the sign
            ((int.from_bytes(buffer[offset : offset + length], order) >> shift & mask) ^ sign) - sign
        )
    return lambda buffer, offset: int.from_bytes(buffer[offset : offset + length], order) >> shift & mask


def decoder(field: Field) -> Decode:
    """Function that reads the physical value. A NaN or infinity in a float field comes out as it is."""
    raw, scale, offset_value = raw_decoder(field), field.scale, field.offset
    if scale == 1.0 and offset_value == 0.0:
        return raw
    return lambda buffer, offset: scale * raw(buffer, offset) + offset_value


def within(field: Field) -> Decode:
    """As `decoder`, but NaN where the raw value stands at an end of its range: there the device holds it."""
    raw, scale, offset_value = raw_decoder(field), field.scale, field.offset
    low, high = field.raw_range

    def _inside(buffer: Buffer, offset: int) -> float:
        value = raw(buffer, offset)
        return scale * value + offset_value if low < value < high else math.nan

    return _inside


def to_raw(field: Field, value: float) -> float:
    """Raw value of a physical one: rounded for integers, saturated; NaN counts as physical 0."""
    low, high = field.raw_range
    # physical 0 and not raw 0: with an offset a raw 0 is torque
    x = ((0.0 if value != value else value) - field.offset) / field.scale
    if x >= high:
        return high
    if x <= low:
        return low
    return x if field.kind == "float" else round(x)


def encoder(field: Field) -> Encode:
    """Function that writes the physical value into a frame."""
    packed = field.aligned()
    if packed is not None:
        pack_into, first = packed[0].pack_into, packed[1]
        return lambda buffer, offset, value: pack_into(buffer, offset + first, to_raw(field, value))
    length, shift, order = field.length, field.shift, field.order
    mask = (1 << field.bits) - 1
    code = struct.Struct("<f" if field.bits == 32 else "<d")

    def _bits(buffer: bytearray, offset: int, value: float) -> None:
        raw = to_raw(field, value)
        whole = int.from_bytes(code.pack(raw), "little") if field.kind == "float" else int(raw)
        frame = int.from_bytes(buffer[offset : offset + length], order)
        # read, changed, written: constants and other numbers share the bytes
        frame = frame & ~(mask << shift) | (whole & mask) << shift
        buffer[offset : offset + length] = frame.to_bytes(length, order)

    return _bits


class Unwrap:
    """Follows a counter of `bits` bits through its wraps: a Python integer, which has no end.

    The shorter way round is taken, so between two samples it may turn by less than half its range."""

    __slots__ = ("_half", "_last", "_mask", "_total")

    def __init__(self, bits: int) -> None:
        self._mask, self._half = (1 << bits) - 1, 1 << (bits - 1)
        self._last: int | None = None
        self._total = 0

    @property
    def state(self) -> tuple[int, int]:
        """Whether it has begun, and the unwrapped count."""
        return int(self._last is not None), self._total

    @state.setter
    def state(self, state: tuple[int, int]) -> None:
        begun, self._total = state
        self._last = self._total & self._mask if begun else None

    def __call__(self, raw: int) -> int:
        """The unwrapped count; the first one is `raw` itself."""
        if self._last is None:
            self._total = raw
        else:
            self._total += ((raw - self._last + self._half) & self._mask) - self._half
        self._last = raw
        return self._total


class Sequence:
    """Accepts only newer frames by a counter of `bits` bits: no duplicate, no older one."""

    __slots__ = ("_half", "_last", "_mask")

    def __init__(self, bits: int) -> None:
        self._mask, self._half = (1 << bits) - 1, 1 << (bits - 1)
        self._last: int | None = None

    @property
    def state(self) -> tuple[int, int]:
        """Whether it has begun, and the last count accepted."""
        return int(self._last is not None), self._last or 0

    @state.setter
    def state(self, state: tuple[int, int]) -> None:
        begun, last = state
        self._last = last if begun else None

    def newer(self, count: int) -> bool:
        # the first frame has nothing to be newer than
        """True, and `count` remembered, if it lies within half the range after the last accepted one."""
        # a counter that starts over is ahead by little, one that goes back by more than half
        ahead = 1 if self._last is None else (count - self._last) & self._mask
        if 0 < ahead <= self._half:
            self._last = count
            return True
        return False


def _crc8(data: Buffer, polynomial: int) -> int:
    crc = 0xFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = ((crc << 1) ^ polynomial if crc & 0x80 else crc << 1) & 0xFF
    return crc ^ 0xFF


def _table(polynomial: int) -> bytes:
    # the start value 0xFF is taken out: what is left is linear, and the table serves any remainder
    return bytes(_crc8(bytes([byte]), polynomial) ^ _crc8(b"\0", polynomial) for byte in range(256))


def _tabled(polynomial: int) -> Callable[[Buffer], int]:
    table = _table(polynomial)

    def _sum(data: Buffer) -> int:
        crc = 0xFF
        for byte in data:
            crc = table[crc ^ byte]
        return crc ^ 0xFF

    return _sum


def _xor8(data: Buffer) -> int:
    total = 0
    for byte in data:
        total ^= byte
    return total


CHECKSUMS: dict[str, Callable[[Buffer], int]] = {
    "xor8": _xor8,
    "sum8": lambda data: sum(data) & 0xFF,
    "sum16": lambda data: sum(data) & 0xFFFF,
    "crc8_j1850": _tabled(0x1D),
    "crc8_autosar": _tabled(0x2F),
}
"""Checksums over the bytes of a frame besides the checksum's own: one byte, or as `CHECKSUM_BYTES` says.
CAN's own CRC guards the wire already; these guard what happens before and after it, and are wanted where a
board sends one."""

CHECKSUM_BYTES = {"sum16": 2}
"""Bytes of those that are longer than one, the high one first."""
