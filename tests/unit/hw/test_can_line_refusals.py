"""An adapter that writes lines: frames that it refuses, and more lines than the kernel keeps."""

import os
import threading

import numpy as np
import pytest
from can_buses import LineBus
from can_pair import settled
from patience import until

from hw.can import steady_cycle
from hw.can.bus import LINE_FULL
from hw.can.health import REFUSED_LIMIT
from hw.can.steady_records import BUS, COMMAND, ON, TOLD
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


def test_a_line_behind_one_that_found_no_room_begins_with_an_end_of_line(monkeypatch):
    bus, commands = np.zeros(1, BUS).view(np.recarray), np.zeros(2, COMMAND).view(np.recarray)
    bus.on, bus.ascii, bus.budget, bus.commands = ON, 1, 1, 2
    sent, taken = [], iter([0, 1])

    def _line(_packet, _key, _length, line):
        line[:6] = np.frombuffer(b"t0800\r", np.uint8)
        return 6

    def _write(_descriptor, line, size):
        sent.append(line[:size].tobytes())
        return next(taken)

    # as plain Python, for what is compiled calls the kernel
    for name, plain in (("write_all", _write), ("put_line", _line), ("_key", lambda *_: 0)):
        monkeypatch.setattr(steady_cycle, name, plain)
    monkeypatch.setattr(steady_cycle, "put", lambda *_: None)
    monkeypatch.setattr(steady_cycle, "is_writable", lambda *_: True)
    write = getattr(steady_cycle.write_cycle, "py_func", steady_cycle.write_cycle)
    nothing = np.zeros(1)
    assert write(bus, np.zeros(64, np.uint8), commands, None, np.zeros((2, 72)), nothing, nothing) == 0
    assert sent == [b"t0800\r", b"\rt0800\r"]
    assert (bus.on[0], commands.outcome.tolist()) == (TOLD, [0, 1])


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
