"""Roles, keys and doors, over real TCP: who gets in, what each may do, and what a revoked key still can."""

import socket as network
import tempfile
from pathlib import Path

import msgpack
import pytest
import zmq
from fake_rig import FakeRig
from patience import PATIENCE_S, until
from ports import free_ports

from rtctl.client import RigClient
from rtctl.client.connection import Connection, remote_endpoints
from rtctl.errors import BusyError, ConfigError, NoReplyError, RefusedError
from rtctl.host.access.entrances import Access, Openings
from rtctl.host.commands.operations import OPERATIONS
from rtctl.wire.keys import ClientKey, KeyStore
from rtctl.wire.protocol import ROLES, Endpoints


@pytest.fixture
def root():
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        yield Path(folder)


@pytest.fixture
def store(root):
    store = KeyStore(root / "keys")
    for role in ROLES:
        store.new(f"the-{role}", role, root / f"{role}.key")
    return store


@pytest.fixture
def port():
    return free_ports(4)


@pytest.fixture
def rig(root, store, port):
    openings = Openings("127.0.0.1", port, store.folder, port + 3)
    with FakeRig(root, openings=openings) as running:
        yield running


@pytest.fixture
def client(rig, root, port):
    made = []

    def connect(role, **more):
        settings = {
            "address": f"127.0.0.1:{port}",
            "key": root / f"{role}.key",
            "timeout_s": PATIENCE_S,
            **more,
        }
        made.append(RigClient(**settings))
        return made[-1]

    yield connect
    for one in made:
        one.close()


# -- what each role may do ---------------------------------------------------------------------------------


def request_for(operation):
    """A well-formed request for an operation of the table, whatever it is."""
    example = {"axis": 0, "numbers": [0.1], "number": 0.5, "lease": "0" * 16}
    keys = {
        key.name: key.choices[0] if key.choices else example[key.kind]
        for key in operation.keys
        if key.required
    }
    return {"epoch": 1, **keys} if operation.needs_epoch else keys


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("op", OPERATIONS)
def test_every_operation_is_open_to_its_roles_and_closed_to_all_others(rig, client, role, op):
    operation = OPERATIONS[op]
    asked = client(role)
    before = rig.writer.command.tobytes()
    try:
        asked._call(op, **request_for(operation))
        code = "ok"
    except RefusedError as refused:
        code = refused.code
    if ROLES.index(role) < ROLES.index(operation.role):
        assert code == "forbidden"
        assert rig.writer.command.tobytes() == before
        assert rig.gateway.counters.forbidden == 1
    else:
        assert code in ("ok", "not_ready", "lease_lost", "missing_key")


def test_the_table_of_roles_is_the_one_of_the_safety_document():
    assert OPERATIONS["stop"].role == "observer", "anybody may stop"
    for op in ("arm", "reset", "tare", "compensation"):
        assert OPERATIONS[op].role == "operator", op
    for op in ("lease", "release", "target", "environment"):
        assert OPERATIONS[op].role == "renderer", op


def test_a_renderer_moves_the_proxy_over_tcp_and_its_lease_keeps_a_second_one_out(rig, client):
    renderer, other, operator = client("renderer"), client("renderer"), client("operator")
    operator.arm()
    assert renderer.hello()["role"] == "renderer"
    with renderer.lease() as lease:
        until(lambda: lease.set_target([0.5]) or rig.writer.command["target_position_rad"][0][0] == 0.5)
        with pytest.raises(RefusedError, match=r"lease_taken: the-renderer holds"):
            other.lease()
        renderer.set_environment(0, "spring", stiffness_nm_rad=2.0, lease=lease)
        with pytest.raises(RefusedError, match="with the lease only"):
            other.set_environment(0, "spring", stiffness_nm_rad=3.0)
        observer = client("observer")
        observer.stop()
        until(lambda: lease.lost)
        with pytest.raises(RefusedError, match="lease_lost"):
            lease.set_target([0.6])
    assert rig.writer.command["environment_stiffness_nm_rad"][0][0] == 2.0


def test_a_lease_seen_by_others_is_of_no_use_to_them(rig, client):
    renderer, operator = client("renderer"), client("operator")
    operator.arm()
    with renderer.lease() as lease:
        with pytest.raises(RefusedError, match="lease_lost"):
            operator._call("target", epoch=lease.epoch, lease=lease.text, position_rad=[1.0])
        with pytest.raises(RefusedError, match="lease_lost"):
            operator._call("release", lease=lease.text)


# -- who gets in -------------------------------------------------------------------------------------------


def test_without_a_key_or_with_an_unknown_one_nobody_gets_in(rig, root, port, client):
    public, secret = zmq.curve_keypair()
    known = ClientKey.load(root / "observer.key")
    stranger = ClientKey("x", "operator", public.decode(), secret.decode(), known.server_key)
    with zmq.Context() as context:
        for key in (None, stranger):
            where = remote_endpoints(f"127.0.0.1:{port}")
            connection = Connection(context, where, key)
            asking = connection.socket(zmq.DEALER, where.command, {})
            asking.send(msgpack.packb({"id": 1, "op": "stop"}))
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
    assert any("unknown key" in text for _kind, text in rig.notices)
    assert client("observer").status()["state"] == "IDLE"


def test_the_wrong_server_key_is_refused_by_the_client(rig, root, port):
    key = ClientKey.load(root / "operator.key")
    other, _ = zmq.curve_keypair()
    wrong = ClientKey(key.name, key.role, key.public_key, key.secret_key, other.decode())
    with zmq.Context() as context:
        where = remote_endpoints(f"127.0.0.1:{port}")
        asking = Connection(context, where, wrong).socket(zmq.DEALER, where.command, {})
        asking.send(msgpack.packb({"id": 1, "op": "stop"}))
        assert not asking.poll(300)
        asking.close()


def test_a_revoked_key_is_cut_off_at_once_and_others_come_back_by_themselves(rig, store, client):
    observer, operator = client("observer"), client("operator")
    states, kept = observer.states(), operator.states()
    observer.status()  # it was in
    observer.timeout_s = 1.0
    next(states)
    next(kept)
    store.revoke("the-observer")
    until(lambda: any(kind == "revoked" for kind, _text in rig.notices))
    with pytest.raises(NoReplyError):
        observer.stop()
    while states.receive(0.0):
        pass  # what was under way
    assert states.receive(1.0) is None, "telemetry still reaches a revoked key"
    assert next(kept).state.name == "IDLE"
    operator.timeout_s = 2.0  # a request may go down with the connection
    until(lambda: _answers(operator))


def _answers(rig_client, state="IDLE"):
    try:
        return rig_client.status()["state"] == state
    except NoReplyError:
        return False


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
        asking.send(b"x")
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
        operator.timeout_s = 2.0
        until(lambda: _answers(operator, "ACTIVE"))


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


# -- what is open at all -----------------------------------------------------------------------------------


def test_viewers_see_states_only_and_can_ask_nothing(rig, port):
    with zmq.Context() as context:
        viewer = context.socket(zmq.SUB)
        viewer.subscribe(b"")
        viewer.connect(f"tcp://127.0.0.1:{port + 3}")
        topics = set()
        for _ in range(20):
            assert viewer.poll(PATIENCE_S * 1000)
            topics.add(viewer.recv_multipart()[0])
        assert topics == {b"rtctl/state"}
        viewer.close(linger=0)
    assert rig.gateway.counters.received == 0


def test_no_tcp_port_is_open_unless_asked_for(root):
    with FakeRig(root) as rig:
        assert len(rig.gateway.doors) == len(rig.gateway.inbox.doors) == 1
        assert rig.access.remote is None
        assert [line for line in rig.access.describe() if "tcp" in line] == []


def test_tcp_is_refused_without_keys_and_with_an_address_in_use(root, store, port):
    with zmq.Context() as context:
        endpoints = Endpoints(f"ipc://{root}/t", f"ipc://{root}/c", f"ipc://{root}/x")
        with pytest.raises(ConfigError, match="rtctl keys new"):
            Access(context, endpoints, Openings("127.0.0.1", port, root / "nowhere"))
        with network.create_server(("127.0.0.1", port)):
            access = Access(context, endpoints, Openings("127.0.0.1", port, store.folder))
            with pytest.raises(BusyError, match=str(port)):
                access.routers("command", 0, {})
            access.close()


def test_a_connection_that_says_nothing_or_nonsense_is_closed(rig, port):
    for first in (b"", b"GET / HTTP/1.1\r\n\r\n", b"\xff" * 100):
        with network.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as stranger:
            stranger.sendall(first)
            heard = b""
            try:
                while part := stranger.recv(4096):
                    heard += part
            except ConnectionResetError:
                pass
            assert len(heard) < 500, "a greeting, and nothing of the rig"
    assert rig.gateway.counters.received == 0
    until(lambda: rig.access.counts()["connected"] == 0)


def test_at_most_sixteen_connect_and_the_last_places_are_for_operators(rig, client):
    renderers = [client("renderer") for _ in range(12)]
    for one in renderers:
        one.hello()
    late = client("renderer", timeout_s=0.5)
    with pytest.raises(NoReplyError):
        late.hello()
    operators = [client("operator") for _ in range(4)]
    for one in operators:
        one.stop()
    with pytest.raises(NoReplyError):
        client("operator", timeout_s=0.5).hello()
    for one in renderers[:6]:
        one.close()
    until(lambda: _answers(late))


def test_a_daemon_without_its_keys_or_its_port_ends_at_once_with_the_reason(root, port):
    from rtctl.host.supervisor import Host
    from rtctl.rig_file.config import load

    configs = Path(__file__).parents[2] / "configs"
    text = (configs / "mock.toml").read_text().replace('"friction/', f'"{configs}/friction/')
    text += f'\n[gateway]\nbind = "127.0.0.1"\nport = {port}\ncurve_dir = "keys"\n'
    (root / "rig.toml").write_text(text)
    host = Host(load(root / "rig.toml"), runtime_dir=str(root))
    with pytest.raises(ConfigError, match="rtctl keys new"):
        host.__enter__()
    KeyStore(root / "keys").new("anna", "operator", root / "anna.key")
    with network.create_server(("127.0.0.1", port + 1)), pytest.raises(BusyError, match=str(port + 1)):
        host.__enter__()
    with network.create_server(("127.0.0.1", port)):
        pass  # nothing of the failed start holds it
