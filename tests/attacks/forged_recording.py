"""Recordings as a stranger, a full disk or a bad block could leave them."""

import struct
import zlib

import numpy as np
import zstandard

from rtctl.recording import mcap_format as fmt
from rtctl.recording import tick_blocks, tick_cdr
from rtctl.recording.mcap_file import McapFile
from rtctl.recording.mcap_format import Op
from rtctl.recording.topics import COLUMNS, STATE, TICK, TOPICS
from rtctl.tick import new_ticks

ABOUT = {
    "rig": "mock", "version": "0", "session": "7", "n_axes": "1", "axes": '["joint"]', "rate_hz": "1000.0",
    "period_ns": "1000000", "start_wall_ns": "1000", "first_row": "0", "config_file": "mock.toml",
    "config_sha256": "0" * 64,
}  # fmt: skip
SCHEMA = tick_cdr.schema_text(1).encode()
COLUMNS_SCHEMA = tick_blocks.schema_text(1).encode()


def ticks(first, n, *, columns=False):
    """Messages of n ticks, as rows or as columns with the first one's row, with their times and offsets."""
    rows, numbers = new_ticks(n, 1), np.arange(first, first + n)
    rows["tick"], rows["position_rad"][:, 0] = numbers, numbers / 7
    times = 1000 + numbers * 1_000_000
    if columns:
        block = tick_blocks.encode(rows, COLUMNS, first, int(times[0]))
        row = tick_cdr.encode(rows[:1], TICK, numbers[:1], times[:1]).tobytes()
        return block + row, {
            COLUMNS: (times[:1], np.zeros(1, int)),
            TICK: (times[:1], np.array([len(block)])),
        }
    messages = tick_cdr.encode(rows, TICK, numbers, times)
    return messages.tobytes(), {TICK: (times, np.arange(n) * messages.shape[1])}


def write(
    path,
    about=None,
    schema=SCHEMA,
    chunks=4,
    n=25,
    attachments=None,
    raw=(),
    first=0,
    end=True,
    columns=False,
):
    """A file of `chunks` chunks of `n` ticks; `raw` records come before them."""
    topics = {k: topic for k, topic in TOPICS.items() if columns or k not in (COLUMNS, STATE)}
    schemas = [
        fmt.schema(k, topic, "jsonschema", b"{}") for k, topic in topics.items() if k not in (TICK, COLUMNS)
    ]
    schemas.append(fmt.schema(TICK, tick_cdr.SCHEMA_NAME, "ros2msg", schema))
    if columns:
        schemas.append(fmt.schema(COLUMNS, tick_blocks.SCHEMA_NAME, "ros2msg", COLUMNS_SCHEMA))
    channels = [
        fmt.channel(k, k, topic, "cdr" if k in (TICK, COLUMNS) else "json") for k, topic in topics.items()
    ]
    file = McapFile(path, schemas, channels)
    if about is not False:
        crc = {"tick_schema_crc32": str(zlib.crc32(SCHEMA))}
        crc |= {"columns_schema_crc32": str(zlib.crc32(COLUMNS_SCHEMA))} if columns else {}
        file.add_metadata("rtctl", {**ABOUT, **crc, "first_row": str(first), **(about or {})})
    for name, data in (attachments or {}).items():
        file.add_attachment(name, "application/zip", 0, data)
    for record in raw:
        file._write(record)
    for k in range(chunks):
        file.add_chunk(*ticks(first + k * n, n, columns=columns))
    file.close() if end else file.abandon()
    return path


def lying_chunk(claimed, records=b"", packed=None):
    """A chunk record that claims to unpack to `claimed` bytes."""
    packed = zstandard.ZstdCompressor().compress(records) if packed is None else packed
    head = struct.pack("<QQQI", 0, 0, claimed, 0) + fmt.string("zstd")
    return fmt.record(Op.CHUNK, head + struct.pack("<Q", len(packed)) + packed)


def zeros(size):
    """A zstd frame of `size` zeros in as few bytes as can be: blocks that say which byte is repeated how
    often.
    """
    block = 1 << 17
    head = b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", size)
    more, last = ((block << 3 | 1 << 1 | end).to_bytes(3, "little") + b"\0" for end in (0, 1))
    return head + more * (size // block - 1) + last
