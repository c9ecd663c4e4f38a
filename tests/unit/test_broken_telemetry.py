"""Telemetry of another version, or broken: what can be read is, and the rest is a named error."""

from types import SimpleNamespace

import msgpack
import numpy as np
import pytest
from test_client import Delivered, rows

from rtctl.client import streams
from rtctl.client.capture import Capture, Run
from rtctl.client.samples import rig_state, tick_rows
from rtctl.errors import ClientError
from rtctl.host.exchange.samples import tick_columns
from rtctl.wire.protocol import TOPIC_COMMAND, TOPIC_EVENT, TOPIC_SETUP


def test_columns_of_another_version_are_tolerated_and_broken_ones_named():
    columns = tick_columns(rows())
    del columns["friction_gate"]
    columns["novelty"] = {"dtype": "<f8", "shape": [3], "data": b"\0" * 24}
    assert (tick_rows({"rows": 3, "columns": columns})["friction_gate"] == 0).all()
    columns["position_rad"] = {"dtype": "<f8", "shape": [3, 2], "data": b"\0" * 8}
    with pytest.raises(ClientError, match="another version"):
        tick_rows({"rows": 3, "columns": columns})


def test_one_column_that_is_not_like_the_others_is_read_by_itself():
    some = rows()
    columns = tick_columns(some)
    columns["velocity_rad_s"] = {"dtype": "<f4", "shape": [3, 1], "data": np.float32([1, 2.5, -3]).tobytes()}
    columns["law_ns"] = {"dtype": "<i8", "shape": [1], "data": np.int64([7]).tobytes()}
    columns["cycle_ns"] = {"dtype": "<f8", "shape": [3], "data": np.float64([7, 8, 9]).tobytes()}
    again = tick_rows({"rows": 3, "columns": columns})
    assert again["velocity_rad_s"].tolist() == [[1, 1], [2.5, 2.5], [-3, -3]]
    assert again["law_ns"].tolist() == [7, 7, 7]
    assert again["cycle_ns"].tolist() == [7, 8, 9]
    again["cycle_ns"] = some["cycle_ns"]
    again["velocity_rad_s"], again["law_ns"] = some["velocity_rad_s"], some["law_ns"]
    assert again.tobytes() == some.tobytes()


@pytest.mark.parametrize(
    "column",
    [
        {"dtype": "<f8", "shape": [3, 1], "data": b"\0" * 16},
        {"dtype": "<f8", "shape": [3, 1], "data": b"\0" * 25},
        {"dtype": "<f8", "shape": [3, 1], "data": "none"},
        {"dtype": "<f8", "shape": "3", "data": b"\0" * 24},
        {"dtype": 8, "shape": [2, 2], "data": b"\0" * 24},
        {"shape": [3, 1], "data": b"\0" * 24},
        None,
        [],
    ],
)
def test_a_column_that_does_not_fit_is_a_named_error(column):
    with pytest.raises(ClientError, match="another version"):
        tick_rows({"rows": 3, "columns": {**tick_columns(rows()), "law_ns": column}})


def test_a_sample_that_is_none_is_a_named_error():
    for message in ({}, {"faults": "x"}, {"faults": float("nan")}):
        with pytest.raises(ClientError, match="cannot read"):
            rig_state(message)


def test_a_batch_that_says_more_rows_than_it_has_is_refused_before_room_is_made():
    columns = tick_columns(rows())
    for n, axes in ((10**13, 1), (3, 10**13), (-1, 1)):
        shaped = {**columns, "position_rad": {**columns["position_rad"], "shape": [3, axes]}}
        with pytest.raises(ClientError, match="cannot read"):
            tick_rows({"rows": n, "columns": shaped})


FAULT = {"event": "fault", "name": "STALE", "text": ""}
NUMBERED = {"session": 1, "sequence": 0}


@pytest.mark.parametrize(
    ("stream", "message"),
    [
        (streams.event_stream, [{**NUMBERED, "event": "fault"}]),
        (streams.event_stream, [{**NUMBERED, **FAULT, "name": []}]),
        (streams.event_stream, [{**NUMBERED, "event": "device"}]),
        (streams.event_stream, [{**NUMBERED, "event": []}, 3]),
        (streams.event_stream, [{**FAULT, "session": 1, "sequence": "0"}]),
        (streams.event_stream, {"event": 1}),
        (streams.health_stream, {**NUMBERED, "faults": 3}),
        (streams.health_stream, {**NUMBERED, "faults": [3]}),
        (streams.health_stream, {**NUMBERED, "cause": ["name"]}),
        (streams.health_stream, {**NUMBERED, "devices": [{}]}),
        (streams.health_stream, {**NUMBERED, "warnings": [3]}),
        (streams.health_stream, {**NUMBERED, "sequence": None}),
        (streams.health_stream, 3),
        (streams.tick_stream, {**NUMBERED, "row": "x", "rows": 3, "columns": tick_columns(rows())}),
    ],
)
def test_a_malformed_message_is_a_named_error_and_the_stream_goes_on(stream, message):
    wire = Delivered(message)
    opened = stream(wire, 1.0)
    with pytest.raises(ClientError, match="cannot read"):
        opened.receive(0)
    good = {**NUMBERED, **FAULT, "row": 0, "rows": 3, "columns": tick_columns(rows())}
    wire.waiting.append([b"", msgpack.packb([good] if stream is streams.event_stream else good)])
    assert opened.receive(0) is not None
    assert (opened.lost, opened.restarts) == (0, 0)


def test_a_batch_without_ticks_is_none():
    empty = {**NUMBERED, "row": 0, "rows": 0, "columns": tick_columns(rows(0))}
    assert streams.tick_stream(Delivered(empty), 1.0).receive(0) is None


@pytest.mark.parametrize(
    ("topic", "message"),
    [
        (TOPIC_COMMAND, {"session": 1, "columns": {}}),
        (TOPIC_COMMAND, {"session": 1, "columns": []}),
        (TOPIC_COMMAND, {"session": 1, "columns": {"epoch": {"shape": [], "data": b""}}}),
        (TOPIC_COMMAND, {"session": 1, "columns": {"epoch": {"shape": [10**13], "data": b""}}}),
        (TOPIC_SETUP, {"session": 2, "about": [], "command": None}),
        (TOPIC_EVENT, [None]),
        (TOPIC_COMMAND, 3),
    ],
)
def test_what_a_recording_cannot_read_is_a_named_error(topic, message):
    capture = Capture.__new__(Capture)  # without a socket of its own
    capture.run, capture._heard = Run(1, {}, 1), 0.0
    capture._socket = SimpleNamespace(
        poll=lambda _ms: True, recv_multipart=lambda: (topic, msgpack.packb(message))
    )
    with pytest.raises(ClientError, match="cannot read"):
        capture.receive(1.0)
