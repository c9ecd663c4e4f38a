"""Recordings made before rtctl wrote CDR: read, exported and replayed as ever, and what is no tick is
refused.
"""

import base64
import json

import numpy as np
import orjson
import pytest

from rtctl.cli.export import command as export
from rtctl.cli.info import command as info
from rtctl.errors import DataError
from rtctl.recording import json_ticks
from rtctl.recording import mcap_format as fmt
from rtctl.recording.mcap_file import McapFile
from rtctl.recording.reader import RecordingReader
from rtctl.recording.tick_cdr import RECORDED
from rtctl.tick import new_ticks

ABOUT = {
    "session": "7",
    "axes": '["a", "b"]',
    "n_axes": "2",
    "rate_hz": "1000.0",
    "period_ns": "1000000",
    "start_wall_ns": "5",
    "first_row": "0",
}


def texts_of(rows, lacks=()):
    fields = [field.name for field in RECORDED if field.name not in lacks]
    return [orjson.dumps({name: row[name].tolist() for name in fields}) for row in rows]


@pytest.fixture
def rows():
    made = new_ticks(5, 2)
    made["tick"] = np.arange(5)
    made["position_rad"] = np.random.default_rng(1).normal(size=(5, 2))
    made["faults"], made["velocity_rad_s"][1, 0] = 2**64 - 1, -0.0
    made["force_n"][2, 1], made["current_a"][3] = np.inf, np.nan
    return made


def write(path, rows, *, name="rtctl.tick", lacks=()):
    """A recording as it was before CDR, of before these fields."""
    fields = {field.name: {} for field in RECORDED if field.name not in lacks}
    schema = json.dumps({"properties": fields}).encode()
    topics = {1: "rtctl/tick", 4: "rtctl/raw"}
    schemas = [fmt.schema(1, name, "jsonschema", schema)]
    file = McapFile(path, schemas, [fmt.channel(k, 1, t, "json") for k, t in topics.items()])
    file.add_metadata("rtctl", ABOUT)
    raw = {"tick": 2, "words": base64.b64encode(rows[2].tobytes()).decode()}
    messages = [] if lacks else [fmt.message(4, 0, 5, json.dumps(raw).encode())]
    messages += [fmt.message(1, k, 5 + k, text) for k, text in enumerate(texts_of(rows, lacks))]
    file.add_chunk(b"".join(messages), {1: (np.arange(5), np.zeros(5, np.int64))})
    file.close()


@pytest.mark.parametrize("known", [True, False], ids=["schema", "schema lost"])
def test_a_recording_of_before_is_read_to_the_bit(tmp_path, rows, known):
    write(tmp_path / "a.mcap", rows, name="rtctl.tick" if known else "x")
    reader = RecordingReader([tmp_path / "a.mcap"])
    assert reader.read().rows.tobytes() == rows.tobytes()
    assert bool(reader.notes) is not known
    assert set(reader.missing_fields()) == set()


@pytest.mark.parametrize("kind", ["csv", "npz", "mcap"])
def test_what_an_older_recording_lacks_is_no_0_once_exported_and_is_told(tmp_path, rows, kind, capsys):
    """A factor of 0 that nobody recorded would read as friction that went."""
    file = tmp_path / "a-000.mcap"
    write(file, rows, lacks=("friction_factor", "display_kind"))
    out = tmp_path / f"b.{kind}"
    export.callback(file, kind, out, None, as_json=False)
    assert "recorded before the tick had display_kind, friction_factor: nan there" in capsys.readouterr().out
    if kind == "mcap":
        again = RecordingReader([out]).read().rows
        assert np.isnan(again["friction_factor"]).all()
    elif kind == "npz":
        assert np.isnan(np.load(out)["friction_factor"]).all()
    else:
        head, first = (line.split(",") for line in out.read_text().splitlines()[:2])
        told = dict(zip(head, first, strict=True))
        assert {told[f"friction_factor.{axis}"] for axis in "ab"} == {"nan"}
    info.callback(file, as_json=False)
    assert "recorded before the tick had display_kind, friction_factor" in capsys.readouterr().out


def test_a_tick_of_before_an_optional_sensor_had_none(rows):
    texts = [
        json.dumps({k: v for k, v in json.loads(t).items() if k not in ("device_velocity_rad_s", "state")})
        for t in texts_of(rows)
    ]
    again = json_ticks.decode([text.encode() for text in texts], [], 2)
    assert np.isnan(again["device_velocity_rad_s"]).all()
    assert again["position_rad"].tobytes() == rows["position_rad"].tobytes()


@pytest.mark.parametrize(
    "text", [b"", b"{", b"[1]", b"nonsense", b'{"tick":"x"}', b'{"tick":[1,2]}', b'{"tick":1e400}']
)
def test_text_that_is_no_tick_is_a_named_error(rows, text):
    with pytest.raises(DataError):
        json_ticks.decode([*texts_of(rows[:1]), text], [], 2)
    with pytest.raises(DataError):
        json_ticks.decode([text], [], 2)
