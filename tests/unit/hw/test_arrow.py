"""Parquet and Arrow as other programs than pandas write them."""

import datetime
import decimal

import numpy as np
import pytest

from hw.interface import BackendError
from hw.playback.columns import read_table

arrow = pytest.importorskip("pyarrow")
Q = [0.5, -1.25, 2.0, 0.125]


def written(path, **columns):
    parquet = pytest.importorskip("pyarrow.parquet")
    parquet.write_table(arrow.table(columns), path, compression="zstd", row_group_size=3)
    return path


@pytest.mark.parametrize(
    ("name", "column"),
    [
        ("q", lambda: arrow.array(Q).dictionary_encode()),
        ("q", lambda: arrow.array([decimal.Decimal(str(q)) for q in Q], arrow.decimal128(12, 6))),
        ("q", lambda: arrow.array([str(q) for q in Q])),
        ("q", lambda: arrow.array(Q, arrow.float32())),
        ("q.arm", lambda: arrow.array([{"arm": q, "leg": 0.0} for q in Q])),
        ("q#2", lambda: arrow.array([[0.0, q] for q in Q])),
    ],
)
def test_numbers_are_read_however_they_are_stored(name, column, tmp_path):
    path = written(tmp_path / "log.parquet", t=arrow.array([0, 1, 2, 3]), q=column())
    assert read_table(path, ("t", name)).columns[name].tolist() == Q


@pytest.mark.parametrize(
    "stamps",
    [
        lambda: arrow.array([datetime.time(10, 0, 0, 1000 * k) for k in range(4)], arrow.time64("us")),
        lambda: arrow.array([1000 * k for k in range(4)], arrow.duration("us")),
        lambda: arrow.array([1000 * k for k in range(4)], arrow.timestamp("us", tz="UTC")),
    ],
)
def test_times_are_seconds_from_the_first_on(stamps, tmp_path):
    found = read_table(written(tmp_path / "log.parquet", t=stamps(), q=arrow.array(Q)), ("t", "q"))
    assert found.units["t"] == "s"
    assert np.allclose(found.columns["t"], [0, 0.001, 0.002, 0.003], atol=1e-9)


def test_words_are_no_numbers_and_a_stream_is_told(tmp_path):
    path = written(tmp_path / "log.parquet", t=arrow.array([0, 1]), q=arrow.array(["0,5", "1,25"]))
    assert read_table(path, ("t", "q")).columns["q"].tolist() == [0.5, 1.25]
    path = written(path, t=arrow.array([0, 1]), q=arrow.array(["0,5", None]))
    with pytest.raises(BackendError, match=r"'q' is text, and 'None' in row 2 is not a number"):
        read_table(path, ("t", "q"))
    table, file = arrow.table({"t": [0, 1], "q": [1.0, 2.0]}), tmp_path / "log.arrow"
    with arrow.OSFile(str(file), "wb") as sink, arrow.ipc.new_file(sink, table.schema) as out:
        out.write_table(table)
    assert read_table(file, ("t", "q")).columns["q"].tolist() == [1, 2]
    stream = tmp_path / "log.stream"
    with arrow.OSFile(str(stream), "wb") as sink, arrow.ipc.new_stream(sink, table.schema) as out:
        out.write_table(table)
    with pytest.raises(BackendError, match="a stream of Arrow"):
        read_table(stream, ("t", "q"))


def test_a_stream_in_a_file_called_arrow_is_read(tmp_path):
    table, file = arrow.table({"t": [0, 1, 2], "q": [1.0, 2.0, 3.0]}), tmp_path / "log.arrow"
    with arrow.OSFile(str(file), "wb") as sink, arrow.ipc.new_stream(sink, table.schema) as out:
        out.write_table(table)
    assert read_table(file, ("t", "q")).columns["q"].tolist() == [1, 2, 3]
