"""Our raw socket on a real kernel's CAN: filters, error frames, interfaces that go down, full queues.

Needs `vcan0` and `can0` wired to `can1`, and the right to change them: `make test-system` provides a virtual
machine that has them. Anywhere else these tests skip.
"""

import os
import select
import socket
import struct
import subprocess
from pathlib import Path

import pytest

from hw.can.bus import ERROR, EXTENDED, REMOTE, wait_for
from hw.can.raw import RawBus
from hw.interface import BackendError, LinkFault, LinkLost

pytestmark = pytest.mark.skipif(
    not Path("/sys/class/net/vcan0").exists() or os.geteuid() != 0,
    reason="needs the interfaces vcan0, can0, can1 and root: run `make test-system`",
)


def ip(*words):
    subprocess.run(["ip", *words], check=True, timeout=10)


@pytest.fixture
def link():
    """An interface that may be taken down or deleted."""
    ip("link", "add", "vcan9", "type", "vcan")
    ip("link", "set", "vcan9", "up")
    yield "vcan9"
    subprocess.run(["ip", "link", "del", "vcan9"], check=False, capture_output=True, timeout=10)


@pytest.fixture
def peer():
    made = []

    def _open(channel):
        sock = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        sock.bind((channel,))
        made.append(sock)
        return sock

    yield _open
    for sock in made:
        sock.close()


def frame(can_id, data=b""):
    return struct.pack("=IB3x8s", can_id, len(data), data)


def collect(bus, *ids):
    seen = []
    bus.subscribe(
        {
            i: lambda buffer, offset, length, i=i: seen.append((i, bytes(buffer[offset : offset + length])))
            for i in ids
        }
    )
    return seen


@pytest.mark.parametrize(("near", "far"), [("vcan0", "vcan0"), ("can0", "can1")])
def test_frames_arrive_in_order_and_only_those_asked_for(near, far, peer):
    bus, other = RawBus(near, fd=False), peer(far)
    seen = collect(bus, 0x101, 0x101 | EXTENDED)
    for k in range(20):  # one by one: the emulated controllers hold four frames and drop the rest
        other.send(frame(0x101, bytes([k])))
        other.send(frame(0x102, b"other"))
        assert wait_for(bus, lambda k=k: len(seen) == 2 * k + 1, 5.0)
        other.send(frame(0x101 | EXTENDED, bytes([k, k])))
        assert wait_for(bus, lambda k=k: len(seen) == 2 * k + 2, 5.0)
    assert [data[0] for _, data in seen] == [k for k in range(20) for _ in "ab"]
    assert {i for i, data in seen if len(data) == 2} == {0x101 | EXTENDED}
    bus.close()


@pytest.mark.parametrize(("near", "far"), [("vcan0", "vcan0"), ("can0", "can1")])
def test_what_is_sent_is_on_the_wire(near, far, peer):
    bus, other = RawBus(near, fd=False), peer(far)
    out = bus.outgoing(0x321, 3)
    out.buffer[out.offset : out.offset + 3] = b"abc"
    assert bus.send(out)
    select.select([other], [], [], 2.0)
    assert other.recv(16) == frame(0x321, b"abc")
    bus.close()


def test_a_remote_frame_of_length_0_is_no_data_frame(peer):
    """With a length of 8 the emulated controllers lose count of their receive buffer, so requests have 0."""
    bus, other = RawBus("can0", fd=False), peer("can1")
    collect(bus, 1)
    assert bus.send(bus.outgoing(0x29 | REMOTE, 0))
    assert select.select([other], [], [], 2.0)[0]
    assert other.recv(16) == frame(0x29 | REMOTE)
    bus.close()


def test_an_empty_bus_returns_at_once():
    bus = RawBus("vcan0", fd=False)
    collect(bus, 1)
    assert bus.receive()
    bus.close()


@pytest.mark.parametrize(
    ("error", "data", "well"),
    [
        (0x040, bytes(8), (0x100, bytes(8))),
        (0x004, b"\0\x20\0\0\0\0\0\0", (0x004, b"\0\x40\0\0\0\0\0\0")),
    ],
    ids=["bus-off and restart", "error-passive and active"],
)
def test_error_frames_of_the_kernel_become_faults_and_end(error, data, well, peer):
    bus, controller = RawBus("vcan0", fd=False), peer("vcan0")
    collect(bus, 1)
    controller.send(frame(ERROR | error, data))
    assert wait_for(bus, lambda: bus.health.link_faults == LinkFault.LOST, 1.0)
    controller.send(frame(ERROR | well[0], well[1]))
    assert wait_for(bus, lambda: bus.health.link_faults == 0, 1.0)
    bus.close()


@pytest.mark.parametrize("what", [("link", "set", "vcan9", "down"), ("link", "del", "vcan9")])
def test_an_interface_that_goes_is_a_lost_link_in_the_next_cycle_and_stays_lost(link, what):
    bus = RawBus(link, fd=False)
    collect(bus, 1)
    out = bus.outgoing(2, 0)
    assert bus.send(out)
    ip(*what)
    with pytest.raises(LinkLost, match="vcan9"):
        bus.receive()
    for _ in range(3):
        with pytest.raises(LinkLost):
            bus.receive()
    with pytest.raises(LinkLost):
        bus.send(out)
    bus.close()


def test_an_interface_that_is_missing_or_down_is_named_with_the_remedy(link):
    with pytest.raises(BackendError, match=r"no such interface: 'ip link show type can'"):
        RawBus("can77", fd=False)
    ip("link", "set", link, "down")
    with pytest.raises(BackendError, match=r"sudo ip link set vcan9 up"):
        RawBus(link, fd=False)


def test_reopening_leaks_no_descriptor():
    before = len(list(Path("/proc/self/fd").iterdir()))
    for _ in range(1000):
        RawBus("vcan0", fd=False).close()
    assert len(list(Path("/proc/self/fd").iterdir())) == before


def test_a_frame_sent_after_a_burst_is_heard_last(peer):
    """As `stop` is. On vcan: the emulated controllers never recover from a flood."""
    listener, bus = peer("vcan0"), RawBus("vcan0", fd=False)
    collect(bus, 1)
    command, stop = bus.outgoing(0x10, 8), bus.outgoing(0x11, 1)
    assert all(bus.send(command) for _ in range(10))
    assert bus.send(stop)
    heard = []
    while not heard or heard[-1] != 0x11:
        assert select.select([listener], [], [], 5.0)[0], "stop was never heard"
        heard.append(struct.unpack_from("=I", listener.recv(16))[0])
    assert heard == [0x10] * 10 + [0x11]
    bus.close()
