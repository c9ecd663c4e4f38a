import csv
import json
import sys

import numpy as np
import pytest
from run_maker import run, setup, write

from rtctl.errors import DataError, RtctlError
from rtctl.recording.export import export
from rtctl.recording.limits import Limits
from rtctl.recording.parts import Parts
from rtctl.recording.reader import RecordingReader
from rtctl.recording.tick_cdr import RECORDED


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    rows, commands = run("mock-2axis.toml", 0.5)
    rows = rows.copy()
    rows["temperature_c"][5] = np.nan
    parts = write(tmp_path_factory.mktemp("r"), rows, commands, setup("mock-2axis.toml"))
    return RecordingReader(parts.files), rows


def test_npz_keeps_every_field_and_its_shape(recorded, tmp_path):
    reader, rows = recorded
    seen = []
    assert export(reader, "npz", tmp_path / "r.npz", progress=seen.append) == len(rows) == seen[-1]
    with np.load(tmp_path / "r.npz", allow_pickle=False) as found:
        for field in RECORDED:
            assert found[field.name].tobytes() == np.ascontiguousarray(rows[field.name]).tobytes(), field.name
        assert json.loads(str(found["about"]))["rig"] == reader.about["rig"]
    assert [p.name for p in tmp_path.iterdir()] == ["r.npz"]


def test_csv_reads_back_to_the_same_numbers(recorded, tmp_path):
    reader, rows = recorded
    export(reader, "csv", tmp_path / "r.csv", ("tick", "position_rad", "force_n", "temperature_c"))
    with (tmp_path / "r.csv").open() as file:
        table = list(csv.DictReader(file))
    axis = reader.axes[1]
    assert list(table[0])[:3] == ["tick", f"position_rad.{reader.axes[0]}", f"position_rad.{axis}"]
    assert len(table) == len(rows)
    again = np.array([float(line[f"position_rad.{axis}"]) for line in table])
    assert again.tobytes() == np.ascontiguousarray(rows["position_rad"][:, 1]).tobytes()
    assert table[5][f"temperature_c.{axis}"] == "nan"


def test_wall_time_and_seconds_stand_before_the_fields(recorded, tmp_path):
    reader, rows = recorded
    export(reader, "csv", tmp_path / "r.csv")
    with (tmp_path / "r.csv").open() as file:
        table = list(csv.DictReader(file))
    assert list(table[0])[:3] == ["wall_ns", "time_s", "tick"]
    wall_ns = int(reader.about["start_wall_ns"]) + rows["time_ns"]
    assert [int(line["wall_ns"]) for line in table] == wall_ns.tolist()
    seconds = (rows["time_ns"] - rows["time_ns"][0]) * 1e-9
    assert [float(line["time_s"]) for line in table] == seconds.tolist()
    export(reader, "npz", tmp_path / "r.npz", ("time_s", "tick"))
    with np.load(tmp_path / "r.npz") as found:
        assert set(found) == {"time_s", "tick", "about"}
        assert found["time_s"].tolist() == seconds.tolist()


def test_parquet_reads_back_bit_for_bit(recorded, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    reader, rows = recorded
    export(reader, "parquet", tmp_path / "r.parquet")
    table = parquet.read_table(tmp_path / "r.parquet")
    assert table.num_rows == len(rows)
    for field in RECORDED:
        if field.shape == "axis":
            column = table[f"{field.name}.{reader.axes[1]}"].to_numpy()
            assert column.tobytes() == np.ascontiguousarray(rows[field.name][:, 1]).tobytes(), field.name
    assert table.schema.metadata[b"rig"].decode() == reader.about["rig"]


def test_without_pyarrow_parquet_says_what_to_install_and_leaves_nothing(recorded, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(RtctlError, match=r"pip install 'rtctl\[parquet\]'"):
        export(recorded[0], "parquet", tmp_path / "r.parquet")
    assert list(tmp_path.iterdir()) == []


def test_a_field_that_does_not_exist_is_named(recorded, tmp_path):
    with pytest.raises(DataError, match="speed"):
        export(recorded[0], "csv", tmp_path / "r.csv", ("tick", "speed"))


def test_mcap_has_every_tick_as_a_message_and_is_a_recording_again(tmp_path):
    from mcap.reader import make_reader

    from rtctl.recording.replay import Replay

    rows, commands = run()
    made = setup(rate_hz="10000.0")
    events = [{"event": "state", "tick": 5, "timestamp": 1e9}]
    parts = write(tmp_path, rows[:700], commands, made, events=events)
    path = tmp_path / "all.mcap"
    assert export(RecordingReader(parts.files), "mcap", path) == 700
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        numbers = [message.sequence for _, _, message in reader.iter_messages(topics=["rtctl/tick"])]
        assert {channel.topic for channel in reader.get_summary().channels.values()} == {
            "rtctl/tick", "rtctl/event", "rtctl/command", "rtctl/log",
        }  # fmt: skip
    assert numbers == list(range(700))
    again, first = RecordingReader([path]).read(), RecordingReader(parts.files).read()
    for name in ("rows", "numbers", "commands"):
        assert getattr(again, name).tobytes() == getattr(first, name).tobytes()
    assert again.events == first.events == events
    assert again.attachments == first.attachments
    verdict = Replay(RecordingReader([path])).check()
    assert (verdict.ticks, verdict.first, verdict.stopped) == (700, None, "")
    with pytest.raises(DataError, match="whole ticks"):
        export(RecordingReader(parts.files), "mcap", path, ("tick",))


def test_mcap_keeps_the_numbers_of_ticks_that_were_lost(tmp_path):
    rows, commands = run()
    parts = Parts(tmp_path, setup(rate_hz="10000.0"), Limits(free_bytes=0))
    parts.add(0, rows[:20], [], commands)
    parts.add(23, rows[23:60], [], commands[:0])
    parts.close({})
    assert export(RecordingReader(parts.files), "mcap", tmp_path / "all.mcap") == 57
    found = RecordingReader([tmp_path / "all.mcap"]).read()
    assert found.numbers.tolist() == [*range(20), *range(23, 60)]
    assert found.rows["tick"].tolist() == np.delete(rows["tick"][:60], [20, 21, 22]).tolist()


def test_a_recording_without_a_tick_becomes_a_sound_file_with_all_columns(recorded, tmp_path, monkeypatch):
    reader, _ = recorded
    monkeypatch.setattr(RecordingReader, "batches", lambda _self: iter(()))
    fields = ("time_s", "tick", "position_rad")
    assert export(reader, "csv", tmp_path / "r.csv", fields) == 0
    axes = [f"position_rad.{axis}" for axis in reader.axes]
    assert (tmp_path / "r.csv").read_text().split() == [",".join(["time_s", "tick", *axes])]
    export(reader, "npz", tmp_path / "r.npz", fields)
    with np.load(tmp_path / "r.npz") as found:
        assert found["position_rad"].shape == (0, 2)
    with pytest.raises(DataError, match=r"no tick.*--to npz"):  # a recording has ticks
        export(reader, "mcap", tmp_path / "r.mcap")
    assert not (tmp_path / "r.mcap").exists()


def test_a_parquet_without_a_tick_is_one(recorded, tmp_path, monkeypatch):
    parquet = pytest.importorskip("pyarrow.parquet")
    reader, _ = recorded
    monkeypatch.setattr(RecordingReader, "batches", lambda _self: iter(()))
    export(reader, "parquet", tmp_path / "r.parquet", ("time_s", "tick"))
    assert parquet.read_table(tmp_path / "r.parquet").column_names == ["time_s", "tick"]
