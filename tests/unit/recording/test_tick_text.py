import contextlib
import json
import math

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.errors import DataError
from rtctl.recording.parts import recorded_schema
from rtctl.recording.tick_text import MESSAGE_HEAD, RECORDED, TickText
from rtctl.tick import new_ticks, tick_dtype


def messages(codec, rows):
    data, offsets = codec.encode(rows, 3, 10, rows["time_ns"])
    ends = [*offsets[1:], len(data)]
    return [data[start + MESSAGE_HEAD : end] for start, end in zip(offsets, ends, strict=True)]


def noise(n, axes, seed=1):
    rows = new_ticks(n, axes)
    words = rows.view(np.uint64).reshape(n, -1)
    words[:] = np.random.default_rng(seed).integers(0, 2**64, words.shape, np.uint64)
    rows["time_ns"] = np.arange(n)
    rows["seal"] = 0
    return rows


def same(a, b):
    """Equal words; every NaN counts as the usual one, infinities as NaN: what JSON can say."""
    for name in a.dtype.names:
        one, two = a[name], b[name]
        if one.dtype.kind == "f":
            one = np.where(np.isfinite(one), one, np.nan)
        assert one.tobytes() == two.tobytes() or np.array_equal(one, two, equal_nan=True), name
        if one.dtype.kind == "f":
            finite = np.isfinite(one)
            assert (np.signbit(one[finite]) == np.signbit(two[finite])).all(), name


@pytest.mark.parametrize("axes", [1, 2, 8])
def test_any_bits_come_back_as_they_were(axes):
    codec = TickText(axes)
    rows = noise(500, axes)
    texts = messages(codec, rows)
    same(rows, codec.decode(texts))


def test_messages_are_json_objects_of_the_published_schema():
    codec, rows = TickText(2), noise(5, 2)
    rows["tick"], rows["force_n"][1, 2], rows["velocity_rad_s"][2] = (
        [-(2**63), -1, 0, 7, 2**63 - 1],
        math.inf,
        -0.0,
    )
    rows["faults"] = 2**64 - 1
    for row, text in zip(rows, messages(codec, rows), strict=True):
        plain = json.loads(text)
        jsonschema.validate(plain, recorded_schema(2))
        assert list(plain) == [field.name for field in RECORDED]
        assert plain["tick"] == row["tick"]
        assert plain["faults"] == 2**64 - 1
    assert json.loads(messages(codec, rows)[1])["force_n"][2] is None
    assert math.copysign(1, json.loads(messages(codec, rows)[2])["velocity_rad_s"][0]) == -1


def test_message_heads_have_channel_number_and_both_times():
    import struct

    codec, rows = TickText(1), noise(3, 1)
    data, offsets = codec.encode(rows, 3, 0xFFFFFFFE, np.array([5, 6, 7]))
    for k, at in enumerate(offsets):
        op, size, channel, sequence, log, publish = struct.unpack_from("<BQHIQQ", data, at)
        assert (op, channel, sequence, log, publish) == (5, 3, (0xFFFFFFFE + k) % 2**32, 5 + k, 5 + k)
        assert at + 9 + size == ([*offsets, len(data)][k + 1])


def test_ticks_of_another_hand_are_read_too():
    codec, rows = TickText(2), noise(4, 2)
    rows["seal"] = 0
    texts = [json.dumps({"more": 1, **json.loads(t)}, indent=1).encode() for t in messages(codec, rows)]
    same(rows, codec.decode(texts))
    partial = [json.dumps({k: v for k, v in json.loads(t).items() if k != "state"}).encode() for t in texts]
    again = codec.decode(partial)
    assert (again["state"] == 0).all()
    assert (again["tick"] == rows["tick"]).all()


@pytest.mark.parametrize("text", [b"", b"{", b"[1]", b"nonsense", b'{"tick":"x"}', b'{"tick":[1,2]}'])
def test_text_that_is_no_tick_is_a_named_error(text):
    codec = TickText(1)
    good = messages(codec, noise(1, 1))[0]
    with pytest.raises(DataError):
        codec.decode([text, good])


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=60), st.integers(0, 1500), st.integers(0, 40))
def test_damaged_text_never_crashes_the_compiled_reader(junk, at, gone):
    codec = TickText(1)
    good = messages(codec, noise(1, 1))[0]
    with contextlib.suppress(DataError):
        codec.decode([good[:at] + junk + good[at + gone :]])


def test_rows_that_json_cannot_say_are_found():
    codec, rows = TickText(1), new_ticks(5, 1)
    rows["position_rad"][1], rows["position_rad"][2] = math.inf, math.nan
    rows.view(np.uint64).reshape(5, -1)[3, tick_dtype(1).fields["velocity_rad_s"][1] // 8] = (
        0xFFF8000000000000
    )
    assert codec.unsayable(rows).tolist() == [False, True, False, True, False]


def test_a_tick_of_before_an_optional_sensor_had_none():
    codec = TickText(2)
    data, _ = codec.encode(np.zeros(1, tick_dtype(2)), 1, 0, np.zeros(1, np.int64))
    fields = json.loads(data[MESSAGE_HEAD:])
    for name in ("device_velocity_rad_s", "velocity_rad_s"):
        del fields[name]
    (row,) = codec.decode([json.dumps(fields, separators=(",", ":")).encode()])
    assert np.isnan(row["device_velocity_rad_s"]).all()
    assert (row["velocity_rad_s"] == 0.0).all()
