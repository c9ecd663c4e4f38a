"""A door that cannot be opened again: tried for as long as that lasts, at no cost in descriptors."""

import errno
import tempfile
from pathlib import Path

import zmq
from patience import until
from ports import free_ports

from rtctl.wire.entrances import Access
from rtctl.wire.openings import Openings
from rtctl.wire.protocol import Endpoints


def test_a_door_that_cannot_be_opened_keeps_no_descriptor(monkeypatch):
    def refused():
        raise zmq.ZMQError(errno.EMFILE)

    def held():
        return len(list(Path("/proc/self/fd").iterdir()))

    with tempfile.TemporaryDirectory(prefix="rt") as folder, zmq.Context() as context:
        endpoints = Endpoints(f"ipc://{folder}/t", f"ipc://{folder}/c", f"ipc://{folder}/x")
        access = Access(context, endpoints, Openings(viewer_port=free_ports()), lambda *_: None)
        (door,) = access.viewers({})
        with monkeypatch.context() as broken:
            broken.setattr("rtctl.wire.sockets.private_umask", refused)
            before = held()  # of an open door
            door.cut()
            for _ in range(50):
                door.reopen()
                assert not door.is_open
            until(lambda: held() <= before, "as many descriptors as before")  # libzmq closes its own later
        door.reopen()
        assert door.is_open
        access.close()
