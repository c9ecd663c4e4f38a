import tempfile
import time

import msgpack
import pytest
import zmq
from patience import PATIENCE_S, until

from rtctl.control.vocabulary import State
from rtctl.host.commands.gateway import REQUESTS_PER_CALL, Gateway
from rtctl.host.telemetry.rig_description import AxisDescription, RigDescription
from rtctl.rt.shared_memory import CommandWriter, Memory
from rtctl.tick import new_ticks
from rtctl.wire.protocol import Endpoints

RIG = RigDescription("mock", (AxisDescription("a", {}),), 1000.0)


class Desk:
    def __init__(self, folder):
        self.context = zmq.Context()
        self.endpoints = Endpoints(f"ipc://{folder}/t", f"ipc://{folder}/c", f"ipc://{folder}/x")
        self.memory = Memory.create(1, 8, 1_000_000)
        self.writer = CommandWriter(self.memory)
        self.row = new_ticks(1, 1)
        self.row["time_ns"], self.row["state"], self.row["epoch"] = time.monotonic_ns(), State.IDLE, 3
        self.gateway = Gateway(self.context, self.endpoints, self.writer, RIG, lambda: self.row)
        self.poller = zmq.Poller()
        self.gateway.register(self.poller)
        self.sockets = []

    def client(self, kind=zmq.DEALER):
        socket = self.context.socket(kind)
        socket.setsockopt(zmq.LINGER, 0)
        socket.connect(self.endpoints.command)
        self.sockets.append(socket)
        return socket

    def serve(self, received):
        """Serve until `received` messages have come in."""
        until(lambda: self._turn() or self.gateway.counters.received >= received, "messages")
        assert self.gateway.counters.received == received

    def _turn(self):
        self.poller.poll(20)
        self.gateway.serve()

    def close(self):
        for socket in self.sockets:
            socket.close(linger=0)
        self.gateway.close()
        self.context.term()
        self.memory.close()


@pytest.fixture
def desk():
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        made = Desk(folder)
        yield made
        made.close()


def reply(socket, wait_ms=PATIENCE_S * 1000):
    return (
        [msgpack.unpackb(part) if part else part for part in socket.recv_multipart()]
        if socket.poll(wait_ms)
        else None
    )


def test_dealer_and_req_clients_are_answered_in_their_own_framing(desk):
    dealer, req = desk.client(), desk.client(zmq.REQ)
    dealer.send(msgpack.packb({"id": 1, "op": "hello"}))
    req.send(msgpack.packb({"id": "r", "op": "hello"}))
    desk.serve(2)
    (from_dealer,) = reply(dealer)
    (from_req,) = reply(req)
    assert (from_dealer["id"], from_req["id"]) == (1, "r")
    dealer.send_multipart([b"", msgpack.packb({"id": 2, "op": "hello"})])
    desk.serve(3)
    delimiter, enveloped = reply(dealer)
    assert (delimiter, enveloped["id"]) == (b"", 2)


def test_every_reply_tells_id_operation_state_and_epoch(desk):
    client = desk.client()
    client.send(msgpack.packb({"id": 5, "op": "stop"}))
    client.send(msgpack.packb({"id": 6, "op": "reset"}))
    desk.serve(2)
    assert reply(client) == [
        {"id": 5, "op": "stop", "ok": True, "state": "IDLE", "epoch": 3, "result": {"command_seq": 1}}
    ]
    (refused,) = reply(client)
    assert (refused["id"], refused["op"], refused["ok"], refused["state"], refused["epoch"]) == (
        6,
        "reset",
        False,
        "IDLE",
        3,
    )
    assert refused["error"]["code"] == "not_ready"


def test_malformed_messages_change_a_counter_and_nothing_else(desk):
    client = desk.client()
    good = msgpack.packb({"id": 1, "op": "stop"})
    bad = [[b""], [b"\xc1"], [good, good], [b"", good, good], [b"", b"", good], [good[:-1]], [b"x" * 4096]]
    for frames in bad:
        client.send_multipart(frames)
    desk.serve(len(bad))
    assert reply(client, 50) is None
    counters = desk.gateway.counters
    assert (counters.received, counters.malformed) == (len(bad), len(bad))
    assert (counters.accepted, counters.refused, counters.replies_lost) == (0, 0, 0)
    assert desk.memory.header[0]["mailbox_seq"] == 0


def test_a_frame_above_the_limit_never_reaches_the_gateway_and_others_are_served(desk):
    bad, good = desk.client(), desk.client()
    bad.send(b"x" * 4097)
    time.sleep(0.1)
    good.send(msgpack.packb({"id": 1, "op": "hello"}))
    desk.serve(1)
    assert reply(good)[0]["ok"] is True


def test_one_turn_handles_a_bounded_number_of_requests_and_tells_that_more_wait(desk):
    clients = [desk.client() for _ in range(8)]  # as many as one process may have
    turns = []
    for burst in range(20):  # how many of a burst have arrived at the first turn is up to libzmq's thread
        for client in clients:
            for i in range(7):
                client.send(msgpack.packb({"id": i, "op": "status"}))
        while desk.gateway.counters.received < 56 * (burst + 1):
            assert desk.poller.poll(PATIENCE_S * 1000)
            before = desk.gateway.counters.received
            turns.append((desk.gateway.serve(), desk.gateway.counters.received - before))
        assert all(reply(client)[0]["id"] == i for client in clients for i in range(7))
        if (True, REQUESTS_PER_CALL) in turns:
            break
    assert all(handled <= REQUESTS_PER_CALL for _, handled in turns)
    assert all(more is (handled == REQUESTS_PER_CALL) for more, handled in turns)
    assert (True, REQUESTS_PER_CALL) in turns


def test_a_client_that_never_reads_costs_lost_replies_only(desk):
    deaf = desk.client()
    deaf.setsockopt(zmq.RCVHWM, 1)
    deaf.send(msgpack.packb({"id": 0, "op": "hello"}))
    desk.serve(1)
    deaf.send(msgpack.packb({"id": 1, "op": "stop"}))
    desk.gateway.socket.poll(PATIENCE_S * 1000)
    deaf.close(linger=0)
    desk.sockets.remove(deaf)
    time.sleep(0.1)
    desk.serve(2)
    assert desk.memory.header[0]["mailbox_seq"] == 1


def test_a_message_without_an_id_is_not_answered(desk):
    client = desk.client()
    client.send(msgpack.packb({"op": "stop"}))
    client.send(msgpack.packb({"id": 2, "op": "hello"}))
    desk.serve(2)
    assert reply(client)[0]["id"] == 2
    assert desk.memory.header[0]["mailbox_seq"] == 0
