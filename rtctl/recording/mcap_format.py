"""The records of an MCAP file as bytes, and back. Pure. Names and layout: mcap.dev/spec."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from enum import IntEnum

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEAD = 9


class Op(IntEnum):
    """Record types."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    ATTACHMENT = 0x09
    ATTACHMENT_INDEX = 0x0A
    STATISTICS = 0x0B
    METADATA = 0x0C
    METADATA_INDEX = 0x0D
    SUMMARY_OFFSET = 0x0E
    DATA_END = 0x0F


def record(op: Op, content: bytes) -> bytes:
    """A whole record."""
    return struct.pack("<BQ", op, len(content)) + content


def string(text: str) -> bytes:
    """A length-prefixed text."""
    data = text.encode()
    return struct.pack("<I", len(data)) + data


def text_map(values: Mapping[str, str]) -> bytes:
    """A map of texts."""
    return _sized(b"".join(string(key) + string(value) for key, value in values.items()))


def number_map(values: Mapping[int, int]) -> bytes:
    """A map of channel id to a 64-bit number."""
    return _sized(b"".join(struct.pack("<HQ", key, value) for key, value in values.items()))


def _sized(data: bytes) -> bytes:
    return struct.pack("<I", len(data)) + data


def schema(schema_id: int, name: str, encoding: str, data: bytes) -> bytes:
    """Schema record."""
    head = struct.pack("<H", schema_id) + string(name) + string(encoding)
    return record(Op.SCHEMA, head + _sized(data))


def channel(channel_id: int, schema_id: int, topic: str, encoding: str) -> bytes:
    """Channel record."""
    head = struct.pack("<HH", channel_id, schema_id)
    return record(Op.CHANNEL, head + string(topic) + string(encoding) + text_map({}))


def message(channel_id: int, sequence: int, time_ns: int, data: bytes) -> bytes:
    """Message record whose log and publish time are the same."""
    # the format has 32 bits for it; a reader goes on counting from the part's first
    head = struct.pack("<HIQQ", channel_id, sequence & 0xFFFFFFFF, time_ns, time_ns)
    return record(Op.MESSAGE, head + data)


def metadata(name: str, values: Mapping[str, str]) -> bytes:
    """Metadata record."""
    return record(Op.METADATA, string(name) + text_map(values))


def attachment(name: str, media_type: str, time_ns: int, data: bytes) -> bytes:
    """Attachment record, with its checksum."""
    body = struct.pack("<QQ", time_ns, time_ns) + string(name) + string(media_type)
    body += struct.pack("<Q", len(data)) + data
    # over the content alone, not over the record's head (mcap.dev/spec)
    return record(Op.ATTACHMENT, body + struct.pack("<I", zlib.crc32(body)))


def chunk(start_ns: int, end_ns: int, records: bytes, compressed: bytes, compression: str) -> bytes:
    """Chunk record of messages that have been compressed already."""
    head = struct.pack("<QQQI", start_ns, end_ns, len(records), zlib.crc32(records))
    return record(Op.CHUNK, head + string(compression) + struct.pack("<Q", len(compressed)) + compressed)


class Cursor:
    """Reads values one after another out of a record's content."""

    def __init__(self, content: bytes) -> None:
        self._content = content
        self.at = 0

    def numbers(self, layout: str) -> tuple[int, ...]:
        """Numbers of a `struct` layout without byte-order mark. Raises struct.error at the end."""
        values = struct.unpack_from("<" + layout, self._content, self.at)
        self.at += struct.calcsize("<" + layout)
        return values

    def number(self, layout: str) -> int:
        """One number."""
        return self.numbers(layout)[0]

    def take(self, size: int) -> bytes:
        """The next `size` bytes."""
        data = self._content[self.at : self.at + size]
        # a slice beyond the end is only shorter, and says nothing
        if len(data) != size:
            raise struct.error("record too short")
        self.at += size
        return data

    def string(self) -> str:
        """A text."""
        return self.take(self.number("I")).decode()

    def texts(self) -> dict[str, str]:
        """A map of texts."""
        end = self.number("I") + self.at
        values = {}
        while self.at < end:
            key = self.string()
            values[key] = self.string()
        return values

    def rest(self) -> bytes:
        """All that is left."""
        return self.take(len(self._content) - self.at)
