"""A recording opened by those who know nothing of rtctl: mcap-ros2-support and rosbags."""

import numpy as np
import pytest
from run_maker import run, setup, write

from rtctl.recording.tick_cdr import RECORDED


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    rows, commands = run("mock-2axis.toml", 0.5)
    rows = rows[:300].copy()
    words = rows.view(np.uint64).reshape(len(rows), -1)
    at = rows.dtype.fields["velocity_rad_s"][1] // 8
    words[7, at : at + 2] = 1 << 63, 0xFFF8000000000123  # -0.0, an unusual NaN
    rows["position_rad"][8] = np.inf, -np.inf
    events = [{"event": "state", "tick": 5, "timestamp": 1e9}]
    files = []
    for rate_hz in ("1000.0", "10000.0"):  # as rows, and as columns
        made = setup("mock-2axis.toml", rate_hz=rate_hz)
        files += write(tmp_path_factory.mktemp("r"), rows, commands, made, events=events).files
    return *files, rows


def assert_same(message, row):
    for field in RECORDED:
        told = np.array(getattr(message, field.name), row.dtype[field.name].base)
        assert told.tobytes() == row[field.name].tobytes(), field.name


def test_mcap_ros2_support_gives_every_bit(recorded):
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    path, _, rows = recorded
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = list(reader.iter_decoded_messages(topics=["rtctl/tick"]))
    assert len(found) == len(rows)
    for (_, _, message, tick), row in zip(found, rows, strict=True):
        assert message.log_time == row["time_ns"] + 10**18
        assert_same(tick, row)


def test_rosbags_gives_every_bit(recorded):
    from mcap.reader import make_reader
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    path, _, rows = recorded
    store = get_typestore(Stores.ROS2_JAZZY)
    with path.open("rb") as file:
        found = list(make_reader(file).iter_messages(topics=["rtctl/tick"]))
    schema = found[0][0]
    assert (schema.encoding, found[0][1].message_encoding) == ("ros2msg", "cdr")
    store.register(get_types_from_msg(schema.data.decode(), schema.name))
    assert len(found) == len(rows)
    for (_, _, message), row in zip(found, rows, strict=True):
        assert_same(store.deserialize_cdr(message.data, schema.name), row)


def columns_of(message, rows):
    """The columns of a block as docs/recording.md says that they are read: in NumPy, without rtctl."""
    n = len(message.tick_step)
    found = {}
    for field in RECORDED:
        kind = rows.dtype[field.name].base
        if hasattr(message, field.name + "_step"):
            found[field.name] = np.cumsum(np.array(getattr(message, field.name + "_step"), kind))
            continue
        column = np.array(getattr(message, field.name), kind)
        each = column.reshape(rows[field.name][0].size, -1)
        found[field.name] = np.broadcast_to(each, (len(each), n)).T.reshape(rows[field.name].shape)
    return found


def assert_same_columns(message, rows):
    for name, column in columns_of(message, rows).items():
        assert column.tobytes() == np.ascontiguousarray(rows[name]).tobytes(), name


def test_mcap_ros2_support_gives_every_bit_of_columns(recorded):
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    _, path, rows = recorded
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = list(reader.iter_decoded_messages(topics=["rtctl/tick", "rtctl/tick_columns"]))
    (block,) = [message for _, channel, _, message in found if channel.topic == "rtctl/tick_columns"]
    assert_same_columns(block, rows)
    chosen = {m.sequence: tick for _, channel, m, tick in found if channel.topic == "rtctl/tick"}
    assert list(chosen) == [k for k in range(len(rows)) if k == 0 or rows["tick"][k] % 100 == 0]
    for number, tick in chosen.items():
        assert_same(tick, rows[number])


def test_rosbags_gives_every_bit_of_columns(recorded):
    from mcap.reader import make_reader
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    _, path, rows = recorded
    store = get_typestore(Stores.ROS2_JAZZY)
    with path.open("rb") as file:
        ((schema, _, message),) = make_reader(file).iter_messages(topics=["rtctl/tick_columns"])
    store.register(get_types_from_msg(schema.data.decode(), schema.name))
    assert_same_columns(store.deserialize_cdr(message.data, schema.name), rows)
