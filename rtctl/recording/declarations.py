"""What a recording says of its messages before the first one: schemas, channels, and the schemas'
checksums."""

from __future__ import annotations

import zlib

import orjson

from rtctl.recording import law_state, log_lines, tick_blocks, tick_cdr
from rtctl.recording import mcap_format as fmt
from rtctl.recording.topics import COLUMNS, LOG, STATE, TICK, TOPICS


def declarations(n_axes: int, *, columns: bool) -> tuple[list[bytes], list[bytes]]:
    """Schema and channel records of a recording."""
    topics = {k: topic for k, topic in TOPICS.items() if columns or k not in (COLUMNS, STATE)}
    # events and commands gain fields from version to version: a schema that names them would be wrong for old
    # files
    loose = orjson.dumps({"type": "object", "properties": {}})
    kinds = {k: (topic.replace("/", "."), "jsonschema", loose) for k, topic in topics.items()}
    kinds[TICK] = tick_cdr.SCHEMA_NAME, "ros2msg", tick_cdr.schema_text(n_axes).encode()
    if columns:
        kinds[COLUMNS] = tick_blocks.SCHEMA_NAME, "ros2msg", tick_blocks.schema_text(n_axes).encode()
        kinds[STATE] = law_state.SCHEMA_NAME, "ros2msg", law_state.SCHEMA
    kinds[LOG] = log_lines.SCHEMA_NAME, "jsonschema", orjson.dumps(log_lines.SCHEMA)
    encodings = {"ros2msg": "cdr", "jsonschema": "json"}
    channels = [fmt.channel(k, k, topic, encodings[kinds[k][1]]) for k, topic in topics.items()]
    return [fmt.schema(k, *kind) for k, kind in kinds.items()], channels


def checksums(n_axes: int, *, columns: bool) -> dict[str, str]:
    """Checksums for the facts: a flipped bit in a name would take a field away without a sound."""
    found = {"tick_schema_crc32": str(zlib.crc32(tick_cdr.schema_text(n_axes).encode()))}
    if columns:
        found["columns_schema_crc32"] = str(zlib.crc32(tick_blocks.schema_text(n_axes).encode()))
        found["state_layout_crc32"] = law_state.layout_crc32(n_axes)
    return found
