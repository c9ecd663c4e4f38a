import tempfile
import time

import msgpack
import pytest
from gateway_desk import GatewayDesk

from rtctl.control.vocabulary import Environment, State
from rtctl.host.exchange.gateway import BURST
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription

BOUNDS = {"position_rad": (-3.0, 3.0), "velocity_rad_s": (-20.0, 20.0)}
RIG = RigDescription("mock", (AxisDescription("a", BOUNDS),), 1000.0)


class Desk(GatewayDesk):
    def __init__(self, folder):
        self.now_s = 50.0
        super().__init__(folder, RIG, State.ACTIVE, clock_s=lambda: self.now_s)
        self.writer.command["environment_kind"] = Environment.REMOTE
        self.command = self.open()

    def renderer(self, **options):
        return self.open("targets", **options)

    def ask(self, op, **keys):
        self.command.send(msgpack.packb({"id": 1, "op": op, **keys}))
        while not self.command.poll(0):
            self.turn()
        return msgpack.unpackb(self.command.recv())

    def serve(self, received):
        """Serve until `received` targets have come in; what was counted of them."""
        counters = self.gateway.inbox.counters
        self.until_received(counters, received, "targets")
        return counters


@pytest.fixture
def desk():
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        made = Desk(folder)
        yield made
        made.close()


def target(lease, position=0.5, epoch=3, **more):
    return msgpack.packb({"lease": lease, "epoch": epoch, "position_rad": [position], **more})


def test_of_what_waits_only_the_newest_reaches_the_loop(desk):
    lease = desk.ask("lease", epoch=3)["result"]["lease"]
    renderer = desk.renderer()
    renderer.send(target(lease, -1.0))
    desk.serve(1)
    before = int(desk.memory.header[0]["mailbox_seq"])
    for burst in range(1, 11):  # how many of a burst wait at the first turn is up to libzmq's thread
        for i in range(20):
            renderer.send(target(lease, i / 20))
        time.sleep(0.1)
        counters = desk.serve(20 * burst + 1)
        assert desk.writer.command["target_position_rad"][0][0] == 19 / 20
        assert counters.accepted == int(desk.memory.header[0]["mailbox_seq"]) - before + 1
        assert counters.accepted + counters.superseded == 20 * burst + 1
        if counters.superseded > 5:
            break
    assert counters.superseded > 5


def test_junk_of_one_client_neither_hides_nor_delays_the_target_of_another(desk):
    lease = desk.ask("lease", epoch=3)["result"]["lease"]
    junk, renderer = desk.renderer(), desk.renderer()
    for _ in range(50):
        junk.send(b"\xc1junk")
    renderer.send(target(lease, 0.75))
    desk.serve(51)
    assert desk.writer.command["target_position_rad"][0][0] == 0.75


@pytest.mark.parametrize(
    "bad",
    [
        lambda lease: [target("0" * 16)],
        lambda lease: [target(lease, epoch=2)],
        lambda lease: [target(lease, float("nan"))],
        lambda lease: [target(lease, 3.5)],
        lambda lease: [target(lease, velocity_rad_s=[float("inf")])],
        lambda lease: [target(lease, gain=3)],
        lambda lease: [b""],
        lambda lease: [b"", target(lease)],
        lambda lease: [target(lease), target(lease)],
        lambda lease: [msgpack.packb({"id": 1, "op": "stop"})],
        lambda lease: [b"\xdd\x05\xf5\xe1\x00" + b"\x01" * 38],
    ],
)
def test_what_is_no_valid_target_of_the_holder_changes_a_counter_and_nothing_else(desk, bad):
    lease = desk.ask("lease", epoch=3)["result"]["lease"]
    before, seq = desk.writer.command.tobytes(), int(desk.memory.header[0]["mailbox_seq"])
    desk.renderer().send_multipart(bad(lease))
    counters = desk.serve(1)
    assert (counters.accepted, counters.refused) == (0, 1)
    assert desk.writer.command.tobytes() == before
    assert desk.memory.header[0]["mailbox_seq"] == seq


def test_nothing_sent_before_a_stop_moves_the_rig_after_it(desk):
    lease = desk.ask("lease", epoch=3)["result"]["lease"]
    renderer = desk.renderer()
    renderer.send(target(lease, 0.1))
    desk.serve(1)
    renderer.send(target(lease, 0.9))
    time.sleep(0.05)
    seq = desk.ask("stop")["result"]["command_seq"]
    count = int(desk.writer.command["target_count"][0])
    renderer.send(target(lease, 0.8))
    desk.serve(3)
    desk.row["epoch"], desk.row["command_seq"] = 4, seq
    renderer.send(target(lease, 0.7))
    renderer.send(target(lease, 0.6, epoch=4))
    desk.serve(5)
    assert int(desk.writer.command["target_count"][0]) == count
    assert int(desk.writer.command["epoch"][0]) == -1, "an arm request still in the slot is void"


def test_more_than_twice_the_loops_rate_is_dropped_and_counted(desk):
    lease = desk.ask("lease", epoch=3)["result"]["lease"]
    renderer = desk.renderer()
    for i in range(BURST + 40):
        renderer.send(target(lease))
        desk.serve(i + 1)
    counters = desk.gateway.inbox.counters
    assert counters.accepted + counters.superseded == BURST
    assert counters.refused == 40
    desk.now_s += 0.01
    renderer.send(target(lease))
    assert desk.serve(BURST + 41).refused == 40


def test_requests_beyond_the_rate_are_refused_but_never_a_stop(desk):
    for _ in range(BURST):
        assert desk.ask("hello")["ok"]
    assert desk.ask("hello")["error"]["code"] == "too_fast"
    assert desk.ask("stop")["ok"]
    assert desk.gateway.counters.limited == 1
    desk.now_s += 1
    assert desk.ask("hello")["ok"]


def test_a_client_that_was_halted_is_told_that_it_lost_the_lease(desk):
    clock = desk.gateway._requests._desk
    lease = desk.ask("lease", epoch=3)["result"]["lease"]
    clock._until_s = -1.0  # its holder was silent for too long
    lost = desk.ask("target", epoch=3, lease=lease, position_rad=[0.1])
    assert (lost["ok"], lost["error"]["code"]) == (False, "lease_lost")
    assert "silent" in lost["error"]["text"]
    assert desk.ask("status")["result"]["lease_holder"] is None
    assert desk.ask("lease", epoch=3)["ok"]
