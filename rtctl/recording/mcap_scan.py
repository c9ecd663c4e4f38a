"""Reading an MCAP file from its beginning, as far as it is whole. Needs no summary and no end."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np
import zstandard

from rtctl.errors import DataError
from rtctl.recording.mcap_format import MAGIC, RECORD_HEAD, Cursor, Op
from rtctl.recording.tick_text import MESSAGE_HEAD, split_messages

MOST_RECORD_BYTES = 1 << 32
"""A longer record is a damaged length, not data."""


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
        Name of a schema -> its text.
    complete
        True once the end of the file has been seen.
    bad_chunks
        Chunks whose checksum or compression is damaged.
    """

    topics: dict[int, str] = field(default_factory=dict)
    schemas: dict[str, bytes] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    complete: bool = False
    whole_chunks: int = 0
    bad_chunks: int = 0


def chunks(path: Path, contents: Contents) -> Iterator[Chunk]:
    """Every whole chunk in order; the first one after what stands before it has been read.

    Raises
    ------
    DataError
        Not an MCAP file at all, or one that cannot be opened.
    """
    try:
        with path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise DataError(f"{path}: not an MCAP file")
            for op, content in _records(file):
                if op == Op.CHUNK:
                    found = _chunk(content, contents)
                    if found is not None:
                        contents.whole_chunks += 1
                        yield found
                else:
                    _note(op, content, contents)
                if op == Op.FOOTER:
                    contents.complete = file.read(len(MAGIC)) == MAGIC
                    return
    except OSError as error:
        raise DataError(f"{path}: cannot be read: {error.strerror or error}") from error


def _records(file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Whole records until the file ends or is cut off."""
    while len(head := file.read(RECORD_HEAD)) == RECORD_HEAD:
        op, size = struct.unpack("<BQ", head)
        if size > MOST_RECORD_BYTES:
            return
        content = file.read(size)
        if len(content) < size:
            return
        yield op, content


def _note(op: int, content: bytes, contents: Contents) -> None:
    cursor = Cursor(content)
    try:
        if op == Op.SCHEMA:
            cursor.number("H")
            name, _ = cursor.string(), cursor.string()
            contents.schemas[name] = cursor.take(cursor.number("I"))
        elif op == Op.CHANNEL:
            channel_id, _ = cursor.numbers("HH")
            contents.topics[channel_id] = cursor.string()
        elif op == Op.METADATA:
            name = cursor.string()
            contents.metadata[name] = cursor.texts()
        elif op == Op.ATTACHMENT:
            cursor.numbers("QQ")
            name, _ = cursor.string(), cursor.string()
            data = cursor.take(cursor.number("Q"))
            if cursor.number("I") == zlib.crc32(content[: cursor.at - 4]):
                contents.attachments[name] = data
    except (struct.error, UnicodeDecodeError):
        return  # a damaged record says nothing


def _chunk(content: bytes, contents: Contents) -> Chunk | None:
    try:
        cursor = Cursor(content)
        _, _, size, crc = cursor.numbers("QQQI")
        compression = cursor.string()
        data = cursor.take(cursor.number("Q"))
        records = _decompressed(data, compression, size)
        if crc and zlib.crc32(records) != crc:
            msg = "checksum"
            raise ValueError(msg)
        return _messages(records)
    except (struct.error, UnicodeDecodeError, ValueError, zstandard.ZstdError):
        contents.bad_chunks += 1
        return None


def _decompressed(data: bytes, compression: str, size: int) -> bytes:
    if compression == "":
        return data
    if compression != "zstd":
        msg = f"compression {compression!r}"
        raise ValueError(msg)
    return zstandard.ZstdDecompressor().decompress(data, max_output_size=size)


def _messages(records: bytes) -> Chunk:
    """Split a chunk's records. Raises ValueError where one is cut off."""
    table = np.empty((len(records) // MESSAGE_HEAD + 1, 5), np.int64)
    count = split_messages(np.frombuffer(records, np.uint8), table)
    if count < 0:
        msg = "a record in the chunk is cut off"
        raise ValueError(msg)
    return Chunk(records, table[:count].copy())
