import math

import msgpack
import pytest
from axis_bounds import BOUNDS

from rtctl.host.exchange.messages import MAX_ID, Refusal, Request, decode, decode_target
from rtctl.host.exchange.operations import OPERATIONS
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.wire.encoding import encode
from rtctl.wire.protocol import PROTOCOL_VERSION

TIGHT = {**BOUNDS, "position_rad": (-0.5, 0.5), "stiffness_nm_rad": (0.0, 1.0)}
RIG = RigDescription("mock", (AxisDescription("base", BOUNDS), AxisDescription("tip", TIGHT)), 1000.0)
TARGET = {"id": 1, "op": "target", "epoch": 3, "lease": "00000000000000ab", "position_rad": [0.1, 0.2]}


def ask(**message):
    return decode(msgpack.packb(message), RIG)


def refused(code, **message):
    outcome = ask(**message)
    assert isinstance(outcome, Refusal), outcome
    assert outcome.code == code, outcome
    return outcome


def test_every_operation_without_required_keys_is_accepted_bare():
    for op, operation in OPERATIONS.items():
        if not any(key.required for key in operation.keys):
            # a stop counts in every epoch
            assert ask(id=1, op=op, epoch=2) == Request(1, op, None if op == "stop" else 2)


@pytest.mark.parametrize(
    "more",
    [{"why": "of a later version"}, {"epoch": "4"}, {"epoch": -1}, {"epoch": None}, {"axis": [1] * 8}],
)
def test_a_stop_is_one_whatever_else_its_map_holds(more):
    assert ask(id=1, op="stop", **more) == Request(1, "stop")
    for no_id in (None, -1, "", [1], True):
        assert ask(id=no_id, op="stop", **more) == Request(None, "stop"), "it stops, and nobody is answered"
    assert ask(op="stop", **more) == Request(None, "stop")


def test_arm_and_target_need_an_epoch_so_that_a_stop_voids_them():
    assert "epoch" in refused("missing_key", id=1, op="arm").text
    refused("missing_key", **{k: v for k, v in TARGET.items() if k != "epoch"})
    assert isinstance(ask(id=1, op="stop"), Request)


def test_a_target_carries_one_value_per_axis_each_within_its_own_axis_bounds():
    assert ask(**TARGET).values == {"lease": "00000000000000ab", "position_rad": [0.1, 0.2]}
    assert "position_rad[1]" in refused("out_of_bounds", **{**TARGET, "position_rad": [0.1, 0.6]}).text
    refused("wrong_type", **{**TARGET, "position_rad": [0.1]})
    refused("wrong_type", **{**TARGET, "position_rad": 0.1})
    refused("wrong_type", **{**TARGET, "position_rad": [0.1, "0.2"]})


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e308, 2**64 - 1])
def test_numbers_that_are_not_finite_or_too_large_are_refused_everywhere(value):
    refused("out_of_bounds", **{**TARGET, "velocity_rad_s": [0.0, value]})
    refused("out_of_bounds", id=1, op="compensation", share=value)
    refused("out_of_bounds", id=1, op="environment", axis=0, kind="spring", stiffness_nm_rad=value)


def test_an_axis_is_given_by_name_or_index_and_its_own_bounds_hold():
    spring = {"id": 1, "op": "environment", "kind": "spring", "stiffness_nm_rad": 2}
    assert ask(**spring, axis="base").values == {"axis": 0, "kind": "spring", "stiffness_nm_rad": 2.0}
    assert ask(**spring, axis=0).values["axis"] == 0
    refused("out_of_bounds", **spring, axis="tip")
    for wrong in ("elbow", 2, -1):
        refused("unknown_axis", **spring, axis=wrong)
    for wrong in (True, 0.0, None, [0]):
        refused("wrong_type", **spring, axis=wrong)


def test_choices_are_exact_also_in_type():
    wall = {"id": 1, "op": "environment", "axis": 0, "kind": "wall"}
    assert ask(**wall, side=-1).values["side"] == -1
    refused("out_of_bounds", **wall, side=0)
    for wrong in (True, 1.0, "1", None):
        refused("wrong_type", **wall, side=wrong)
    refused("out_of_bounds", **{**wall, "kind": "honey"})
    refused("wrong_type", **{**wall, "kind": 1})
    refused("wrong_type", **{**wall, "kind": ["wall"]})


def test_unknown_keys_and_operations_are_named():
    assert "'gain'" in refused("unknown_key", id=1, op="compensation", share=1, gain=2).text
    assert "compensation" in refused("unknown_op", id=1, op="explode").text
    refused("unknown_op", id=1, op=["arm"])
    refused("unknown_op", id=1)


def test_what_is_meant_for_another_rig_is_refused_but_a_stop_counts():
    assert ask(id=1, op="reset", rig=RIG.name).op == "reset"
    told = refused("wrong_rig", id=1, op="environment", axis="base", kind="free", rig="other").text
    assert "'other'" in told
    assert RIG.name in told
    refused("wrong_type", id=1, op="reset", rig=7)
    assert ask(id=1, op="stop", rig="other").op == "stop"


def test_what_is_asked_in_a_later_protocol_is_refused_but_a_stop_counts():
    assert ask(id=1, op="reset", protocol=PROTOCOL_VERSION).op == "reset"
    told = refused("wrong_protocol", id=1, op="an operation to come", protocol=PROTOCOL_VERSION + 1).text
    assert f"protocol {PROTOCOL_VERSION + 1}, this daemon {PROTOCOL_VERSION}:" in told
    refused("wrong_type", id=1, op="reset", protocol=1.0)
    assert ask(id=1, op="stop", protocol=PROTOCOL_VERSION + 1).op == "stop"
    aim = {"epoch": 1, "lease": "1b2c3d4e5f607182", "position_rad": [0.0] * RIG.n_axes}
    told = decode_target(msgpack.packb({**aim, "protocol": PROTOCOL_VERSION + 1}), RIG)
    assert isinstance(told, Refusal)
    assert told.code == "wrong_protocol"
    assert isinstance(decode_target(msgpack.packb({**aim, "protocol": PROTOCOL_VERSION}), RIG), Request)


def test_booleans_are_no_numbers():
    refused("wrong_type", id=1, op="compensation", share=True)
    refused("wrong_type", id=1, op="reset", epoch=True)
    assert refused("malformed", id=True, op="reset").id is None


def test_ids_are_bounded_and_come_back_with_the_refusal():
    for good in (0, MAX_ID, "a", "x" * 64):
        assert refused("unknown_op", id=good, op="none").id == good
    for bad in (-1, MAX_ID + 1, "", 1.5, None, [1]):
        assert refused("malformed", id=bad, op="hello").id is None


def test_epochs_are_bounded_integers():
    refused("out_of_bounds", id=1, op="arm", epoch=-1)
    refused("out_of_bounds", id=1, op="arm", epoch=1e300)
    for none in (1.5, math.nan, math.inf):
        refused("wrong_type", id=1, op="arm", epoch=none)
    refused("wrong_type", id=1, op="arm", epoch=None)


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"\xc1",
        b"\x80",
        msgpack.packb([1]),
        msgpack.packb(7),
        msgpack.packb({"id": 1, "op": "stop"}) + b"\xc0",
        msgpack.packb({"id": 1, "op": "stop"})[:-1],
        msgpack.packb({1: "id", "op": "stop"}),
        msgpack.packb({b"id": 1, "op": "stop"}),
        msgpack.packb({"id": 1, "op": b"stop"}),
        msgpack.packb({"id": 1, "op": "stop", "x": msgpack.Timestamp(1)}),
        msgpack.packb({"id": 1, "op": "x" * 65}),
        b"\x82\xa2id\x01\xa2op\xa4\xff\xff\xff\xff",
        b"\x91" * 4096,
        b"\x81\xa1a" * 1300,
        b"\xdf\x05\xf5\xe1\x00",
        b"\xdd\x05\xf5\xe1\x00",
        b"\xdb\x05\xf5\xe1\x00",
        b"\xc9\x05\xf5\xe1\x00\x01",
    ],
)
def test_what_is_not_one_small_map_is_malformed(payload):
    outcome = decode(payload, RIG)
    assert isinstance(outcome, Refusal)
    assert (outcome.code, outcome.id) == ("malformed", None)


def test_a_key_given_twice_is_malformed_instead_of_the_last_winning():
    twice = b"\x83\xa2id\x01\xa2op\xa4stop\xa2op\xa3arm"
    assert "twice" in decode(twice, RIG).text


def test_more_than_4096_bytes_are_refused_unread():
    assert decode(b"\x80" * 4097, RIG).code == "too_large"


def test_texts_of_refusals_stay_short_whatever_was_sent():
    for message in (
        {"id": 1, "op": "a" * 64},
        {"id": 1, "op": "hello", "k" * 64: 1},
        {**TARGET, "position_rad": [[]]},
    ):
        assert len(ask(**message).text) < 300


def test_a_target_of_its_own_endpoint_needs_epoch_lease_and_position_but_no_id():
    keys = {key: TARGET[key] for key in ("epoch", "lease", "position_rad")}
    taken = decode_target(msgpack.packb(keys), RIG)
    assert (taken.op, taken.epoch, taken.values["position_rad"]) == ("target", 3, [0.1, 0.2])
    for name in keys:
        left = {key: value for key, value in keys.items() if key != name}
        assert decode_target(msgpack.packb(left), RIG).code == "missing_key"
    assert decode_target(b"junk", RIG).code == "malformed"
    assert decode_target(msgpack.packb({**keys, "op": "stop"}), RIG).op == "target", "it can be nothing else"


@pytest.mark.parametrize("lease", ["", "00000000000000AB", "0" * 15, "0" * 17, 171, None])
def test_a_lease_is_sixteen_hexadecimal_characters(lease):
    refused("wrong_type", **{**TARGET, "lease": lease})


def test_keys_are_texts_and_values_are_shown_as_what_they_are():
    assert "keys are strings" in decode(msgpack.packb({b"": 2}), RIG).text
    assert decode(msgpack.packb({1: 2}), RIG).code == "malformed"
    assert "a map" in refused("wrong_type", id=1, op="compensation", share={"a": 1}).text
    assert "an array" in refused("wrong_type", id=1, op="compensation", share=[1]).text
    assert "nil" in refused("wrong_type", id=1, op="compensation", share=None).text
    assert "share is missing" in refused("missing_key", id=1, op="compensation").text


def test_replies_are_msgpack():
    assert msgpack.unpackb(encode({"ok": True})) == {"ok": True}
