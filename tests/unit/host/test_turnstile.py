"""Connections are let into a socket of libzmq a few at a time, by the kernel and not by who is quicker."""

import tempfile
import time

import pytest
import zmq
from patience import until
from ports import free_ports

from rtctl.wire.connections import Connections
from rtctl.wire.turnstile import Turnstile
from tests.bench.attacker import plain

WAITING = 12


@pytest.fixture(params=["ipc", "tcp"])
def door(request):
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        context = zmq.Context()
        router = context.socket(zmq.ROUTER)
        router.setsockopt(zmq.LINGER, 0)
        seen = Connections(context, router)
        address = f"ipc://{folder}/d" if request.param == "ipc" else f"tcp://127.0.0.1:{free_ports()}"
        router.bind(address)
        made = []
        yield address, router, seen, made
        for one in made:
            one.close()
        seen.close()
        router.close()
        context.term()


def inside(seen):
    seen.take()
    return len(seen.descriptors())


def set_up(address, seen, made):
    """A turnstile in place. It lets one in: what it is armed with at first."""
    gate = Turnstile(address)
    until(lambda: (gate.let_in(1), gate.is_set)[1], "libzmq to wait for connections")
    made.append(plain(address))
    until(lambda: inside(seen) == 1, "the first one")
    return gate


def test_of_those_who_wait_no_more_come_in_than_are_let_in(door):
    address, _, seen, made = door
    gate = set_up(address, seen, made)
    made += [plain(address) for _ in range(WAITING)]
    time.sleep(0.2)
    assert inside(seen) == 1, "nobody comes in by himself"
    for count in range(2, WAITING + 2):
        gate.let_in(1)
        until(lambda count=count: inside(seen) >= count, "the next one")
        time.sleep(0.01)
        assert inside(seen) == count


def test_of_some_that_are_let_in_at_once_no_more_come_in(door):
    address, _, seen, made = door
    gate = set_up(address, seen, made)
    made += [plain(address) for _ in range(WAITING)]
    gate.let_in(5)
    until(lambda: inside(seen) > 1, "some of them")
    time.sleep(0.1)
    assert inside(seen) <= 6


def test_whoever_was_let_in_is_heard(door):
    address, router, seen, made = door
    gate = set_up(address, seen, made)
    client = zmq.Context.instance().socket(zmq.DEALER)
    try:
        client.setsockopt(zmq.LINGER, 0)
        client.connect(address)
        client.send(b"hello")
        until(lambda: (gate.let_in(1), router.poll(10))[1], "its word")
        assert router.recv_multipart()[-1] == b"hello"
    finally:
        client.close()


def test_an_address_at_which_nobody_listens_has_no_turnstile():
    gate = Turnstile("tcp://127.0.0.1:1")
    gate.let_in(3)
    assert not gate.is_set
