"""Keys, over real TCP: who gets in, who is expelled, and what a revoked key still can."""

import contextlib

import msgpack
import pytest
import zmq
from patience import until
from tcp_rig import TRY_S, answers

from rtctl.client import RigClient
from rtctl.client.connection import Connection, remote_endpoints
from rtctl.errors import NoReplyError, RefusedError
from rtctl.wire.entrances import Access
from rtctl.wire.keys import ClientKey
from rtctl.wire.protocol import Endpoints


def ask_if_let_in(asking):
    """Send a STOP. A socket that the rig has refused already takes none: a send that waits would wait for
    ever.
    """
    with contextlib.suppress(zmq.Again):
        asking.send(msgpack.packb({"id": 1, "op": "stop"}), zmq.DONTWAIT)


def test_without_a_key_or_with_an_unknown_one_nobody_gets_in(rig, root, port, client):
    public, secret = zmq.curve_keypair()
    known = ClientKey.load(root / "observer.key")
    stranger = ClientKey("x", "operator", public.decode(), secret.decode(), known.server_key)
    with zmq.Context() as context:
        for key in (None, stranger):
            where = remote_endpoints(f"127.0.0.1:{port}")
            connection = Connection(context, where, key)
            asking = connection.socket(zmq.DEALER, where.command, {})
            ask_if_let_in(asking)
            hearing = connection.socket(zmq.SUB, where.telemetry, {zmq.RCVTIMEO: 300})
            hearing.subscribe(b"")
            with pytest.raises(zmq.Again):
                hearing.recv()
            if key is not None:
                until(lambda: rig.access.authenticator.refused > 0)
            assert not asking.poll(100)
            asking.close()
            hearing.close()
    assert rig.gateway.counters.received == 0
    until(lambda: any("unknown key" in text for _kind, text in rig.notices))
    assert client("observer").status()["state"] == "IDLE"


def test_the_wrong_server_key_is_refused_by_the_client(rig, root, port):
    key = ClientKey.load(root / "operator.key")
    other, _ = zmq.curve_keypair()
    wrong = ClientKey(key.name, key.role, key.public_key, key.secret_key, other.decode())
    with zmq.Context() as context:
        where = remote_endpoints(f"127.0.0.1:{port}")
        asking = Connection(context, where, wrong).socket(zmq.DEALER, where.command, {})
        ask_if_let_in(asking)
        assert not asking.poll(300)
        asking.close()


def test_a_revoked_key_is_cut_off_at_once_and_others_come_back_by_themselves(rig, store, client):
    observer, operator = client("observer"), client("operator")
    states, kept = observer.states(), operator.states()
    observer.status()  # it was in
    next(states)
    next(kept)
    observer.timeout_s = 1.0
    store.revoke("the-observer")
    until(lambda: any(kind == "revoked" for kind, _text in rig.notices))
    with pytest.raises(NoReplyError):
        observer.stop()
    # what was under way still comes; of a hundred samples a second one comes within each
    until(lambda: states.receive(1.0) is None, "the end of telemetry for a revoked key")
    assert next(kept).state.name == "IDLE"
    operator.timeout_s = TRY_S  # a request may go down with the connection
    until(lambda: answers(operator))


def test_a_new_key_gets_in_without_a_restart_and_disturbs_nobody(rig, store, root, client):
    operator = client("operator")
    states = operator.states()
    next(states)
    store.new("late", "renderer", root / "late.key")
    assert client("late").hello()["role"] == "renderer"
    for _ in range(30):
        next(states)
    assert (states.lost, states.restarts) == (0, 0)


def test_a_key_whose_role_changed_has_the_new_role(rig, store, root, client):
    assert client("operator").hello()["role"] == "operator"
    store.revoke("the-operator")
    (root / "operator.key").unlink()
    store.new("the-operator", "observer", root / "operator.key")
    demoted = client("operator")
    assert demoted.hello()["role"] == "observer"
    with pytest.raises(RefusedError, match="forbidden"):
        demoted.arm()


def test_when_the_authenticator_is_dead_nobody_new_gets_in(rig, client, root):
    assert client("observer").hello()["role"] == "observer"
    rig.access.authenticator.serve = lambda: None
    for late in (client("operator", timeout_s=0.5), RigClient("mock", runtime_dir=root, timeout_s=0.5)):
        with pytest.raises(NoReplyError):
            late.stop()
        late.close()
    assert rig.gateway.counters.received == 1


def test_without_any_authenticator_nobody_gets_in(root):
    with zmq.Context() as context:
        endpoints = Endpoints(f"ipc://{root}/t", f"ipc://{root}/c", f"ipc://{root}/x")
        access = Access(context, endpoints)
        (door,) = access.routers("command", 0, {})
        access.authenticator.close()
        asking = context.socket(zmq.DEALER)
        asking.setsockopt(zmq.LINGER, 0)
        asking.connect(endpoints.command)
        ask_if_let_in(asking)
        assert not door.socket.poll(300)
        asking.close()
        access.close()


def test_who_subscribes_to_thousands_of_topics_is_expelled_and_the_others_hear_on(rig, root, port, client):
    operator = client("operator")
    states = operator.states()
    next(states)
    with zmq.Context() as context:
        where = remote_endpoints(f"127.0.0.1:{port}")
        connection = Connection(context, where, ClientKey.load(root / "observer.key"))
        greedy = connection.socket(zmq.XSUB, where.telemetry, {zmq.SNDHWM: 0})
        for number in range(2000):
            greedy.send(b"\x01" + b"x" * 200 + str(number).encode())
        until(lambda: any(kind == "expelled" for kind, _text in rig.notices))
        assert "the-observer" in next(text for kind, text in rig.notices if kind == "expelled")
        greedy.close()
    until(lambda: states.receive(0.5) is not None)
    back = client("observer")
    assert back.states().receive(0.4) is None, "telemetry is closed to it for a while"
    back.stop()  # a stop is not


def test_a_renderer_whose_connection_is_cut_goes_on_with_its_lease_without_a_new_start(rig, store, client):
    renderer, operator = client("renderer"), client("operator")
    operator.arm()
    with renderer.lease() as lease:
        until(lambda: lease.set_target([0.25]) or rig.writer.command["target_position_rad"][0][0] == 0.25)
        store.revoke("the-observer")
        until(lambda: any(kind == "revoked" for kind, _text in rig.notices))
        until(lambda: lease.set_target([0.5]) or rig.writer.command["target_position_rad"][0][0] == 0.5)
        assert not lease.lost
        operator.timeout_s = TRY_S
        until(lambda: answers(operator, "ACTIVE"))


def test_an_observer_moves_nothing_by_the_endpoint_for_targets_either(rig, root, port, client):
    renderer = client("renderer")
    with renderer.lease() as lease, zmq.Context() as context:
        where = remote_endpoints(f"127.0.0.1:{port}")
        for role in ("observer", "operator"):
            connection = Connection(context, where, ClientKey.load(root / f"{role}.key"))
            sending = connection.socket(zmq.DEALER, where.targets, {})
            refused = rig.gateway.inbox.counters.refused
            stolen = {"lease": lease.text, "epoch": lease.epoch, "position_rad": [1.0]}
            sending.send(msgpack.packb(stolen))
            until(lambda before=refused: rig.gateway.inbox.counters.refused > before)
            sending.close()
    assert rig.writer.command["target_count"][0] == 0


def test_keys_that_cannot_be_read_for_the_moment_stay_as_they_are(rig, store, client, monkeypatch):
    operator = client("operator")
    operator.hello()

    def refuse():
        raise OSError(24, "Too many open files")

    with monkeypatch.context() as patch:
        patch.setattr(rig.access._store, "signature", refuse)
        until(lambda: any("cannot be read now" in text for _kind, text in rig.notices))
        assert operator.hello()["role"] == "operator"
    store.revoke("the-observer")
    until(lambda: any(kind == "revoked" for kind, _text in rig.notices))


def test_whoever_sends_a_message_of_too_many_frames_is_expelled_and_the_others_go_on(rig, root, port, client):
    operator = client("operator")
    operator.hello()
    with zmq.Context() as context:
        where = remote_endpoints(f"127.0.0.1:{port}")
        connection = Connection(context, where, ClientKey.load(root / "observer.key"))
        greedy = connection.socket(zmq.DEALER, where.command, {})
        greedy.send_multipart([b"x"] * 50)
        until(lambda: any(kind == "expelled" for kind, _text in rig.notices))
        greedy.close(linger=0)
    assert "the-observer" in next(text for kind, text in rig.notices if kind == "expelled")
    assert operator.hello()["role"] == "operator"
    with pytest.raises(NoReplyError):
        client("observer", timeout_s=0.5).hello()
