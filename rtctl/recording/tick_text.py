"""Ticks to JSON messages and back, fast enough for 10 kHz with every field.

orjson writes all floats of a batch in one call (its shortest form reads back as the same 64 bits); a
compiled pass weaves them and the integers between the keys, one JSON object per tick, each with the header
of an MCAP message before it. Reading is one compiled pass (`rtctl.recording.decimal_text`).

Notes
-----
JSON knows no NaN and no infinity: both are written as null and read as NaN. `unsayable` finds the rows for
which that is not exact.
"""

from __future__ import annotations

import numpy as np
import orjson

from hw.interface import OPTIONAL_FIELDS
from rtctl.errors import DataError
from rtctl.recording.decimal_text import POWERS, read_number
from rtctl.recording.jit import compiled
from rtctl.tick import FIELDS, Field, tick_dtype

RECORDED = tuple(field for field in FIELDS if field.name != "seal")
"""Fields of a recorded tick. The seal guards shared memory; readers compute it anew."""

MESSAGE_HEAD = 1 + 8 + 2 + 4 + 8 + 8
"""Bytes of an MCAP message record before its data: opcode, length, channel, sequence, two times."""

_KIND = {"int": 0, "bits": 1, "float": 2}
_FLOAT = 2
_INTEGER_BYTES = 20
"""Longest 64-bit integer in decimal, with its sign."""

_COMMA, _END, _MINUS, _ZERO = ord(","), ord("]"), ord("-"), ord("0")
_TEN = np.uint64(10)
_NULL = np.frombuffer(b"null", np.uint8)
_QUIET_NAN = np.uint64(0x7FF8000000000000)
_EXPONENT = np.uint64(0x7FF0000000000000)


class TickText:
    """The codec of one rig size."""

    def __init__(self, n_axes: int) -> None:
        self._dtype = tick_dtype(n_axes)
        kinds: list[int] = []
        pieces: list[bytes] = []
        words: list[int] = []
        piece = b"{"
        for field in RECORDED:
            first = self._dtype.fields[field.name][1] // 8  # type: ignore[index]
            piece += b'"%b":' % field.name.encode() + (b"" if field.shape == "scalar" else b"[")
            for k in range(_count(field, n_axes)):
                pieces.append(piece if k == 0 else b",")
                kinds.append(_KIND[field.kind])
                words.append(first + k)
            piece = b"," if field.shape == "scalar" else b"],"
        self._kinds, self._words = np.array(kinds), np.array(words)
        self._floats = self._words[self._kinds == _FLOAT]
        self._tail = np.frombuffer(piece[:-1] + b"}", np.uint8)
        self._piece_end = np.cumsum([len(p) for p in pieces])
        self._pieces = np.frombuffer(b"".join(pieces), np.uint8)

    def warm_up(self) -> None:
        """Compile, or load, what `encode` and `decode` call."""
        data, _ = self.encode(np.zeros(1, self._dtype), 1, 0, np.zeros(1, np.int64))
        self.decode([data[MESSAGE_HEAD:]])

    def encode(
        self, rows: np.ndarray, channel: int, first_sequence: int, times_ns: np.ndarray
    ) -> tuple[bytes, np.ndarray]:
        """MCAP message records of ticks, one after another, and the offset of each, shape (n,).

        Parameters
        ----------
        rows
            Ticks, shape (n,).
        channel, first_sequence
            Channel id and number of the first message.
        times_ns
            Log and publish time of each, ns since 1970, shape (n,).
        """
        if len(rows) == 0:
            return b"", np.zeros(0, np.int64)
        words = _words(rows)
        numbers = np.ascontiguousarray(words[:, self._floats]).view(np.float64).reshape(-1)
        text = np.frombuffer(orjson.dumps(numbers, option=orjson.OPT_SERIALIZE_NUMPY), np.uint8)
        integers = len(self._words) - len(self._floats)
        fixed = MESSAGE_HEAD + len(self._pieces) + len(self._tail) + integers * _INTEGER_BYTES
        out = np.empty(len(rows) * fixed + len(text), np.uint8)
        offsets = np.empty(len(rows), np.int64)
        times = np.ascontiguousarray(times_ns, np.int64)
        used = _weave(
            words, text, self._kinds, self._words, self._pieces, self._piece_end, self._tail,
            channel, first_sequence, times, out, offsets,
        )  # fmt: skip
        return out[:used].tobytes(), offsets

    def decode(self, texts: list[bytes]) -> np.ndarray:
        """Ticks of JSON objects. Null becomes NaN; fields that are missing are 0 (optional sensors: NaN), unknown ones are left out.

        Raises
        ------
        DataError
            Text that is not JSON, or not a tick of this rig size.
        """
        ends = np.cumsum([len(text) for text in texts], dtype=np.int64)
        return self.decode_spans(b"".join(texts), np.concatenate(([0], ends[:-1])).astype(np.int64), ends)

    def decode_spans(self, data: bytes, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """As `decode`, of the objects that lie in `data` from `starts` to `ends`, each of shape (n,)."""
        rows = np.zeros(len(ends), self._dtype)
        if len(ends) == 0:
            return rows
        words = rows.view(np.uint64).reshape(len(rows), -1)
        if _unweave(
            np.frombuffer(data, np.uint8), starts, ends, words,
            self._kinds, self._words, self._pieces, self._piece_end, self._tail, POWERS,
        ):  # fmt: skip
            return rows
        words[:] = 0
        for name in OPTIONAL_FIELDS:  # a recording of before the field had no such sensor
            rows[name] = np.nan
        try:
            _decode_any([data[a:b] for a, b in zip(starts, ends, strict=True)], rows)
        except (ValueError, TypeError, KeyError, OverflowError) as error:
            raise DataError(f"a recorded tick cannot be read: {error}") from error
        return rows

    def unsayable(self, rows: np.ndarray) -> np.ndarray:
        """Which rows hold an infinity, or a NaN other than the usual one: JSON would not give them back exactly."""
        words = _words(rows)[:, self._floats]
        odd = ((words & _EXPONENT) == _EXPONENT) & (words != _QUIET_NAN)
        found: np.ndarray = odd.any(axis=1)
        return found


def _count(field: Field, n_axes: int) -> int:
    return {"scalar": 1, "axis": n_axes, "xyz": 3}[field.shape]


def _words(rows: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(rows).view(np.uint64).reshape(len(rows), -1)


def _decode_any(texts: list[bytes], rows: np.ndarray) -> None:
    """Slow way, for ticks that another program or version wrote."""
    objects = orjson.loads(b"[" + b",".join(texts) + b"]")
    if len(objects) != len(rows) or not all(isinstance(o, dict) for o in objects):
        msg = "not one JSON object each"
        raise ValueError(msg)
    for field in RECORDED:
        if field.name in objects[0]:
            rows[field.name] = np.array([o[field.name] for o in objects], rows.dtype[field.name].base)


@compiled
def _put(out: np.ndarray, at: int, value: int, size: int) -> int:
    """Write a little-endian number; returns the position after it."""
    for k in range(size):
        out[at + k] = (value >> (8 * k)) & 255
    return at + size


@compiled
def _number(data: np.ndarray, at: int, size: int) -> int:
    """Read a little-endian number."""
    value = 0
    for k in range(size):
        value |= int(data[at + k]) << (8 * k)
    return value


@compiled
def _put_integer(out: np.ndarray, at: int, word: np.uint64, signed: bool) -> int:
    """Write a 64-bit integer in decimal; returns the position after it."""
    value = np.uint64(word)
    if signed and np.int64(value) < 0:
        out[at] = _MINUS
        at += 1
        value = np.uint64(0) - value
    digits, rest = 1, value // _TEN
    while rest > 0:
        digits, rest = digits + 1, rest // _TEN
    for k in range(digits):
        out[at + digits - 1 - k] = np.uint64(_ZERO) + value % _TEN
        value //= _TEN
    return at + digits


@compiled
def _weave(
    words: np.ndarray,
    floats: np.ndarray,
    kinds: np.ndarray,
    index: np.ndarray,
    pieces: np.ndarray,
    piece_end: np.ndarray,
    tail: np.ndarray,
    channel: int,
    sequence: int,
    times_ns: np.ndarray,
    out: np.ndarray,
    offsets: np.ndarray,
) -> int:
    """Write all messages: keys, integers, and the floats from their text `[1.5,...]`; returns the bytes used."""
    read, at = 1, 0
    for row in range(len(times_ns)):
        start = at
        offsets[row] = start
        at += MESSAGE_HEAD
        piece = 0
        for k in range(len(kinds)):
            while piece < piece_end[k]:
                out[at] = pieces[piece]
                piece, at = piece + 1, at + 1
            if kinds[k] != _FLOAT:
                at = _put_integer(out, at, words[row, index[k]], kinds[k] == 0)
                continue
            while floats[read] != _COMMA and floats[read] != _END:
                out[at] = floats[read]
                read, at = read + 1, at + 1
            read += 1
        for k in range(len(tail)):
            out[at] = tail[k]
            at += 1
        head = _put(out, start, 5, 1)
        head = _put(out, head, at - start - 9, 8)
        head = _put(out, head, channel, 2)
        head = _put(out, head, sequence + row, 4)
        head = _put(out, head, times_ns[row], 8)
        _put(out, head, times_ns[row], 8)
    return at


@compiled
def _unweave(
    text: np.ndarray,
    starts: np.ndarray,
    ends: np.ndarray,
    words: np.ndarray,
    kinds: np.ndarray,
    index: np.ndarray,
    pieces: np.ndarray,
    piece_end: np.ndarray,
    tail: np.ndarray,
    powers: np.ndarray,
) -> bool:
    """Read all messages into `words`; False, and `words` half read, where `_weave` did not write `text`."""
    for row in range(len(words)):
        at, size, piece = starts[row], ends[row], 0
        for k in range(len(kinds)):
            while piece < piece_end[k]:
                if at >= size or text[at] != pieces[piece]:
                    return False
                piece, at = piece + 1, at + 1
            first = at
            if kinds[k] != _FLOAT:
                at, words[row, index[k]] = _integer(text, at, size)
            elif at < size and text[at] == _NULL[0]:
                at, words[row, index[k]] = _null(text, at, size), _QUIET_NAN
            else:
                at, words[row, index[k]] = read_number(text, at, size, powers)
            if at == first:
                return False
        for k in range(len(tail)):
            if at >= size or text[at] != tail[k]:
                return False
            at += 1
        if at != size:
            return False
    return True


@compiled
def _integer(text: np.ndarray, at: int, size: int) -> tuple[int, np.uint64]:
    """Position after a 64-bit integer, and its bits; the position given where there is none."""
    first = at
    negative = at < size and text[at] == _MINUS
    at += 1 if negative else 0
    digits = at
    value = np.uint64(0)
    while at < size and text[at] >= _ZERO and text[at] < _ZERO + 10:
        value = value * _TEN + np.uint64(text[at] - _ZERO)
        at += 1
    if at == digits or at - first > _INTEGER_BYTES:
        return first, np.uint64(0)
    return at, np.uint64(0) - value if negative else value


@compiled
def _null(text: np.ndarray, at: int, size: int) -> int:
    """Position after `null`; that given where there is none."""
    if at + len(_NULL) > size:
        return at
    for k in range(len(_NULL)):
        if text[at + k] != _NULL[k]:
            return at
    return at + len(_NULL)


@compiled
def split_messages(records: np.ndarray, found: np.ndarray) -> int:
    """Find the MCAP messages in a chunk's records; returns how many, or -1 where a record is cut off.

    Parameters
    ----------
    records : array of uint8
        Records, one after another.
    found : array of int64, shape (at least as many as fit, 5)
        Of each: channel, sequence, log time in ns, and where its data begins and ends.
    """
    at, n, size = 0, 0, len(records)
    while at + 9 <= size:
        length = _number(records, at + 1, 8)
        if length < 0 or length > size - at - 9:  # in this order: a sum could overflow
            return -1
        end = at + 9 + length
        if records[at] == 5 and length >= 22:
            found[n, 0], found[n, 1] = _number(records, at + 9, 2), _number(records, at + 11, 4)
            found[n, 2], found[n, 3], found[n, 4] = _number(records, at + 15, 8), at + MESSAGE_HEAD, end
            n += 1
        at = end
    return n if at == size else -1
