"""Reading an MCAP file from its beginning, as far as it is whole. Needs no summary and no end."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np
import zstandard

from hw.outside import opened
from rtctl.errors import DataError
from rtctl.recording.jit import compiled
from rtctl.recording.mcap_format import MAGIC, RECORD_HEAD, Cursor, Op
from rtctl.recording.tick_cdr import MESSAGE_HEAD
from rtctl.recording.topics import TOPICS

MOST_RECORD_BYTES = 1 << 28
"""A longer record is a damaged length, not data; a chunk unpacks to no more either."""

MOST_RATIO, LEAST_UNPACKED = 500, 1 << 24
"""How many times its size a file may unpack to, and what it always may: recordings reach 10 to 40, a bomb
16,000."""

_CHUNK_MARK = struct.pack("<I", 4) + b"zstd"
_MARK_AT = RECORD_HEAD + 28  # 28: two times, size and checksum of what is packed
"""Where in a chunk record its compression is named: what a chunk is found by behind a damaged length."""

# bytes read at a time in search of a mark
_WINDOW = 1 << 16
MOST_PASSES = 4
"""How often a file is read over at most, in search of its next sound chunk."""


@dataclass
class Chunk:
    """Messages of one chunk.

    Attributes
    ----------
    records
        The chunk's bytes.
    table : array of int64, shape (n, 5)
        Of each message: channel, sequence, log time in ns, and where its data begins and ends in `records`.
    """

    records: bytes
    table: np.ndarray

    def of(self, channel: int) -> np.ndarray:
        """The table's rows of one channel."""
        rows: np.ndarray = self.table[self.table[:, 0] == channel]
        return rows

    def texts(self, channel: int) -> list[bytes]:
        """The data of each message of one channel."""
        return [self.records[start:end] for start, end in self.of(channel)[:, 3:].tolist()]


@dataclass
class Contents:
    """What stands in a file beside its chunks. Filled while `chunks` runs.

    Attributes
    ----------
    topics
        Channel id -> topic.
    schemas
        Name of a schema -> its encoding and text.
    kinds, numbered
        Channel id -> number of its schema, and that number -> the schema's name.
    complete
        True once the end of the file has been seen.
    bad_chunks
        Chunks whose checksum or compression is damaged, and damaged lengths between them.
    unpacked, packed
        Bytes that the chunks so far have unpacked to, with the ticks made of them, and of the file so far."""

    topics: dict[int, str] = field(default_factory=dict)
    schemas: dict[str, tuple[str, bytes]] = field(default_factory=dict)
    kinds: dict[int, int] = field(default_factory=dict)
    numbered: dict[int, str] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    complete: bool = False
    whole_chunks: int = 0
    bad_chunks: int = 0
    unpacked: int = 0
    packed: int = 0

    def may_unpack(self, size: int) -> None:
        """Count what a chunk or a block of ticks unpacks to. Raises ValueError for more than a recording of
        this size can hold."""
        if size > MOST_RECORD_BYTES or self.unpacked + size > LEAST_UNPACKED + MOST_RATIO * self.packed:
            raise ValueError(f"unpacks to {size} bytes")
        self.unpacked += size


def chunks(path: Path, contents: Contents) -> Iterator[Chunk]:
    """Every whole chunk in order; the first one after what stands before it has been read.

    Raises
    ------
    DataError
        Not an MCAP file at all, or one that cannot be opened."""
    try:
        with opened(path) as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise DataError(
                    f"{path}: not an MCAP file, which recordings of rtctl are; a log of another program is "
                    "for rtctl identify --log"
                )
            for op, content in _records(file, contents):
                if op == Op.CHUNK:
                    found = _chunk(content, contents, file.tell())
                    if found is not None:
                        contents.whole_chunks += 1
                        yield found
                else:
                    _note(op, content, contents)
    except OSError as error:
        raise DataError(f"{path}: cannot be read: {error.strerror or error}") from error


def _records(file: BinaryIO, contents: Contents) -> Iterator[tuple[int, bytes]]:
    """Whole records until the file ends; what no record can be is passed over up to the next chunk."""
    end = os.fstat(file.fileno()).st_size
    # `before`: where the last sound record began; behind a damaged length the search starts there
    at = before = len(MAGIC)
    # damaged lengths overlap: without a bound they could have the same bytes read for ever
    budget = MOST_PASSES * (end + MOST_PASSES * _WINDOW)
    while at + RECORD_HEAD <= end and budget > 0:
        file.seek(at)
        op, size = struct.unpack("<BQ", file.read(RECORD_HEAD))
        behind = at + RECORD_HEAD + size
        # the footer counts at the end alone: a damaged record may look like one
        if op == Op.FOOTER and behind + len(MAGIC) == end:
            file.seek(behind)
            contents.complete = file.read(len(MAGIC)) == MAGIC
            return
        if op in _OPS and size <= MOST_RECORD_BYTES and behind <= end:
            yield op, file.read(size)  # whole: its end lies within the file
            before, at, budget = at, behind, budget - size
            continue
        found, budget = _next_chunk(file, before + 1), budget - _WINDOW  # a look costs a window at least
        if found is None:
            return  # cut off here, as after a crash
        contents.bad_chunks += 1
        before = at = found


_OPS = frozenset(op.value for op in Op)


def _next_chunk(file: BinaryIO, start: int) -> int | None:
    """Where the next chunk that could be one begins, at `start` at the earliest."""
    at = start + _MARK_AT
    while True:
        file.seek(at)
        window = file.read(_WINDOW)
        found = window.find(_CHUNK_MARK)
        if found >= 0:
            begin = at + found - _MARK_AT
            file.seek(begin)
            # the mark alone may stand in any data
            if file.read(1) == bytes([Op.CHUNK]):
                return begin
            at += found + 1  # behind this mark
        elif len(window) < _WINDOW:
            return None
        else:
            at += _WINDOW - len(_CHUNK_MARK) + 1  # a mark may lie across two windows


def _note(op: int, content: bytes, contents: Contents) -> None:
    cursor = Cursor(content)
    try:
        if op == Op.SCHEMA:
            number = cursor.number("H")
            name, encoding = cursor.string(), cursor.string()
            contents.numbered[number] = name
            contents.schemas[name] = encoding, cursor.take(cursor.number("I"))
        elif op == Op.CHANNEL:
            channel_id, schema_id = cursor.numbers("HH")
            contents.topics[channel_id], contents.kinds[channel_id] = cursor.string(), schema_id
        elif op == Op.METADATA:
            name = cursor.string()
            contents.metadata[name] = cursor.texts()
        elif op == Op.ATTACHMENT:
            cursor.numbers("QQ")
            name, _ = cursor.string(), cursor.string()
            data = cursor.take(cursor.number("Q"))
            # one that is damaged is left out: an archive of the law with a flipped bit would be another law
            if cursor.number("I") == zlib.crc32(content[: cursor.at - 4]):
                contents.attachments[name] = data
    except (struct.error, UnicodeDecodeError):
        return  # a damaged record says nothing


def _chunk(content: bytes, contents: Contents, read: int) -> Chunk | None:
    """A chunk's messages; None for a damaged one. `read` counts the bytes of the file so far."""
    try:
        cursor = Cursor(content)
        _, _, size, crc = cursor.numbers("QQQI")
        compression = cursor.string()
        data = cursor.take(cursor.number("Q"))
        contents.packed = read
        contents.may_unpack(size)
        records = _decompressed(data, compression, size)
        # of what was packed, not of the packed: a fault of the decompressor shows, too
        if crc and zlib.crc32(records) != crc:  # 0: the writer has made none
            raise ValueError("checksum")
        return _messages(records)
    except (struct.error, ValueError, OverflowError, MemoryError, zstandard.ZstdError):
        contents.bad_chunks += 1
        return None


def _decompressed(data: bytes, compression: str, size: int) -> bytes:
    if compression == "" and len(data) == size:
        return data
    if compression != "zstd":
        raise ValueError(f"compression {compression!r}")
    # asked first: the frame itself says what it holds, before any of it is unpacked
    told = zstandard.get_frame_parameters(data).content_size
    if told not in (size, zstandard.CONTENTSIZE_UNKNOWN):
        raise ValueError(f"{size} bytes are claimed, {told} packed")
    records = zstandard.ZstdDecompressor(max_window_size=MOST_RECORD_BYTES).decompress(
        data, max_output_size=size
    )
    if len(records) != size:
        raise ValueError(f"{size} bytes are claimed, {len(records)} packed")
    return records


def _messages(records: bytes) -> Chunk:
    """Split a chunk's records. Raises ValueError where one is cut off."""
    # as many as can be: a message has a head at least
    table = np.empty((len(records) // MESSAGE_HEAD + 1, 5), np.int64)
    count = split_messages(np.frombuffer(records, np.uint8), table)
    if count < 0:
        raise ValueError("a record in the chunk is cut off")
    return Chunk(records, table[:count].copy())


def channel_of(kind: int, chunk: Chunk, contents: Contents) -> int:
    """Channel of one kind of messages: by its topic, or where that is damaged by the number that rtctl gives
    it."""
    named = {topic: number for number, topic in contents.topics.items()}.get(TOPICS[kind], kind)
    lost = contents.topics.get(kind) not in TOPICS.values() and not (chunk.table[:, 0] == named).any()
    return kind if lost else named


@compiled
def _number(data: np.ndarray, at: int, size: int) -> int:
    """Read a little-endian number."""
    value = 0
    for k in range(size):
        value |= int(data[at + k]) << (8 * k)
    return value


@compiled
def split_messages(records: np.ndarray, found: np.ndarray) -> int:
    """Find the MCAP messages in a chunk's records; returns how many, or -1 where a record is cut off.

    Parameters
    ----------
    records : array of uint8
        Records, one after another.
    found : array of int64, shape (at least as many as fit, 5)
        Of each: channel, sequence, log time in ns, and where its data begins and ends."""
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
        at = end  # records of other kinds are passed over
    return n if at == size else -1
