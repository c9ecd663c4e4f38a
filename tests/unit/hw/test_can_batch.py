"""All waiting frames in one call, tried on a pair of local datagram sockets: this kernel may have no CAN."""

import copy
import errno
import gc
import socket
import threading
import time

import can
import pytest

from hw.can.adapter import AdapterBus, AdapterFrame
from hw.can.batch import FRAMES, STRIDE, Batch
from hw.can.bus import DRAIN_LIMIT


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


@pytest.mark.parametrize(("can_id", "extended"), [(0x123, False), (0x8000_0055, True)])
def test_a_frame_of_python_cans_is_copied_whole_and_apart(can_id, extended):
    frame = AdapterFrame(can_id, 4, fd=True)
    frame.buffer[:] = b"abcd"
    copied = copy.deepcopy(frame.message)
    frame.buffer[:] = b"efgh"
    assert bytes(copied.data) == b"abcd"
    assert (copied.arbitration_id, copied.is_extended_id, copied.dlc) == (can_id & 0x1FFF_FFFF, extended, 4)
    assert copied.is_fd
    assert copied.bitrate_switch
    assert not copied.is_remote_frame
    slots = [name for name in can.Message.__slots__ if name != "__weakref__"]
    as_made = can.Message(
        arbitration_id=can_id & 0x1FFF_FFFF,
        is_extended_id=extended,
        is_fd=True,
        bitrate_switch=True,
        data=b"abcd",
    )
    assert {name: getattr(copied, name) for name in slots} == {name: getattr(as_made, name) for name in slots}


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
