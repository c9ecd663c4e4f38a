import pytest
import zmq
from zmq.utils import z85

from rtctl.errors import BusyError
from rtctl.wire.authenticator import BAN_S, PAUSE_S, VIEWER, ZAP_ADDRESS, Authenticator
from rtctl.wire.keys import Key

PUBLIC = bytes(range(32))
TEXT = z85.encode(PUBLIC).decode()


class Places:
    """Connections with a given number of free places; remembers for which roles it was asked."""

    def __init__(self, free=100):
        self.free, self.asked = free, []

    def permit(self, role, _process=None):
        self.asked.append(role)
        self.free -= 1
        return self.free >= 0


class Desk:
    """An authenticator with one door of each kind, asked as libzmq asks it."""

    def __init__(self):
        self.now_s = 0.0
        self.notices = []
        self.context = zmq.Context()
        self.authenticator = Authenticator(
            self.context, lambda *notice: self.notices.append(notice), lambda: self.now_s
        )
        self.authenticator.keys = {TEXT: Key("anna", "renderer", TEXT)}
        self.places = {}
        for entry in ("ipc", "curve", "viewer"):
            socket = self.context.socket(zmq.ROUTER)
            self.places[entry] = Places()
            self.authenticator.guard(socket, "x", entry, self.places[entry])
            socket.close()
        self.libzmq = self.context.socket(zmq.DEALER)
        self.libzmq.connect(ZAP_ADDRESS)

    def ask(self, *frames):
        self.libzmq.send_multipart([b"", *frames])
        self.authenticator.serve()
        assert self.libzmq.poll(60_000), "no answer: the connection would hang"
        _, _version, number, status, _text, user_id, _metadata = self.libzmq.recv_multipart()
        assert number == (frames[1] if len(frames) > 1 else b"")
        return status.decode(), user_id.decode()

    def connect(self, entry, mechanism=b"NULL", *credentials, peer=b"192.168.1.9"):
        domain = f"rtctl.{entry}.x".encode()
        return self.ask(b"1.0", b"1", domain, peer, b"chosen by the client", mechanism, *credentials)

    def close(self):
        self.libzmq.close(linger=0)
        self.authenticator.close()
        self.context.term()


@pytest.fixture
def desk():
    made = Desk()
    yield made
    made.close()


def test_a_known_key_comes_in_by_its_key_and_with_its_role(desk):
    status, user_id = desk.connect("curve", b"CURVE", PUBLIC)
    assert (status, user_id) == ("200", f"key:{TEXT}")
    assert desk.places["curve"].asked == ["renderer"]
    assert desk.authenticator.caller(user_id).name == "anna"
    desk.authenticator.keys = {}
    assert desk.authenticator.caller(user_id) is None, "a revoked key is nobody at once"


@pytest.mark.parametrize(
    ("entry", "mechanism", "credentials"),
    [
        ("curve", b"NULL", []),
        ("curve", b"PLAIN", [b"anna", b"secret"]),
        ("curve", b"CURVE", []),
        ("curve", b"CURVE", [bytes(32)]),
        ("curve", b"CURVE", [PUBLIC[:31]]),
        ("curve", b"CURVE", [PUBLIC, PUBLIC]),
        ("curve", b"CURVE", [b""]),
        ("ipc", b"CURVE", [PUBLIC]),
        ("ipc", b"PLAIN", [b"a", b"b"]),
        ("viewer", b"NULL", []),
        ("elsewhere", b"NULL", []),
    ],
)
def test_everything_else_is_turned_away_and_takes_no_place(desk, entry, mechanism, credentials):
    status, user_id = desk.connect(entry, mechanism, *credentials)
    assert (status, user_id) == ("400", "")
    assert all(places.asked == [] for places in desk.places.values())
    assert desk.authenticator.refused == 1


def test_by_ipc_the_process_is_known_and_viewers_are_of_this_machine(desk):
    assert desk.connect("ipc", peer=b"localhost:1000:1000:77") == ("200", "ipc:1000:1000:77")
    assert desk.authenticator.caller("ipc:1000:1000:77").role == "operator"


def test_the_last_places_are_for_the_daemons_own_user_and_root(desk, monkeypatch):
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    for user in (0, 1000, 1001):
        desk.connect("ipc", peer=f"localhost:{user}:1000:77".encode())
    assert desk.places["ipc"].asked == ["operator", "operator", "renderer"]
    assert desk.connect("viewer", peer=b"127.0.0.1") == ("200", "viewer:")
    assert desk.authenticator.caller("viewer:") is None, "a viewer may ask for nothing"


@pytest.mark.parametrize(
    "frames", [[b"1.0"], [b"1.0", b"1", b"rtctl.ipc.x"], [b"2.0", b"1", b"", b"", b"", b""]]
)
def test_a_request_that_is_none_is_answered_with_a_refusal(desk, frames):
    assert desk.ask(*frames)[0] == "400"


def test_when_the_places_are_taken_it_may_try_again(desk):
    desk.places["curve"].free = 0
    assert desk.connect("curve", b"CURVE", PUBLIC)[0] == "300"


def test_a_key_made_just_now_is_looked_for(desk):
    new = bytes(range(1, 33))
    text = z85.encode(new).decode()

    def refresh():
        desk.authenticator.keys = {text: Key("late", "observer", text)}

    desk.authenticator.refresh = refresh
    assert desk.connect("curve", b"CURVE", new) == ("200", f"key:{text}")


def test_who_was_expelled_stays_out_of_that_door_only_and_not_for_ever(desk):
    desk.authenticator.ban(b"rtctl.curve.x", f"key:{TEXT}")
    assert desk.connect("curve", b"CURVE", PUBLIC)[0] == "300"
    assert desk.connect("ipc", peer=b"localhost:0:0:1")[0] == "200"
    desk.now_s += BAN_S + 1
    assert desk.connect("curve", b"CURVE", PUBLIC)[0] == "200"


def test_an_expelled_viewer_keeps_the_others_waiting_for_a_moment_only(desk):
    desk.authenticator.ban(b"rtctl.viewer.x", VIEWER)
    assert desk.connect("viewer", peer=b"127.0.0.1")[0] == "300", "it may try again"
    desk.now_s += PAUSE_S
    assert desk.connect("viewer", peer=b"127.0.0.1") == ("200", VIEWER)


def test_a_context_has_one_authenticator(desk):
    with pytest.raises(BusyError):
        Authenticator(desk.context)
