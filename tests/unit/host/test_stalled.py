"""Whoever takes nothing of what a door sends is cut; whoever takes little, or has nothing to take, is not."""

import contextlib
import socket
import tempfile

import pytest
from patience import PATIENCE_S, until
from test_intruders import House

from rtctl.host.exchange.publisher import Publisher, options
from rtctl.wire import intruders
from rtctl.wire.protocol import TOPIC_STATE
from rtctl.wire.stalled import STALLED_S

SUBSCRIPTION = b"\x00\x0c\x01" + TOPIC_STATE
TURN_S = 0.6
MUCH = bytes(1 << 20)


@pytest.fixture
def house():
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        made = House(folder, port)
        yield made
        made.close()


def subscriber(house, door):
    one = house.enter(door.address, socket_type=b"SUB")
    one.sendall(SUBSCRIPTION)
    one.setblocking(False)
    return one


def heard(one):
    """Some of what waits for it."""
    with contextlib.suppress(BlockingIOError):
        return len(one.recv(len(MUCH)))
    return 0


def full(house, door, *deaf):
    """A publisher that has sent more than the kernel keeps for those who are deaf."""
    publisher = Publisher(door, [TOPIC_STATE])
    until(lambda: publisher.send(TOPIC_STATE, b"") and all(map(heard, deaf)), "their subscriptions")
    for _ in range(16):
        publisher.send(TOPIC_STATE, MUCH)
    return publisher


@pytest.mark.parametrize("by", ["ipc", "tcp"])
def test_a_subscriber_that_takes_nothing_is_cut_and_one_that_takes_little_or_has_nothing_stays(house, by):
    door = house.viewer if by == "tcp" else house.access.publishers(options(1000))[0]
    idle = house.enter(door.address, socket_type=b"SUB")
    deaf, slow = subscriber(house, door), subscriber(house, door)
    publisher, began_s = full(house, door, deaf, slow), house.now_s

    def turn():
        heard(slow)
        publisher.send(TOPIC_STATE, b"on")
        house.turn(TURN_S)

    until(lambda: (turn(), "stalled" in house.kinds())[1], "its end")
    assert house.now_s - began_s >= STALLED_S
    until(lambda: (turn(), len(door.connections.descriptors()) == 2)[1], "what libzmq kept for it")
    for _ in range(round(2 * STALLED_S / TURN_S)):
        until(lambda: heard(slow), "more for who takes little")
        house.turn(TURN_S)
        publisher.send(TOPIC_STATE, MUCH)
    assert [kind for kind, _text in house.notices] == ["stalled"]
    assert not house.is_cut(idle)
    deaf.settimeout(PATIENCE_S)
    with contextlib.suppress(ConnectionError):
        while deaf.recv(1 << 20):
            pass


def test_while_memory_grows_who_takes_nothing_goes_before_anybody_is_suspected(house):
    quiet = house.enter(house.command.address)
    full(house, house.viewer, subscriber(house, house.viewer))
    (one,) = house.viewer.connections.descriptors()

    def stood_s():
        house.turn(TURN_S / 10)
        return house.now_s - house.viewer.stalled._since.get(one, (0, house.now_s))[1]

    # long enough for libzmq to have given the kernel all that it takes, also on a busy machine
    until(lambda: stood_s() > STALLED_S / 3, "its standstill")
    assert not house.kinds()
    house.memory += 2 * intruders.GROWTH_BYTES
    house.turn()
    assert house.kinds() == {"stalled"}
    assert not house.is_cut(quiet)
