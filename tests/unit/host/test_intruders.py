import contextlib
import errno
import mmap
import os
import resource
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
import zmq
from patience import PATIENCE_S, until
from ports import free_ports

from rtctl.errors import RtctlError
from rtctl.host.exchange.publisher import Publisher
from rtctl.wire import connections, traffic
from rtctl.wire import entrances as access_module
from rtctl.wire import intruders as module
from rtctl.wire.authenticator import PAUSE_S
from rtctl.wire.entrances import Access
from rtctl.wire.openings import Openings
from rtctl.wire.protocol import CONNECTIONS, TOPIC_STATE, Endpoints
from rtctl.wire.sockets import Door
from rtctl.wire.spare_descriptors import RESERVE, Reserve
from tests.bench.attacker import connect, plain

MORE = b"\x01\x00"


class House:
    """Doors for requests (ipc) and viewers (TCP); its clock and its memory are the test's."""

    def __init__(self, folder, port=0):
        self.context, self.notices = zmq.Context(), []
        self.now_s, self.memory = 100.0, 200 << 20
        self.endpoints = Endpoints(f"ipc://{folder}/t", f"ipc://{folder}/c", f"ipc://{folder}/x")
        self.access = Access(
            self.context,
            self.endpoints,
            Openings(viewer_port=port),
            lambda *notice: self.notices.append(notice),
            clock_s=lambda: self.now_s,
            resident=lambda: self.memory,
        )
        (self.command,) = self.access.routers("command", 0, {zmq.RCVHWM: 8})
        (self.viewer,) = self.access.viewers({zmq.RCVHWM: 64})
        self.open = []

    def enter(self, address, patience_s=PATIENCE_S, **more):
        """A stranger that greets, with the host taking its turns meanwhile."""
        with ThreadPoolExecutor(1) as pool:
            entering = pool.submit(connect, address, patience_s=patience_s, **more)
            while not entering.done():
                self.turn()
                time.sleep(0.005)
        self.open.append(entering.result())
        return self.open[-1]

    def turn(self, seconds=0.01):
        self.now_s += seconds
        self.access.authenticator.serve()
        self.access.look()

    def kinds(self):
        return {kind for kind, _text in self.notices}

    def is_cut(self, one):
        """Whether the host has hung up on a connection."""
        self.turn()
        one.settimeout(0.01)
        try:
            return one.recv(65536) == b""
        except TimeoutError:
            return False
        except OSError:
            return True

    def close(self):
        for one in self.open:
            one.close()
        self.access.close()
        self.context.term()


@pytest.fixture
def house():
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        made = House(folder, free_ports())
        yield made
        made.close()


def test_a_viewer_that_sends_a_message_without_an_end_is_cut_off_and_the_others_stay(house):
    other = house.enter(house.viewer.address, socket_type=b"SUB")
    one = house.enter(house.viewer.address, socket_type=b"SUB")
    one.sendall(MORE * traffic.LISTENER_BYTES)
    until(lambda: house.is_cut(one), "its end")
    assert "expelled" in house.kinds()
    assert not house.is_cut(other)
    # until libzmq has let go of it, every look bans it anew
    until(lambda: (house.turn(), len(house.viewer.connections.descriptors()) == 1)[1], "its descriptor's end")
    house.turn(PAUSE_S)
    late = house.enter(house.viewer.address, socket_type=b"SUB")
    assert not house.is_cut(late)


@pytest.mark.parametrize("sent", [b"\x01no such topic %d", b"\x07not a subscription %d"])
def test_a_viewer_that_asks_for_what_there_is_not_is_cut_off_and_the_others_hear_on(house, sent):
    publisher = Publisher(house.viewer, [TOPIC_STATE], house.access.expeller(house.viewer))
    other = house.enter(house.viewer.address, socket_type=b"SUB")
    one = house.enter(house.viewer.address, socket_type=b"SUB")
    other.sendall(b"\x00\x0c\x01rtctl/state")
    wrong = [sent % number for number in range(100)]
    one.sendall(b"".join(bytes([0, len(data)]) + data for data in wrong))

    def publish():
        publisher.send(TOPIC_STATE, b"a sample")
        return house.is_cut(one)

    until(publish, "its end")
    for _ in range(20):  # what it sent before is read away, and nobody is expelled for it
        publish()
    assert [kind for kind, _text in house.notices] == ["expelled"]
    house.notices.clear()
    assert house.viewer.openings == 1
    other.settimeout(PATIENCE_S)
    assert b"a sample" in other.recv(65536)


def test_a_viewer_that_only_listens_stays_for_ever(house):
    one = house.enter(house.viewer.address, socket_type=b"SUB")
    one.sendall(b"\x00\x0c\x01rtctl/state")
    for _ in range(50):
        one.sendall(b"\x04\x07\x04PING\x00\x00")
        house.turn(60.0)
    assert not house.is_cut(one)
    assert "expelled" not in house.kinds()


def test_a_slow_message_without_an_end_is_seen_too(house):
    one = house.enter(house.viewer.address, socket_type=b"SUB")

    def cut():
        with contextlib.suppress(OSError):
            one.send(MORE * 2048)
        return house.is_cut(one)

    until(cut, "its end")


def test_when_memory_grows_a_local_flood_is_expelled_and_a_quiet_client_is_not(house):
    quiet, flood = house.enter(house.command.address), house.enter(house.command.address)
    flood.setblocking(False)
    house.turn()
    house.memory += 2 * module.GROWTH_BYTES

    def flooded():
        with contextlib.suppress(OSError):
            while True:
                flood.send(MORE * 100_000)
        return house.is_cut(flood)

    until(flooded, "its end")
    assert "memory" not in house.kinds(), "all local clients were cut off"
    assert not house.is_cut(quiet)


def test_when_memory_goes_on_growing_without_a_flood_local_clients_are_cut_off_then_all_then_the_host(house):
    quiet = house.enter(house.command.address)
    viewer = house.enter(house.viewer.address, socket_type=b"SUB")
    house.turn()
    house.memory += 2 * module.GROWTH_BYTES
    for _ in range(20):
        house.turn()
    assert not house.is_cut(quiet), "memory grew no more"
    house.memory += module.STEP_BYTES
    until(lambda: house.is_cut(quiet), "the end of the local one")
    assert not house.is_cut(viewer)
    house.memory += module.STEP_BYTES
    until(lambda: house.is_cut(viewer), "the end of all")
    opened = house.command.openings
    for _ in range(8):
        house.memory += module.STEP_BYTES
        house.turn(5.0)
    assert house.command.openings == opened, "it goes on cutting"


def test_what_an_observer_of_the_host_collects_slowly_is_no_attack(house):
    quiet = house.enter(house.command.address)
    for _ in range(200):
        house.memory += 1 << 20
        house.turn(1.0)
    assert not house.is_cut(quiet)
    assert not {"memory", "expelled"} & house.kinds()


def test_of_a_crowd_the_silent_go_and_no_more_stay_than_there_is_room_for(house, monkeypatch):
    monkeypatch.setattr(module, "STRANGERS", 8)
    spoke = house.enter(house.viewer.address, socket_type=b"SUB")
    silent = [plain(house.viewer.address) for _ in range(40)]
    house.open += silent
    until(
        lambda: (
            (house.turn(0.006), len(house.viewer.connections.strangers()) <= 8)[1]
            and "crowd" in house.kinds()
        )
    )
    assert not house.is_cut(spoke)


def test_of_a_local_crowd_whoever_was_let_in_stays(house, monkeypatch):
    monkeypatch.setattr(module, "STRANGERS", 0)
    known = house.enter(house.command.address)
    house.turn(0.006)
    assert "crowd" not in house.kinds(), "who was let in is no stranger"
    monkeypatch.setattr(module, "STRANGERS", 8)
    (first,) = house.command.connections.descriptors()
    true_peer = traffic.local_peer
    monkeypatch.setattr(module, "local_peer", lambda one: true_peer(one) if one == first else "ipc:0:0:1")
    house.open += [plain(house.command.address) for _ in range(40)]
    until(lambda: (house.turn(0.006), "crowd" in house.kinds())[1])
    assert not house.is_cut(known)


def test_one_process_gets_half_of_the_places_of_a_door(house, monkeypatch):
    for _ in range(CONNECTIONS // 2):
        house.enter(house.command.address)
    with pytest.raises(OSError):  # nobody answers, or hangs up
        house.enter(house.command.address, patience_s=2.0)
    monkeypatch.setattr(connections, "local_peer", lambda _descriptor: "ipc:0:0:1")  # another one comes
    house.enter(house.command.address)


@pytest.mark.parametrize(("may_open", "told"), [(8192, set()), (2048, {"descriptors"})])
def test_too_few_descriptors_for_a_crowd_are_told_with_the_remedy(monkeypatch, may_open, told):
    monkeypatch.setattr(access_module, "allow_descriptors", lambda _wanted: may_open)
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        made = House(folder)
        made.close()
    assert made.kinds() == told
    assert all("LimitNOFILE" in text for _kind, text in made.notices)


def test_too_few_descriptors_for_clients_are_refused(monkeypatch):
    """libzmq would end the process in the middle of the first connections."""
    monkeypatch.setattr(access_module, "allow_descriptors", lambda _wanted: 64)
    with (
        zmq.Context() as context,
        pytest.raises(RtctlError, match=r"only 64 files and sockets: raise .* LimitNOFILE"),
    ):
        Access(context, Endpoints("ipc://t", "ipc://c", "ipc://x"))


@pytest.mark.parametrize("kind", [OSError, zmq.ZMQError])
def test_a_door_that_cannot_be_opened_again_stays_shut_until_it_can(house, monkeypatch, kind):
    opened = Door._open

    def refuse(_door):
        raise kind(errno.EMFILE, os.strerror(errno.EMFILE))

    monkeypatch.setattr(Door, "_open", refuse)
    house.command.cut()
    assert not house.command.is_open
    house.turn()
    monkeypatch.setattr(Door, "_open", opened)
    house.turn(1.0)
    assert house.command.is_open
    house.enter(house.command.address)


def test_the_reserve_is_there_for_whom_it_is_lent_when_nothing_else_is():
    reserve = Reserve()
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    lowest = os.open(os.devnull, os.O_RDONLY)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(lowest + 1, 3), hard))
    try:
        with pytest.raises(OSError, match="Too many"):
            os.open(os.devnull, os.O_RDONLY)
        with reserve.lent():
            taken = [os.open(os.devnull, os.O_RDONLY) for _ in range(RESERVE)]
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    for one in (*taken, lowest):
        os.close(one)
    reserve.close()


def test_memory_that_others_fill_too_is_not_counted_and_what_the_process_has_alone_is():
    resident, size = module.Resident(), 64 << 20
    before = resident()
    with mmap.mmap(-1, size) as ring:  # shared, as the ring of ticks is
        ring.write(b"\1" * size)
        assert resident() - before < size // 4
        own = b"\1" * size
        assert resident() - before > size // 2
        assert len(own) == size
    resident.close()
