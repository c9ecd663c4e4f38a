import subprocess
import sys
from types import SimpleNamespace

import msgpack
import numpy as np
import pytest
import zmq
from patience import until

from rtctl.client import Fault, RigClient, State, lease, requests, streams
from rtctl.client.connection import Connection
from rtctl.client.requests import Requester
from rtctl.client.samples import rig_state, tick_rows
from rtctl.errors import ClientError, ConfigError, NoReplyError, RefusedError
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.host.exchange.samples import state_samples, tick_columns
from rtctl.tick import new_ticks
from rtctl.wire.protocol import endpoints_in

RIG = RigDescription("mock", (AxisDescription("a", {}), AxisDescription("b", {})), 1000.0, session=7)


def rows(n=3):
    out = new_ticks(n, 2)
    out["tick"], out["time_ns"] = np.arange(n), np.arange(n) * 1_000_000
    out["state"], out["faults"], out["fault_first"] = State.FAULT, Fault.STALE | Fault.JUMP, 2
    out["position_rad"] = np.arange(2 * n).reshape(n, 2) / 7
    return out


def test_a_state_sample_is_typed():
    (message,) = msgpack.unpackb(msgpack.packb(state_samples(rows(1), RIG, 9, 5_000_000)))
    sample = rig_state(message, now_s=0.007)
    assert (sample.state, sample.faults) == (State.FAULT, (Fault.STALE, Fault.JUMP))
    assert sample.position_rad == (0.0, 1 / 7)
    assert sample.age_s == pytest.approx(0.007)
    assert (sample.sequence, sample.session, sample.tick) == (9, 7, 0)


class Delivered:
    """A connection whose stream has received one message and gets no more."""

    def __init__(self, message):
        self.waiting, self.endpoints = [[b"", msgpack.packb(message)]], SimpleNamespace(telemetry="here")

    def socket(self, *_arguments):
        return self

    def setsockopt(self, *_arguments):
        pass

    def poll(self, _wait_ms):
        return bool(self.waiting)

    def recv_multipart(self):
        return self.waiting.pop()


class Door(Delivered):
    """A connection whose daemon says which rig it is, or not, and refuses nothing."""

    endpoints = SimpleNamespace(command="here")

    def __init__(self, **more):
        self.asked, self._more = [], {"ok": True, **more}

    def vouch(self, _endpoint):
        pass

    def poll(self, *_arguments):
        return True

    def send(self, payload, _flags):
        self.asked.append(msgpack.unpackb(payload))

    def recv_multipart(self):
        return [msgpack.packb({"id": self.asked[-1]["id"], "epoch": 1, **self._more})]


def test_a_client_means_the_rig_that_answered_it_first_where_the_daemon_says_which():
    for more, meant in ({"rig": "arm"}, "arm"), ({}, None):
        door = Door(**more)
        asking = Requester(door)
        for _ in range(2):
            asking.call("reset", 1.0)
        assert [one.get("rig") for one in door.asked] == [None, meant]


@pytest.mark.parametrize("code", ["unknown_key", "unknown_op", "not_ready"])
def test_a_daemon_of_an_older_version_is_told_in_plain_words(code):
    asking = Requester(Door(ok=False, error={"code": code, "text": "'tick'"}))
    with pytest.raises(RefusedError, match="'tick'") as told:
        asking.call("arm", 1.0, tick=7)
    assert ("start the daemon anew" in str(told.value)) == (code != "not_ready")


@pytest.mark.parametrize(
    ("mine", "theirs", "whose"),
    [(1, 2, "this client"), (2, None, "the daemon"), (2, 1, "the daemon")],
)
def test_a_daemon_of_another_protocol_is_told_and_takes_a_stop(monkeypatch, mine, theirs, whose):
    monkeypatch.setattr(requests, "PROTOCOL_VERSION", mine)
    door = Door(**({} if theirs is None else {"protocol": theirs}))
    asking = Requester(door)
    told_of_both = rf"protocol {theirs or 1}, this client {mine}, .* for {whose}"
    with pytest.raises(RefusedError, match=told_of_both) as told:
        asking.call("arm", 1.0)
    assert told.value.code == "wrong_protocol"
    assert asking.call("stop", 1.0)["ok"]
    assert [one.get("protocol") for one in door.asked] == [None if mine == 1 else mine] * 2


def test_of_a_message_of_several_samples_each_is_as_old_as_when_it_is_handed_out(monkeypatch):
    clock = SimpleNamespace(now_s=0.005, monotonic=lambda: clock.now_s)
    monkeypatch.setattr(streams, "time", clock)
    message = state_samples(rows(3), RIG, 0, 4_000_000)
    every = streams.state_stream(Delivered(message), 1.0)
    fresh = streams.state_stream(Delivered(message), 1.0, max_age_s=0.1)
    assert (next(every).age_s, next(fresh).tick) == (pytest.approx(0.005), 0)
    clock.now_s = 0.7  # the program stood still in between
    late = next(every)
    assert (late.tick, late.age_s, late.stale) == (1, pytest.approx(0.699), True)
    assert fresh.receive(0.0) is None
    assert (fresh.outdated, fresh.lost) == (2, 0)


@pytest.mark.parametrize(
    ("way", "apart_s", "shortest_s"),
    [("tcp://far:9862", -86_400.0, 0.0), ("tcp://far:9862", 86_400.0, 0.0), ("ipc:///run/here", 0.0, 0.001)],
)
def test_an_age_over_the_network_does_not_go_by_another_machines_clock(monkeypatch, way, apart_s, shortest_s):
    clock = SimpleNamespace(now_s=0.0, monotonic=lambda: clock.now_s)
    monkeypatch.setattr(streams, "time", clock)
    delivered = Delivered([])
    delivered.endpoints = SimpleNamespace(telemetry=way)
    stream = streams.state_stream(delivered, 1.0, max_age_s=0.1)
    ages = []
    # sent a second apart; the last but one waits here for half a second
    for k, (sent_s, late_s) in enumerate([(100.0, 0.002), (101.0, 0.001), (102.0, 0.5), (103.0, 0.001)]):
        message = state_samples(rows(1), RIG, k, round(sent_s * 1e9))
        for one in message:
            one["age_s"] = 0.0
        delivered.waiting = [[b"", msgpack.packb(message)]]
        clock.now_s = sent_s + apart_s + late_s
        sample = stream.receive(0)
        ages.append(None if sample is None else round(sample.age_s, 3))
    assert ages[1:] == [shortest_s, None, shortest_s]
    assert stream.outdated == 1


def test_tick_batches_come_back_bit_for_bit():
    some = rows()
    again = tick_rows(msgpack.unpackb(msgpack.packb({"rows": 3, "columns": tick_columns(some)})))
    assert again.tobytes() == some.tobytes()


def test_no_daemon_is_a_named_error_that_says_what_to_do(tmp_path):
    with RigClient("mock", runtime_dir="/tmp/rtctl-none", timeout_s=0.05) as client:
        with pytest.raises(NoReplyError, match="rtctl run"):
            client.hello()
        with pytest.raises(NoReplyError):
            client.latest_state()
        with pytest.raises(NoReplyError):
            next(client.states())


def test_a_bad_name_and_a_closed_client_are_named_errors():
    with pytest.raises(ConfigError):
        RigClient("../mock")
    client = RigClient("mock", runtime_dir="/tmp/rtctl-none")
    client.close()
    client.close()
    with pytest.raises(ClientError, match="closed"):
        client.status()


def test_the_client_stays_light():
    code = "import sys, rtctl.client; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert "zmq" in loaded
    for heavy in (
        "numba",
        "llvmlite",
        "sklearn",
        "scipy",
        "pydantic",
        "matplotlib",
        "click",
        "rtctl.host",
        "rtctl.rig_file.config",
    ):
        assert heavy not in loaded


def test_an_address_needs_a_key_and_a_key_an_address(tmp_path):
    for half in ({"address": "127.0.0.1:9860"}, {"key": tmp_path / "x.key"}):
        with pytest.raises(ConfigError, match="belong together"):
            RigClient(**half)
    for bad in ("127.0.0.1", ":9860", "host:0", "host:70000", "host:x"):
        with pytest.raises(ConfigError, match="HOST:PORT"):
            RigClient(address=bad, key=tmp_path / "x.key")


def test_a_stream_that_was_closed_says_so():
    stream = streams.state_stream(Delivered([]), 1.0)
    stream._socket.close = lambda **_: None
    stream.close()
    with pytest.raises(ClientError, match="this stream is closed"):
        stream.receive(0.0)


@pytest.mark.parametrize("timeout_s", [0.0, -1.0, float("nan"), float("inf")])
def test_a_time_that_nobody_can_wait_is_refused_by_name(tmp_path, timeout_s):
    with pytest.raises(ConfigError, match="timeout_s"):
        RigClient("mock", runtime_dir=tmp_path, timeout_s=timeout_s)


def test_streams_that_were_closed_are_not_kept(tmp_path):
    with RigClient(endpoints=endpoints_in(tmp_path)) as client:
        for _ in range(5):
            client.ticks().close()
        newest = client.states()
        assert client._streams == [newest]


def test_a_lease_whose_renewal_is_answered_by_something_else_is_lost(tmp_path, monkeypatch):
    class Answers:
        def __init__(self, _connection):
            self.calls = 0

        def call(self, *_arguments, **_values):
            self.calls += 1
            if self.calls > 2:
                raise ClientError("a reply that is not msgpack; is something else listening there?")
            given = {"lease": "a" * 16, "target_position_rad": [0.0], "silence_s": 0.02}
            return {"result": {**given, "remote": ["a"] if self.calls == 2 else []}}

        def close(self):
            pass

    monkeypatch.setattr(lease, "Requester", Answers)
    with zmq.Context() as context:
        held = lease.Lease(Connection(context, endpoints_in(tmp_path)), 1, 1.0)
        assert held.remote == ()
        until(lambda: held.lost, "the end of the lease")
        assert held.remote == ("a",)  # of the renewal
        with pytest.raises(RefusedError, match="something else"):
            held.set_target([0.0])
        held.abandon()
