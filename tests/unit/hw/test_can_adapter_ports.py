"""Interfaces of python-can that read a serial port whatever time they are given: the loop must not wait for
them.
"""

import os
import pty
import struct
import tty

import can
import pytest
from patience import until

from hw.can.adapter import PORTS, AdapterBus
from hw.interface import LinkLost

DATA = bytes(range(8))


def serial_frame(can_id, data=DATA):
    return b"\xaa" + struct.pack("<IBI", 0, len(data), can_id) + data + b"\xbb"


def seeedstudio_frame(can_id, data=DATA):
    return bytes([0xAA, 0xC0 | len(data)]) + struct.pack("<H", can_id) + data + b"\x55"


FRAMES = {"serial": serial_frame, "seeedstudio": seeedstudio_frame}


class Line:
    """Both ends of a pty, one of them an open bus; `reads` are those of its port."""

    def __init__(self, interface):
        self.master, self._slave = pty.openpty()
        tty.setraw(self.master)
        tty.setraw(self._slave)
        os.set_blocking(self.master, False)
        options = {
            "interface": interface,
            "channel": os.ttyname(self._slave),
            "bitrate": 500_000,
            "fd": False,
        }
        self.bus = AdapterBus({**options, "arguments": {}})
        self.port = getattr(self.bus._bus, PORTS[interface][0])
        self.seen, self.reads = [], 0
        self.bus.subscribe({0x101: lambda data, _offset, length: self.seen.append(bytes(data[:length]))})
        read = self.port.read

        def counted(size=1):
            self.reads += 1
            return read(size)

        self.port.read = counted

    def sent(self, end):
        """What the bus has written, up to these bytes: a pty delivers in its own time."""
        os.set_blocking(self.master, True)
        found = b""
        while end not in found:
            found += os.read(self.master, 1000)
        os.set_blocking(self.master, False)
        return found

    def until(self, frames):
        """Receive until so many frames have come."""
        while len(self.seen) < frames:
            self.bus.receive()

    def close(self):
        self.bus.close()
        for fd in (self.master, self._slave):
            try:
                os.close(fd)
            except OSError:
                continue


@pytest.fixture(params=PORTS)
def line(request):
    made = Line(request.param)
    made.make = FRAMES[request.param]
    yield made
    made.close()


def test_a_port_where_nothing_waits_is_not_read(line):
    line.reads = 0
    assert line.bus.receive()
    assert line.reads == 0


def test_frames_that_wait_are_handed_on_and_the_others_dropped(line):
    os.write(line.master, line.make(0x101) + line.make(0x102) + line.make(0x101, b"ab"))
    line.until(2)
    assert line.seen == [DATA, b"ab"]


def test_noise_and_a_frame_that_is_cut_off_raise_nothing_and_the_next_ones_arrive(line):
    os.write(line.master, b"noise" + line.make(0x101) + line.make(0x101)[:-3])
    line.until(1)
    while line.port.in_waiting:
        line.bus.receive()
        if line.port.in_waiting < PORTS[line.bus._name.split()[1]][1]:
            break
    os.write(line.master, bytes(20) + line.make(0x101, b"xy"))
    line.until(2)
    assert line.seen[-1] == b"xy"


def test_what_is_sent_is_on_the_line_and_no_room_is_a_refusal(line):
    frame = line.bus.outgoing(0x101, 8)
    frame.buffer[:] = DATA
    assert line.bus.send(frame)
    line.sent(DATA)
    while line.bus.send(frame):
        pass
    assert line.bus.health.counts["tx_refused"] == 1


def test_a_port_that_hangs_up_is_a_lost_link(line):
    os.close(line.master)
    cycles = iter(line.bus.receive, None)
    with pytest.raises(LinkLost, match="plug the adapter in again"):
        next(cycles)


def test_a_frame_with_a_wrong_end_is_dropped_and_the_next_one_arrives(line):
    os.write(line.master, line.make(0x101)[:-1] + b"?" + line.make(0x101, b"xy" * 4))
    line.until(1)
    assert line.seen == [b"xy" * 4]


def test_the_shortest_frame_is_as_python_can_writes_it(line):
    shortest = PORTS[line.bus._name.split()[1]][1]
    mark = line.bus.outgoing(0x7A7, 0)
    for frame in (line.bus.outgoing(0x101, 8), mark):
        until(lambda frame=frame: line.bus.send(frame), "room on a pty of a busy machine")
    told = line.sent(struct.pack("<H", 0x7A7))
    if not told.endswith(line.make(0x7A7, b"")[-1:]):
        told += line.sent(line.make(0x7A7, b"")[-1:])
    assert shortest == len(told) - told.rindex(b"\xaa")


def test_a_frame_is_as_long_as_its_data_whatever_it_says():
    options = {"interface": "virtual", "channel": "said", "bitrate": 500_000, "fd": False, "arguments": {}}
    bus, peer = AdapterBus(options), can.Bus(interface="virtual", channel="said", ignore_config=True)
    lengths = []
    bus.subscribe({0x101: lambda _data, _offset, length: lengths.append(length)})
    peer.send(can.Message(arbitration_id=0x101, is_extended_id=False, dlc=8, data=b"12"))
    until(lambda: bus.receive() and lengths)
    bus.close()
    peer.shutdown()
    assert lengths == [2], "8 would be read by a codec beyond the end, which no backend survives"
