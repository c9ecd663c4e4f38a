import tracemalloc

import msgpack
import numpy as np
from axis_bounds import BOUNDS
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.host.exchange.messages import Refusal, Request, decode
from rtctl.host.exchange.operations import OPERATIONS
from rtctl.host.exchange.requests import Requests
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.rt.shared_memory import CommandWriter, Memory
from rtctl.tick import new_ticks
from rtctl.wire.authenticator import Caller
from rtctl.wire.protocol import Endpoints

RIG = RigDescription("mock", (AxisDescription("base", BOUNDS), AxisDescription("tip", BOUNDS)), 1000.0)
VALID = [
    msgpack.packb(
        {
            "id": 7,
            "op": "target",
            "epoch": 1,
            "lease": "0" * 16,
            "position_rad": [0.5, -0.5],
            "velocity_rad_s": [1.0, 0],
        }
    ),
    msgpack.packb(
        {"id": "a", "op": "environment", "axis": "tip", "kind": "wall", "side": 1, "stiffness_nm_rad": 9.5}
    ),
    msgpack.packb({"id": 9, "op": "compensation", "share": 0.25, "axis": 1}),
    msgpack.packb({"id": 1, "op": "arm", "epoch": 1}),
]
MOST_BYTES = 600_000
"""A few thousand small objects: what 4096 bytes can hold. A claim of 1e8 elements would be 800 MB."""

leaves = (
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text(max_size=9)
    | st.binary(max_size=9)
)
values = st.recursive(
    leaves,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
)
key_names = sorted(
    {key.name for op in OPERATIONS.values() for key in op.keys} | {"id", "op", "epoch", "rig", "x"}
)


def within_bounds(request):
    for name, value in request.values.items():
        if name in BOUNDS:
            low, high = BOUNDS[name]
            assert np.all((np.asarray(value) >= low) & (np.asarray(value) <= high))
    assert 0 <= request.values.get("share", 0) <= 1
    assert request.values.get("axis", 0) in (0, 1)


def judge(payload):
    """Decode without exception, and find either a refusal or a request within every bound."""
    outcome = decode(payload, RIG)
    assert isinstance(outcome, Refusal | Request)
    if isinstance(outcome, Request):
        within_bounds(outcome)
    else:
        assert len(outcome.text) < 400
    return outcome


@given(st.binary(max_size=4100))
@settings(max_examples=300, deadline=None)
def test_random_bytes_never_raise(payload):
    judge(payload)


@given(
    st.sampled_from(VALID),
    st.lists(st.tuples(st.integers(0, 200), st.integers(0, 255)), min_size=1, max_size=4),
)
@settings(max_examples=400, deadline=None)
def test_a_mutated_message_is_refused_or_still_within_bounds(payload, changes):
    mutated = bytearray(payload)
    for where, byte in changes:
        mutated[where % len(mutated)] = byte
    judge(bytes(mutated))


@given(st.sampled_from(VALID), st.integers(0, 200))
@settings(max_examples=100, deadline=None)
def test_a_truncated_message_is_malformed(payload, cut):
    assert judge(payload[: cut % len(payload)]).code == "malformed"


@given(st.sampled_from(sorted(OPERATIONS)), st.dictionaries(st.sampled_from(key_names), values, max_size=8))
@settings(max_examples=200, deadline=None)
def test_any_values_under_known_keys_are_refused_or_within_bounds(op, message):
    judge(msgpack.packb({"id": 1, "op": op, "epoch": 1, **message}))


@given(
    st.sampled_from([0xDD, 0xDF, 0xDB, 0xC6, 0xC9]),
    st.integers(1_000_000, 2**32 - 1),
    st.binary(max_size=64),
    st.integers(0, 200),
)
@settings(max_examples=100, deadline=None)
def test_a_header_that_claims_millions_allocates_next_to_nothing(kind, count, tail, depth):
    payload = b"\x91" * depth + bytes([kind]) + count.to_bytes(4, "big") + tail
    tracemalloc.start()
    try:
        outcome = judge(payload)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert isinstance(outcome, Refusal)
    assert peak < MOST_BYTES


def test_the_worst_nesting_and_the_most_objects_of_4096_bytes_stay_within_the_same_bound():
    wide = b"\x98" + (b"\x98" + b"\x98" * 8) * 455
    for payload in (b"\x98" * 4096, b"\x8f" * 4096, b"\x98\x90" * 2048, b"\x8f\xa0" * 2048, wide[:4096]):
        tracemalloc.start()
        try:
            judge(payload)
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        assert peak < MOST_BYTES


@given(st.binary(max_size=300) | st.sampled_from(VALID).map(lambda valid: valid[:-1]))
@settings(max_examples=100, deadline=None)
def test_a_refused_message_leaves_the_command_as_it_was(payload):
    memory = Memory.create(2, 8, 1_000_000)
    writer = CommandWriter(memory)
    before = writer.command.copy()
    row = new_ticks(1, 2)
    requests = Requests(writer, RIG, Endpoints("ipc://a", "ipc://b"), lambda: row)
    outcome = decode(payload, RIG)
    if isinstance(outcome, Request):
        outcome = requests.perform(outcome, row[0], Caller("ipc:1", "me", "operator"))
    if isinstance(outcome, Refusal):
        assert writer.command.tobytes() == before.tobytes()
        assert memory.header[0]["mailbox_seq"] == 0
    memory.close()
