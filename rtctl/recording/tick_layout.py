"""Which layout the ticks of a file have: by its schema, or where that is damaged, by what this version
writes."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rtctl.errors import DataError
from rtctl.recording import json_ticks, tick_blocks, tick_cdr
from rtctl.recording.mcap_scan import Chunk, Contents, channel_of
from rtctl.recording.tick_blocks import Block, Column
from rtctl.recording.topics import COLUMNS, TICK
from rtctl.tick import MOST_AXES, joined, tick_dtype

_OLD_SCHEMA = "rtctl.tick"


@dataclass(frozen=True)
class TickLayout:
    """How ticks stand in a file.

    Attributes
    ----------
    words
        Dtype of a message; None where ticks are JSON, as before version 0.2.
    fields
        Names of the fields.
    columns
        The columns of blocks of ticks; none where every tick is a row."""

    words: np.dtype[np.void] | None
    fields: tuple[str, ...]
    columns: tuple[Column, ...] = ()

    @property
    def missing(self) -> list[str]:
        """Tick fields of this version that the file lacks."""
        return [field.name for field in tick_cdr.RECORDED if field.name not in self.fields]

    def decode(self, chunk: Chunk, contents: Contents, n_axes: int) -> tuple[np.ndarray | Block, np.ndarray]:
        """The ticks of a chunk, as they lie there, and the sequence number of each. Raises DataError or
        ValueError for what is no tick of this layout."""
        # rows are in every chunk, of a quick loop as a choice of few beside the columns
        ticks = chunk.of(channel_of(TICK, chunk, contents))
        if self.words is None:
            raws = [
                data
                for k, topic in contents.topics.items()
                if topic == json_ticks.RAW_TOPIC
                for data in chunk.texts(k)
            ]
            texts = chunk.texts(channel_of(TICK, chunk, contents))
            return json_ticks.decode(texts, raws, n_axes), ticks[:, 1]
        # where there are columns they have every tick, and the rows are among them
        blocks = chunk.of(channel_of(COLUMNS, chunk, contents)) if self.columns else ticks[:0]
        if not len(blocks):
            starts, ends = np.ascontiguousarray(ticks[:, 3]), np.ascontiguousarray(ticks[:, 4])
            return tick_cdr.decode(chunk.records, starts, ends, self.words, n_axes), ticks[:, 1]
        found = [
            self._block(chunk.records, start, end, contents, n_axes) for start, end in blocks[:, 3:].tolist()
        ]
        numbers = [first + np.arange(block.n) for first, block in zip(blocks[:, 1], found, strict=True)]
        if len(found) == 1:
            return found[0], numbers[0]
        # several blocks in a chunk: the ticks between two of them were lost, and each begins anew
        return joined([block.rows() for block in found]), np.concatenate(numbers)

    def _block(self, records: bytes, start: int, end: int, contents: Contents, n_axes: int) -> Block:
        # before memory is asked for: a column of one number stands for as many ticks as are claimed
        contents.may_unpack(tick_blocks.count_of(records, start) * tick_dtype(n_axes).itemsize)
        return tick_blocks.decode(records, start, end, self.columns, n_axes)


def axes_in(contents: Contents, chunk: Chunk | None) -> int:
    """Number of axes by schema and first tick, without the facts; 0 where they do not say."""
    tick = _first_tick(contents, chunk)
    if _is_old(contents, tick):
        return json_ticks.axes_of(tick)
    # no two sizes of rig have ticks of one length
    own = [k for k in range(1, MOST_AXES + 1) if tick_cdr.own_layout(k).itemsize == len(tick)]
    if own:
        return own[0]
    try:
        return tick_cdr.axes_of(tick_cdr.layout_of(_schema(contents)))
    except DataError:
        return 0


def layout_in(
    contents: Contents, told: Mapping[str, str], chunk: Chunk | None, n_axes: int
) -> tuple[TickLayout, str]:
    """The layout of a file's ticks, and a note where its schema is damaged.

    A schema that is not the one it was by its checksum is believed only where the ticks have not the length
    that this version writes: one flipped bit in a name would otherwise take a field away."""
    tick = _first_tick(contents, chunk)
    if _is_old(contents, tick):
        return _old_layout(contents)
    schema = _schema(contents)
    # by the number of axes that `axes_in` or the facts gave
    own = tick_cdr.own_layout(n_axes)
    whole = told.get("tick_schema_crc32") == str(zlib.crc32(schema))
    note = "" if whole else "the schema of the ticks is damaged; it is taken for that of this version"
    try:
        found = tick_cdr.layout_of(schema)
        if not whole and len(tick) == found.itemsize != own.itemsize:
            note = "the schema of the ticks is not the one it was made with"
        # ticks of our own length: the damage is in the text, not in them
        elif not whole:
            found = own
    except DataError:
        found = own
        note = "the schema of the ticks is damaged; it is taken for that of this version"
    columns, columns_note = _columns_in(contents, told)
    # [1:]: the first is the encapsulation, and no field
    fields = tuple(column.name for column in columns) or (found.names or ())[1:]
    return TickLayout(found, fields, columns), note or columns_note


def _columns_in(contents: Contents, told: Mapping[str, str]) -> tuple[tuple[Column, ...], str]:
    """The columns of a file's blocks, none where it has none, and a note where their schema is damaged."""
    if tick_blocks.SCHEMA_NAME not in contents.schemas and "columns_schema_crc32" not in told:
        return (), ""
    schema = contents.schemas.get(tick_blocks.SCHEMA_NAME, ("", b""))[1]
    if told.get("columns_schema_crc32") == str(zlib.crc32(schema)):
        return tick_blocks.columns_of(schema), ""
    note = "the schema of the blocks of ticks is damaged; it is taken for that of this version"
    return tick_blocks.own_columns(), note


def _is_old(contents: Contents, tick: bytes) -> bool:
    """Whether ticks are JSON: by the schema, or where that is lost by the first tick."""
    # where a schema is there it decides: a tick of CDR may begin with a brace by chance
    known = contents.schemas.keys() & {_OLD_SCHEMA, tick_cdr.SCHEMA_NAME}
    return _OLD_SCHEMA in known or (not known and tick[:1] == b"{")


def _schema(contents: Contents) -> bytes:
    return contents.schemas.get(tick_cdr.SCHEMA_NAME, ("", b""))[1]


def _old_layout(contents: Contents) -> tuple[TickLayout, str]:
    try:
        return TickLayout(None, tuple(json_ticks.fields_of(contents.schemas[_OLD_SCHEMA][1]))), ""
    except (DataError, KeyError):
        note = "the schema is damaged; it is taken for that of this version"
        return TickLayout(None, tick_dtype(1).names or ()), note  # names are the same for every size


def _first_tick(contents: Contents, chunk: Chunk | None) -> bytes:
    texts = chunk.texts(channel_of(TICK, chunk, contents))[:1] if chunk is not None else []
    return texts[0] if texts else b""
