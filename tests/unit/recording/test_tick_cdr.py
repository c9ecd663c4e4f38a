"""Ticks as ROS 2 messages: the same bits for us, for mcap-ros2-support and for rosbags."""

import struct

import numpy as np
import pytest

from rtctl.errors import DataError
from rtctl.recording import tick_cdr
from rtctl.recording.tick_cdr import (
    MESSAGE_HEAD,
    RECORDED,
    decode,
    encode,
    layout_of,
    own_layout,
    schema_text,
)
from rtctl.tick import new_ticks


def noise(n, axes, seed=1):
    """Any bits: infinities, NaNs of every kind, -0.0."""
    rows = new_ticks(n, axes)
    words = rows.view(np.uint64).reshape(n, -1)
    words[:] = np.random.default_rng(seed).integers(0, 2**64, words.shape, np.uint64)
    odd = np.array(
        [1 << 63, 0x7FF0000000000000, 0xFFF0000000000000, 0xFFF8000000000123, 0x7FF0000000000001], np.uint64
    )
    words[:, ::3] = np.resize(odd, words[:, ::3].shape)
    rows["time_ns"] = np.arange(n)
    rows["seal"] = 0
    return rows


def spans(messages, gap=0):
    """The messages one after another, with strange bytes before each fifth, and where their data lies."""
    records, starts = b"", []
    for k, message in enumerate(messages):
        records += bytes(gap if k % 5 == 4 else 0)
        starts.append(len(records) + MESSAGE_HEAD)
        records += message.tobytes()
    starts = np.array(starts)
    return records, starts, starts + messages.shape[1] - MESSAGE_HEAD


@pytest.mark.parametrize("axes", [1, 2, 8])
@pytest.mark.parametrize("gap", [0, 3])
def test_any_bits_come_back_as_they_were(axes, gap):
    rows = noise(100, axes)
    messages = encode(rows, 1, np.arange(100), rows["time_ns"])
    assert decode(*spans(messages, gap), own_layout(axes), axes).tobytes() == rows.tobytes()


def test_message_heads_have_channel_number_and_both_times():
    messages = encode(noise(3, 1), 3, 0xFFFFFFFE + np.arange(3), np.array([5, 6, 7]))
    for k, message in enumerate(messages):
        op, size, channel, sequence, log, publish = struct.unpack_from("<BQHIQQ", message)
        assert (op, channel, sequence, log, publish) == (5, 3, (0xFFFFFFFE + k) % 2**32, 5 + k, 5 + k)
        assert 9 + size == messages.shape[1]


def test_every_field_is_in_the_schema_once_at_its_place():
    layout = layout_of(schema_text(2).encode())
    assert sorted(layout.names[1:]) == sorted(field.name for field in RECORDED)
    assert {layout.fields[name][1] % 8 for name in layout.names[1:]} == {4}, "8-byte words behind four bytes"


def test_a_recording_of_before_a_field_is_read_without_it():
    rows = noise(4, 2)
    keep = [
        line
        for line in schema_text(2).splitlines()
        if not {"device_velocity_rad_s", "friction_factor", "state"} & set(line.split())
    ]
    layout = layout_of("\n".join([*keep, "float64[7] of_a_later_version"]).encode())
    messages = np.zeros(4, layout)
    messages["encapsulation"] = np.void(tick_cdr.ENCAPSULATION)
    for name in set(layout.names) & set(rows.dtype.names):
        messages[name] = rows[name]
    ends = (np.arange(4) + 1) * layout.itemsize
    again = decode(messages.tobytes(), ends - layout.itemsize, ends, layout, 2)
    assert np.isnan(again["device_velocity_rad_s"]).all()
    assert np.isnan(again["friction_factor"]).all(), "0 would be a factor"
    assert (again["state"] == 0).all()
    assert again["force_n"].tobytes() == rows["force_n"].tobytes()


@pytest.mark.parametrize(
    "schema",
    [b"", b"\xff", b"float64", b"int64 tick\nint64 tick", b"int64 position_rad\nint64 tick", b"int64[0] tick",
        b"string tick",
     b"float64 x", b"int64[1000] tick", b"int64 tick\n" + b"".join(b"int64 a%d\n" % k for k in range(2000))],
    ids=range(10),
)  # fmt: skip
def test_a_schema_that_is_no_ticks_is_refused(schema):
    with pytest.raises(DataError):
        layout_of(schema)


def test_a_schema_has_a_thousand_fields_at_most():
    fields = ["int64 tick", *(f"int64 a{k}" for k in range(1000))]
    assert len(layout_of("\n".join(fields[:1000]).encode()).names) == 1001, "and the encapsulation"
    with pytest.raises(DataError):
        layout_of("\n".join(fields).encode())


def test_messages_that_are_no_ticks_are_refused():
    records, starts, ends = spans(encode(noise(3, 1), 1, np.arange(3), np.arange(3)))
    for bad in ((records, starts, ends - 8), (records, starts - 1, ends - 1)):
        with pytest.raises(DataError):
            decode(*bad, own_layout(1), 1)
    with pytest.raises(DataError, match="another size"):
        decode(records, starts, ends, own_layout(1), 2)
