"""Recordings made before rtctl wrote CDR: read, exported and replayed as ever, and what is no tick is
refused.
"""

import base64
import json

import numpy as np
import orjson
import pytest

from rtctl.errors import DataError
from rtctl.recording import json_ticks
from rtctl.recording import mcap_format as fmt
from rtctl.recording.mcap_file import McapFile
from rtctl.recording.reader import RecordingReader
from rtctl.recording.tick_cdr import RECORDED
from rtctl.tick import new_ticks

ABOUT = {
    "session": "7",
    "n_axes": "2",
    "rate_hz": "1000.0",
    "period_ns": "1000000",
    "start_wall_ns": "5",
    "first_row": "0",
}


def texts_of(rows):
    fields = [field.name for field in RECORDED]
    return [orjson.dumps({name: row[name].tolist() for name in fields}) for row in rows]


@pytest.fixture
def rows():
    made = new_ticks(5, 2)
    made["tick"] = np.arange(5)
    made["position_rad"] = np.random.default_rng(1).normal(size=(5, 2))
    made["faults"], made["velocity_rad_s"][1, 0] = 2**64 - 1, -0.0
    made["force_n"][2, 1], made["current_a"][3] = np.inf, np.nan
    return made


@pytest.mark.parametrize("known", [True, False], ids=["schema", "schema lost"])
def test_a_recording_of_before_is_read_to_the_bit(tmp_path, rows, known):
    schema = json.dumps({"properties": {field.name: {} for field in RECORDED}}).encode()
    topics = {1: "rtctl/tick", 4: "rtctl/raw"}
    schemas = [fmt.schema(1, "rtctl.tick" if known else "x", "jsonschema", schema)]
    file = McapFile(tmp_path / "a.mcap", schemas, [fmt.channel(k, 1, t, "json") for k, t in topics.items()])
    file.add_metadata("rtctl", ABOUT)
    raw = {"tick": 2, "words": base64.b64encode(rows[2].tobytes()).decode()}
    messages = [fmt.message(4, 0, 5, json.dumps(raw).encode())]
    messages += [fmt.message(1, k, 5 + k, text) for k, text in enumerate(texts_of(rows))]
    file.add_chunk(b"".join(messages), {1: (np.arange(5), np.zeros(5, np.int64))})
    file.close()
    reader = RecordingReader([tmp_path / "a.mcap"])
    assert reader.read().rows.tobytes() == rows.tobytes()
    assert bool(reader.notes) is not known
    assert set(reader.missing_fields()) == set()


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
