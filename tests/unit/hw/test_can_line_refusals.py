"""An adapter that writes lines: frames that it refuses, and more lines than the kernel keeps."""

import os
import threading

import pytest
from can_buses import LineBus
from can_pair import settled
from patience import until

from hw.can.bus import LINE_FULL
from hw.can.health import REFUSED_LIMIT
from hw.interface import LinkFault
from tests.bench.io_slcan import waiting


@pytest.fixture
def bus():
    made = LineBus(0)
    yield made
    made.close()


def hear(bus, answer):
    """One cycle: a frame is sent, and the adapter says this."""
    bus.send(bus.outgoing(5, 2))
    bus._put(answer)
    assert bus.receive()


def test_an_adapter_that_refuses_every_frame_is_a_lost_link_until_it_takes_one(bus):
    for _ in range(REFUSED_LIMIT - 1):
        hear(bus, b"\x07")
        assert bus.health.link_faults == 0
    hear(bus, b"\x07")
    assert bus.health.link_faults == LinkFault.LOST, "the port took every line, the bus none"
    hear(bus, b"z\r\x07")
    assert bus.health.link_faults == LinkFault.LOST, "one of two frames"
    hear(bus, b"z\r")
    assert bus.health.link_faults == 0
    assert bus.health.counts["tx_refused"] == REFUSED_LIMIT + 1


def test_a_refusal_of_the_adapter_makes_no_empty_line_and_one_of_the_port_does(bus):
    hear(bus, b"\x07")
    os.read(bus.far, 4096)
    bus.send(bus.outgoing(5, 1))
    assert os.read(bus.far, 64) == b"t005100\r", "an adapter may refuse an empty line by BELL, and for ever"
    bus.health.taken()
    bus._belled, bus._cut = False, True
    bus.send(bus.outgoing(5, 1))
    assert os.read(bus.far, 64) == b"\rt005100\r"


def flood(bus, lines):
    """Far more lines than the kernel keeps; the thread that writes them ends when they are read."""
    os.set_blocking(bus.far, True)
    thread = threading.Thread(target=os.write, args=(bus.far, lines), daemon=True)
    thread.start()
    until(lambda: waiting(bus.fileno()) >= LINE_FULL, "a full line")
    return thread


def test_a_full_line_is_a_backlog_whose_last_frame_may_be_old(bus):
    taken = []
    bus.subscribe({0x123: lambda data, at, n: taken.append(bytes(data[at : at + n]))})
    thread = flood(bus, b"".join(b"t1234%08X\r" % k for k in range(1000)))
    assert not bus.receive(), "what came behind the full line is not known"
    while thread.is_alive() or not bus.receive():
        bus.receive()
    assert taken[-1] == (999).to_bytes(4)


@pytest.mark.parametrize("half", [False, True], ids=["python", "compiled"])
def test_nothing_out_of_a_full_line_is_shown_as_fresh(pair, half):
    device = settled(pair, "can-odrive.toml", "odrive", bus=LineBus, compiled_half=half)
    node = device.backend.drives[0].node << 5
    both = b"t%03X8%s\rt%03X8%s\r" % (node | 0x09, b"0" * 16, node | 0x14, b"0" * 16)
    count = int(device.tick["sample_count"][0])
    thread = flood(device.bus, both * 300)
    device.tick["tick"] += 1
    device.step("read")
    assert device.tick["sample_count"][0] == count
    while thread.is_alive():  # it ends when all that it writes has been read
        device.step("read")
