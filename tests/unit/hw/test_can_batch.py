"""All waiting frames in one call, tried on a pair of local datagram sockets: this kernel may have no CAN."""

import errno
import gc
import socket
import threading
import time

import can
import pytest

from hw.can.adapter import AdapterBus
from hw.can.batch import FRAMES, STRIDE, Batch
from hw.can.bus import DRAIN_LIMIT
from hw.interface import LinkLost


@pytest.fixture
def pair():
    near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    far.setblocking(False)
    yield near, far
    near.close()
    far.close()


def frames(batch, n, length=16):
    return [bytes(batch.buffer[k * STRIDE : k * STRIDE + length]) for k in range(n)]


def test_every_waiting_frame_arrives_in_order_and_then_none(pair):
    near, far = pair
    batch = Batch(far.fileno())
    assert batch.take() == 0
    sent = [bytes([k]) * 16 for k in range(5)]
    for one in sent:
        near.send(one)
    assert batch.take() == 5
    assert frames(batch, 5) == sent
    assert batch.take() == 0


def test_more_than_fit_come_with_the_next_call(pair):
    near, far = pair
    near.setblocking(False)
    batch, sent, got = Batch(far.fileno()), [], []
    while len(sent) < FRAMES + 3:
        try:
            near.send(bytes([len(sent)]) * STRIDE)
        except BlockingIOError:  # the kernel holds fewer: take some first
            got += frames(batch, batch.take(), STRIDE)
        else:
            sent.append(bytes([len(sent)]) * STRIDE)
    while n := batch.take():
        got += frames(batch, n, STRIDE)
    assert got == sent


def test_the_buffer_outlives_a_collection(pair):
    near, far = pair
    batch = Batch(far.fileno())
    gc.collect()
    near.send(b"x" * 72)
    assert batch.take() == 1
    assert frames(batch, 1, 72) == [b"x" * 72]


def test_a_descriptor_that_is_gone_is_an_error_and_never_anothers(pair):
    near, far = pair
    batch = Batch(far.fileno())
    batch.close()
    near.send(b"x")
    with pytest.raises(OSError) as gone:
        batch.take()
    assert gone.value.errno == errno.EBADF


def _virtual(channel: str, **arguments: object) -> AdapterBus:
    options = {"interface": "virtual", "channel": channel, "bitrate": 1_000_000, "fd": True}
    return AdapterBus({**options, "arguments": arguments})


@pytest.mark.parametrize("can_id", [0x123, 0x8000_0055, 0x4000_0123])
def test_peers_on_the_in_process_bus_receive_what_python_can_would_send_and_each_its_own(can_id):
    bus = _virtual("copied")
    frame = bus.outgoing(can_id, 4)
    frame.buffer[:] = b"abcd" if frame.buffer else b""
    with (
        can.Bus(interface="virtual", channel="copied", ignore_config=True) as near,
        can.Bus(interface="virtual", channel="copied", ignore_config=True) as far,
    ):
        began = 1e-9 * time.time_ns()
        assert bus.send(frame)
        bus.fresh_python_can().send(frame.message)
        ours, theirs = near.recv(0), near.recv(0)
        assert bus.receive()  # its own frame does not come back
        first = far.recv(0)
    slots = [name for name in can.Message.__slots__ if name not in {"__weakref__", "timestamp"}]
    assert {name: getattr(ours, name) for name in slots} == {name: getattr(theirs, name) for name in slots}
    assert began - 1 <= ours.timestamp <= theirs.timestamp
    frame.buffer[:] = b"efgh" if frame.buffer else b""
    first.data[:] = b""
    assert ours.data == theirs.data
    bus.close()


@pytest.mark.parametrize("arguments", [{"receive_own_messages": True}, {"preserve_timestamps": True}])
def test_an_in_process_bus_that_is_asked_for_more_is_left_to_python_can(arguments):
    bus, seen = _virtual("asked", **arguments), []
    bus.subscribe({7: lambda data, _offset, length: seen.append(length)})
    with can.Bus(interface="virtual", channel="asked", ignore_config=True) as peer:
        assert bus.send(bus.outgoing(7, 4))
        assert (peer.recv(0).timestamp == 0.0) == ("preserve_timestamps" in arguments)
    assert bus.receive()
    assert seen == [4] * ("receive_own_messages" in arguments)
    bus.close()


def test_a_peer_without_room_is_told_as_python_can_tells_it():
    bus = _virtual("full")
    with can.Bus(interface="virtual", channel="full", rx_queue_size=1, ignore_config=True):
        frame = bus.outgoing(7, 4)
        assert bus.send(frame)
        with pytest.raises(LinkLost, match="no room"):
            bus.send(frame)
    bus.close()


@pytest.mark.parametrize("interface", ["virtual", "another"])
def test_a_backlog_is_taken_in_bounded_cycles_and_told(monkeypatch, interface):
    """Whether the interface can say how much waits, as the in-process bus can, or not."""
    made = can.Bus(interface="virtual", channel="backlog", ignore_config=True)
    monkeypatch.setattr(can, "Bus", lambda **_: made)
    bus = AdapterBus(
        {"interface": interface, "channel": "backlog", "bitrate": 1_000_000, "fd": False, "arguments": {}}
    )
    seen = []
    bus.subscribe({7: lambda data, _offset, length: seen.append(data[0])})
    with type(made)(channel="backlog") as peer:
        for k in range(DRAIN_LIMIT + 3):
            peer.send(can.Message(arbitration_id=7, data=[k % 256], is_extended_id=False))
    assert (bus.receive(), len(seen)) == (False, DRAIN_LIMIT)
    assert (bus.receive(), len(seen)) == (True, DRAIN_LIMIT + 3)
    assert seen == [k % 256 for k in range(DRAIN_LIMIT + 3)]
    assert (bus.receive(), len(seen)) == (True, DRAIN_LIMIT + 3)
    bus.close()


def test_who_waits_for_room_in_a_bounded_in_process_bus_goes_on_when_a_frame_was_taken():
    options = {"interface": "virtual", "channel": "bounded", "bitrate": 1_000_000, "fd": False}
    bus = AdapterBus({**options, "arguments": {"rx_queue_size": 1}})
    queue, seen = bus.fresh_python_can().queue, []
    bus.subscribe({7: lambda data, _offset, length: seen.append(data[0])})
    with can.Bus(interface="virtual", channel="bounded", ignore_config=True) as peer:
        first, second = (can.Message(arbitration_id=7, data=[k], is_extended_id=False) for k in range(2))
        peer.send(first)
        sender = threading.Thread(target=peer.send, args=(second, 60.0))
        sender.start()
        while not queue.not_full._waiters and sender.is_alive():
            time.sleep(1e-3)
        assert bus.receive()
        sender.join(20.0)
        assert not sender.is_alive()
        assert bus.receive()
    assert seen == [0, 1]
    bus.close()
