"""A rig that listens on TCP, with a key of every role, and clients that may be of any."""

import contextlib
import tempfile
from pathlib import Path

from fake_rig import FakeRig
from patience import PATIENCE_S

from rtctl.client import RigClient
from rtctl.errors import NoReplyError
from rtctl.wire.keys import KeyStore
from rtctl.wire.openings import Openings
from rtctl.wire.protocol import ROLES


@contextlib.contextmanager
def short_folder():
    """A folder whose path leaves room for the names of sockets."""
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        yield Path(folder)


def stocked(root):
    """A store with a key of every role; the secret ones are in `root`."""
    store = KeyStore(root / "keys")
    for role in ROLES:
        store.new(f"the-{role}", role, root / f"{role}.key")
    return store


def listening(root, store, port):
    """A rig on the four ports from `port` on."""
    return FakeRig(root, openings=Openings("127.0.0.1", port, store.folder, port + 3))


@contextlib.contextmanager
def clients(root, port):
    """Connects a client of some role; all are closed at the end."""
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


TRY_S = 5.0
"""Long enough for a new connection of a loaded machine, after which it is tried again."""


def answers(rig_client, state="IDLE"):
    try:
        return rig_client.status()["state"] == state
    except NoReplyError:
        return False
