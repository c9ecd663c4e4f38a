"""Blocks of ticks as columns: the same bits back, and a block that lies is refused by name."""

from dataclasses import replace

import numpy as np
import pytest
from test_tick_cdr import noise

from rtctl.errors import DataError
from rtctl.recording import tick_blocks
from rtctl.recording.tick_blocks import Column, columns_of, encode, own_columns, schema_text
from rtctl.recording.tick_cdr import MESSAGE_HEAD, RECORDED, placed
from rtctl.tick import new_ticks


def data_of(rows):
    return encode(rows, 6, 0, 0)[MESSAGE_HEAD:]


def decode(data, columns, axes):
    """Somewhere among other bytes."""
    return tick_blocks.decode(b"abc" + data + b"de", 3, 3 + len(data), columns, axes).rows()


def test_a_column_is_had_by_itself_and_ticks_in_the_room_that_is_given():
    rows = noise(70, 2)
    rows["state"] = 3
    block = tick_blocks.decode(data := data_of(rows), 0, len(data), own_columns(), 2)
    for name in ("tick", "time_ns", "command_seq", "state", "authority"):
        assert block.column(name).tobytes() == np.ascontiguousarray(rows[name]).tobytes(), name
    assert (block.column("seal") == 0).all()
    room = noise(70, 2, seed=2)
    assert block.rows(room) is room
    assert room.tobytes() == rows.tobytes()


@pytest.mark.parametrize("axes", [1, 2, 8])
@pytest.mark.parametrize("n", [1, 2, 63, 64, 65, 500])
def test_any_bits_come_back_as_they_were(axes, n):
    rows = noise(n, axes)
    assert decode(data_of(rows), own_columns(), axes).tobytes() == rows.tobytes()


def test_what_stays_the_same_is_told_once_and_what_counts_up_by_its_steps():
    rows = new_ticks(1000, 2)
    rows["tick"], rows["time_ns"] = np.arange(5, 1005), np.arange(1000) * 100_000
    rows["position_rad"][:, 1] = np.arange(1000)
    rows["force_n"] = 1.5, np.nan, -0.0
    data = data_of(rows)
    columns = len(own_columns())
    numbers = 4 * 1000 + 2 * 1000  # counters and clocks, and the one field that moves, of both axes
    assert numbers * 8 < len(data) < (numbers + 3 * columns) * 8
    assert decode(data, own_columns(), 2).tobytes() == rows.tobytes()


def test_every_field_is_in_the_schema_once():
    assert sorted(column.name for column in own_columns()) == sorted(field.name for field in RECORDED)
    assert own_columns()[0] == Column("tick", stepped=True)
    assert columns_of(schema_text(8).encode()) == own_columns()


def test_a_block_of_another_version_is_read_without_what_is_unknown():
    rows = noise(7, 2)
    gone = ("device_velocity_rad_s", "friction_factor", "state")
    keep = [c for c in own_columns() if c.name not in gone]
    words = np.frombuffer(data_of(rows)[4:], np.uint64)
    kept, at = [], 0
    for column in own_columns():
        end = at + 1 + int(words[at])
        kept += [words[at:end]] if column.name not in gone else []
        at = end
    later = np.array([2, 11, 12], np.uint64)
    data = tick_blocks.ENCAPSULATION + np.concatenate([*kept, later]).tobytes()
    columns = (*keep, Column("of_a_later_version", stepped=False))
    found = decode(data, columns, 2)
    assert np.isnan(found["device_velocity_rad_s"]).all()
    assert np.isnan(found["friction_factor"]).all(), "0 would be a factor"
    assert (found["state"] == 0).all()
    for field in RECORDED:
        if field.name not in gone:
            assert found[field.name].tobytes() == rows[field.name].tobytes(), field.name


def test_a_column_that_a_block_lacks_is_nan_and_0_in_whole_numbers():
    whole = tick_blocks.decode(data := data_of(noise(7, 1)), 0, len(data), own_columns(), 1)
    words = {placed(whole.row, name)[1] // 8 for name in ("authority", "state")}
    lacking = replace(whole, table=np.array([row for row in whole.table if row[0] not in words]))
    assert np.isnan(lacking.column("authority")).all()
    assert lacking.column("state").tolist() == [0] * 7


def test_a_block_that_lies_is_refused():
    rows = noise(10, 1)
    good = data_of(rows)
    words = np.frombuffer(good[4:], np.uint64)
    for at, value in ((0, 0), (0, 11), (0, 1 << 40), (0, 1 << 63), (11, 3), (11, 1 << 62), (11, 9)):
        bad = words.copy()
        bad[at] = value
        with pytest.raises(DataError):
            decode(good[:4] + bad.tobytes(), own_columns(), 1)
    for data in (b"", good[:4], good[:12], good[:-8], good + bytes(8), good[:-1], b"\0\0\0\0" + good[4:]):
        with pytest.raises(DataError):
            decode(data, own_columns(), 1)
    with pytest.raises(DataError, match="numbers of"):
        decode(good, own_columns(), 2)


@pytest.mark.parametrize(
    "text",
    [
        b"", b"\xff", b"float64[] position_rad\n", b"int64[] tick\n",
        b"int64[] tick_step\nint64[] tick_step\n",
        b"int64[] tick_step\nint64[] position_rad\n", b"int64[] tick_step\nstring a\n",
        b"float64[] tick_step\n",
    ],
)  # fmt: skip
def test_a_damaged_definition_is_refused(text):
    with pytest.raises(DataError):
        columns_of(text)


def test_steps_that_are_not_there_are_refused_and_not_read_from_the_next_column():
    words = np.frombuffer(data_of(new_ticks(5, 1))[4:], np.uint64)
    # the length and the five steps of `tick`, then those of `time_ns`
    lying = np.concatenate([words[:6], np.zeros(1, np.uint64), words[12:]])
    with pytest.raises(DataError, match="0 numbers of time_ns"):
        decode(b"\0\1\0\0" + lying.tobytes(), own_columns(), 1)
