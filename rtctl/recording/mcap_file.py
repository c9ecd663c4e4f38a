"""Writing one MCAP file, chunk by chunk, so that a cut-off file keeps every whole chunk.

Schemas, channels, metadata and attachments that are known at the start stand before the first chunk. A write
that fails is taken back: the file then ends after its last whole chunk."""

from __future__ import annotations

import os
import struct
import time
import zlib
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np
import zstandard

from rtctl.recording import mcap_format as fmt
from rtctl.recording.mcap_format import Op

SYNC_S = 1.0
"""How often what was written is brought to the disk, at the end of a chunk: a power cut costs so much and two
chunks at most. The kernel alone keeps it to itself for half a minute."""


class McapFile:
    """One open file.

    Parameters
    ----------
    path
        Must not exist yet.
    schemas, channels
        Schema and channel records, ready made.
    level
        Of zstd.

    Attributes
    ----------
    size : int
        Bytes written.

    Raises
    ------
    OSError
        From every method that writes; `size` is then the length of the file's good part."""

    def __init__(self, path: Path, schemas: list[bytes], channels: list[bytes], level: int = 1) -> None:
        self.path = path
        self.size = 0
        self._schemas, self._channels = schemas, channels
        self._compressor = zstandard.ZstdCompressor(level=level)
        self._attachments: list[bytes] = []
        self._metadata: list[bytes] = []
        self._chunks: list[bytes] = []
        self._counts: dict[int, int] = {}
        # the neutral ends of min and max
        self._start_ns, self._end_ns = 2**63 - 1, 0
        self._synced, self._named = time.monotonic(), False
        # EXCL: a name that a crash left, or another recorder has, is not written into
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o640)
        try:
            # no profile: ROS 2's wants every message to be one, and events are JSON
            head = fmt.record(Op.HEADER, fmt.string("") + fmt.string("rtctl"))
            self._write(fmt.MAGIC + head + b"".join(schemas) + b"".join(channels))
        except OSError:
            self.abandon()
            raise

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record."""
        data, at = fmt.metadata(name, values), self.size
        self._write(data)
        index = struct.pack("<QQ", at, len(data)) + fmt.string(name)
        self._metadata.append(fmt.record(Op.METADATA_INDEX, index))

    def add_attachment(self, name: str, media_type: str, time_ns: int, content: bytes) -> None:
        """Write an attachment."""
        data, at = fmt.attachment(name, media_type, time_ns, content), self.size
        self._write(data)
        index = struct.pack("<QQQQQ", at, len(data), time_ns, time_ns, len(content))
        index += fmt.string(name) + fmt.string(media_type)
        self._attachments.append(fmt.record(Op.ATTACHMENT_INDEX, index))

    def add_chunk(self, records: bytes, index: Mapping[int, tuple[np.ndarray, np.ndarray]]) -> None:
        """Write message records as one chunk.

        Parameters
        ----------
        records
            Message records, one after another.
        index
            Channel id -> times in ns and offsets in `records` of its messages."""
        # a channel without messages has no first time
        index = {channel: pair for channel, pair in index.items() if len(pair[0])}
        start = min(int(times.min()) for times, _ in index.values())
        end = max(int(times.max()) for times, _ in index.values())
        compressed = self._compressor.compress(records)
        chunk = fmt.chunk(start, end, records, compressed, "zstd")
        at, offsets, indexes = self.size + len(chunk), {}, b""
        for channel, (times, places) in index.items():
            # counted from the begin of the file: a reader goes there by the chunk's index alone
            offsets[channel] = at + len(indexes)
            pairs = np.column_stack((times.astype("<i8"), places.astype("<i8"))).tobytes()
            indexes += fmt.record(Op.MESSAGE_INDEX, struct.pack("<HI", channel, len(pairs)) + pairs)
        head = struct.pack("<QQQQ", start, end, self.size, len(chunk)) + fmt.number_map(offsets)
        tail = struct.pack("<Q", len(indexes)) + fmt.string("zstd")
        tail += struct.pack("<QQ", len(compressed), len(records))
        self._write(chunk + indexes)
        self._chunks.append(fmt.record(Op.CHUNK_INDEX, head + tail))
        self._start_ns, self._end_ns = min(self._start_ns, start), max(self._end_ns, end)
        for channel, (times, _) in index.items():
            self._counts[channel] = self._counts.get(channel, 0) + len(times)

    def rename(self, path: Path) -> None:
        """Give the file another name in the same folder."""
        self.path.rename(path)
        self.path, self._named = path, False

    def bring_to_disk(self) -> None:
        """Wait until the disk has what was written, and the file's name; at most once in `SYNC_S`."""
        if time.monotonic() - self._synced < SYNC_S:
            return
        os.fdatasync(self._fd)
        # a file's own fsync does not bring its name to the disk: that is the folder's (fsync(2))
        if not self._named:
            _sync_folder(self.path.parent)
        # at the end: a disk that is slow is asked the less
        self._synced, self._named = time.monotonic(), True

    def close(self) -> None:
        """Write the summary and close the file."""
        groups = (
            (Op.SCHEMA, self._schemas),
            (Op.CHANNEL, self._channels),
            (Op.STATISTICS, [self._statistics()]),
            (Op.CHUNK_INDEX, self._chunks),
            (Op.ATTACHMENT_INDEX, self._attachments),
            (Op.METADATA_INDEX, self._metadata),
        )
        # 0: no checksum over the data (mcap.dev/spec); each chunk has its own
        end = fmt.record(Op.DATA_END, struct.pack("<I", 0))
        start = self.size + len(end)
        summary = offsets = b""
        for op, records in groups:
            # an empty group has no place in the summary
            if records:
                place = struct.pack("<BQQ", op, start + len(summary), sum(map(len, records)))
                summary += b"".join(records)
                offsets += fmt.record(Op.SUMMARY_OFFSET, place)
        # 20: what follows of the footer, two places and a checksum
        footer = struct.pack("<BQQQ", Op.FOOTER, 20, start, start + len(summary))
        crc = zlib.crc32(summary + offsets + footer)
        self._write(end + summary + offsets + footer + struct.pack("<I", crc) + fmt.MAGIC)
        # once, at the end: each chunk is found by its own checksum, whatever the disk has of the rest
        os.fsync(self._fd)
        self.abandon()

    def abandon(self) -> None:
        """Close the file as it is; what was written whole stays readable. Idempotent."""
        if self._fd >= 0:
            with suppress(OSError):  # a network's disk may refuse now what it took before
                os.close(self._fd)
            self._fd = -1

    def _statistics(self) -> bytes:
        start, end = (self._start_ns, self._end_ns) if self._counts else (0, 0)
        counts = struct.pack(
            "<QHIIIIQQ", sum(self._counts.values()), len(self._schemas), len(self._channels),
            len(self._attachments), len(self._metadata), len(self._chunks), start, end,
        )  # fmt: skip
        return fmt.record(Op.STATISTICS, counts + fmt.number_map(self._counts))

    def _write(self, data: bytes) -> None:
        done = 0
        try:
            while done < len(data):
                # a view: the rest of a chunk is not copied
                done += os.write(self._fd, memoryview(data)[done:])
        except OSError:
            with suppress(OSError):  # else readers stop at the half record, as after a crash
                os.ftruncate(self._fd, self.size)
            raise
        self.size += len(data)


def _sync_folder(folder: Path) -> None:
    with suppress(OSError):  # a network's disk may not know how
        fd = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(fd)
        finally:
            os.close(fd)
