"""A daemon that is started anew: nothing that a client knew of the one before moves the rig."""

import msgpack
import pytest
import zmq
from test_force_zero_of_a_run import rig as rig  # the mock in simulated time

from rtctl.control.vocabulary import State
from rtctl.host.supervisor import Host
from rtctl.rig_file.config import load
from rtctl.wire.protocol import endpoints_in

pytestmark = pytest.mark.compiled


def test_what_a_client_knows_of_a_daemon_that_ended_is_void_with_the_next_one(rig):
    """A client that neither gives the tick of its decision nor closes its socket."""
    epochs, replies, states = [], [], set()
    context = zmq.Context()
    socket = context.socket(zmq.DEALER)
    socket.connect(endpoints_in(rig.parent / "run" / "mock").command)

    def remember(host, rows):
        if len(rows):
            epochs.append(int(rows["epoch"][-1]))
            host.finish()

    def late(host, rows):
        states.update(rows["state"].tolist())
        if len(rows) and rows["tick"][-1] > 1000 and "sent" not in states:
            states.add("sent")
            for op in ("arm", "lease", "environment"):
                keys = {"axis": 0, "kind": "free"} if op == "environment" else {}
                socket.send(msgpack.packb({"id": 1, "op": op, "epoch": epochs[0], **keys}))
        while socket.poll(0):
            replies.append(msgpack.unpackb(socket.recv())["error"]["code"])
        if len(replies) == 3:
            host.finish()

    try:
        for observer in (remember, late):
            with Host(load(rig), observers=[observer], runtime_dir=str(rig.parent / "run")) as host:
                host.run(60.0)
    finally:
        context.destroy(linger=0)
    assert replies == ["wrong_epoch"] * 3
    assert State.ARMING not in states


def test_two_daemons_seldom_begin_in_the_same_epoch(rig):
    seen = set()
    for _ in range(2):
        with Host(load(rig), runtime_dir=str(rig.parent / "run")) as host:
            seen.add(int(host.writer.command["epoch"][0]))
            host.run(0.05)
    assert len(seen) == 2
    assert min(seen) > 0
