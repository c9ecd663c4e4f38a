"""What a rig opens to the network at all, to how many, and what it refuses to start with."""

import socket as network
from pathlib import Path

import pytest
import zmq
from fake_rig import FakeRig
from patience import PATIENCE_S, until
from tcp_rig import TRY_S, answers

from rtctl.errors import BusyError, ConfigError, NoReplyError
from rtctl.wire.entrances import Access
from rtctl.wire.keys import KeyStore
from rtctl.wire.openings import Openings
from rtctl.wire.protocol import Endpoints


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
    seen = []

    def connected():
        # there: of two threads that read the events of a door each would take a part
        rig.in_host(lambda: seen.append(rig.access.counts()["connected"]))
        return seen and seen[-1] == 0

    until(connected)


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
    late.timeout_s = TRY_S
    until(lambda: answers(late))


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
