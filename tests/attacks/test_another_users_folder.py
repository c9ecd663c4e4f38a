"""Somebody else makes the folder in which this user's clients look for the rig, and answers there."""

import os
import tempfile
import threading
from pathlib import Path

import msgpack
import pytest
import zmq
from patience import PATIENCE_S

from rtctl.client import RigClient
from rtctl.client.capture import Capture
from rtctl.errors import ConfigError, NoReplyError
from rtctl.wire import protocol
from rtctl.wire.protocol import endpoints_in, running_rigs

STRANGER = 12345


class Impostor:
    """Says yes to every request that comes into `folder`."""

    def __init__(self, folder):
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.ROUTER)
        self._socket.bind(endpoints_in(folder).command)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._answer)
        self._thread.start()

    def _answer(self):
        while not self._over.is_set():
            if self._socket.poll(20):
                sender, payload = self._socket.recv_multipart()
                reply = {
                    "id": msgpack.unpackb(payload)["id"],
                    "ok": True,
                    "epoch": 1,
                    "state": 3,
                    "result": {},
                }
                self._socket.send_multipart([sender, msgpack.packb(reply)])

    def close(self):
        self._over.set()
        self._thread.join()
        self._socket.close(linger=0)
        self._context.term()


@pytest.fixture
def place(monkeypatch):
    """A folder where all may write, as /tmp, with the stranger's imitation of this user's runtime folder in
    it.
    """
    for name in ("RTCTL_RUNTIME_DIR", "RUNTIME_DIRECTORY", "XDG_RUNTIME_DIR"):
        monkeypatch.delenv(name, raising=False)
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        Path(folder).chmod(0o1777)
        monkeypatch.setattr(tempfile, "tempdir", folder)
        monkeypatch.setattr(protocol, "SERVICE_ROOT", Path(folder, "service"))
        imitation = Path(folder, f"rtctl-{os.geteuid()}", "mock")
        imitation.mkdir(parents=True, mode=0o700)
        yield imitation


@pytest.fixture
def impostor(place):
    made = Impostor(place)
    yield made
    made.close()


def give_away(monkeypatch, *folders):
    """Have them belong to a stranger: by root in truth, else as far as our own eyes go."""
    if os.geteuid() == 0:
        for folder in folders:
            os.chown(folder, STRANGER, STRANGER)
    else:
        monkeypatch.setattr(os, "geteuid", lambda: STRANGER)


def test_a_stop_is_not_reported_done_by_whoever_made_the_folder(place, impostor, monkeypatch):
    with RigClient("mock", timeout_s=PATIENCE_S) as client:
        client.stop()  # ours: believed
    monkeypatch.setenv("RTCTL_RUNTIME_DIR", str(place.parent))
    give_away(monkeypatch, place.parent, place)
    with pytest.raises(ConfigError, match="belongs to user"):
        RigClient("mock")
    with (
        RigClient("mock", endpoints=endpoints_in(place)) as client,
        pytest.raises(NoReplyError, match="belongs to user"),
    ):
        client.stop()
    with pytest.raises(NoReplyError, match="belongs to user"):
        Capture(endpoints_in(place))


def test_a_folder_that_changes_hands_after_the_connection_is_not_believed_either(
    place, impostor, monkeypatch
):
    with RigClient("mock", timeout_s=PATIENCE_S) as client:
        client.stop()
        monkeypatch.setenv("RTCTL_RUNTIME_DIR", str(place.parent))
        give_away(monkeypatch, place.parent, place)
        with pytest.raises(NoReplyError, match="belongs to user"):
            client.stop()


def test_a_strangers_folder_does_not_hide_the_service(place, monkeypatch):
    service = protocol.SERVICE_ROOT / "mock"
    service.mkdir(parents=True)
    monkeypatch.setenv("RTCTL_RUNTIME_DIR", str(place.parent))
    assert protocol.client_directory("mock") == place
    place.parent.chmod(0o777)  # as good as a stranger's: all may put their own folder there
    assert protocol.client_directory("mock") == service
    service.chmod(0o777)
    with pytest.raises(ConfigError, match="lets others in"):
        protocol.client_directory("mock")


def test_a_link_in_place_of_the_folder_is_refused(place):
    elsewhere = place.with_name("elsewhere")
    place.rename(elsewhere)
    place.symlink_to(elsewhere)
    with pytest.raises(ConfigError, match="not a link"):
        protocol.client_directory("mock")


@pytest.mark.timeout(20)
def test_a_look_for_running_rigs_neither_hangs_nor_believes_a_stranger(place, monkeypatch):
    root = place.parent
    (place / "lock").write_text(f"{os.getpid()}\n")
    assert running_rigs(root) == ["mock"]
    (root / "pipe").mkdir(mode=0o700)
    os.mkfifo(root / "pipe" / "lock")
    (root / "endless").mkdir(mode=0o700)
    (root / "endless" / "lock").symlink_to("/dev/zero")
    (root / "evil\x1b[2J").mkdir(mode=0o700)
    (root / "evil\x1b[2J" / "lock").write_text(f"{os.getpid()}\n")
    assert running_rigs(root) == ["mock"]
    give_away(monkeypatch, place, root)
    assert running_rigs(root) == []
