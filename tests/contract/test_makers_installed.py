"""Against libraries that are installed with the tests: canopen's frames, pyserial's port settings."""

import fcntl
import io
import itertools
import math
import os
import pty
import random
import struct
import termios

import canopen
import pytest
import serial
from canopen.emcy import EmcyConsumer
from canopen.nmt import NMT_STATES, NmtMaster
from canopen.objectdictionary import ObjectDictionary, ODVariable
from canopen.objectdictionary.datatypes import INTEGER16, INTEGER32, UNSIGNED16
from canopen.pdo.base import PdoMap
from canopen.sync import SyncProducer
from makers import random_frames
from makers_bus import Bus
from makers_read import AT, RIG

from hw import serial_port as port
from hw.can import cia402
from hw.can.sample import Sample

MANY = 200_000
COUNTS = [1000, pytest.param(MANY, marks=pytest.mark.volume)]
NODE = 5


# -- canopen -----------------------------------------------------------------------------------------------
class Network:
    """Takes what canopen sends."""

    def __init__(self):
        self.sent = []

    def send_message(self, can_id, data, remote=False):
        self.sent.append((can_id, bytes(data)))

    def subscribe(self, *_):
        pass


TABLE = {
    "node": NODE, "direction": 1, "shaft": "motor", "offset_rad": 0.0, "current_max_a": 20.0,
    "counts_per_turn": 4096.0,
    "rated_torque_nm": 1.0, "rated_current_a": 1.0, "velocity_units": 4096.0,
}  # fmt: skip


def drive():
    sample = Sample(1)
    return sample, cia402.Cia402Axis(TABLE, {"heartbeat_ms": 10.0, "source": 127}, RIG, 0, sample)


def test_what_starts_a_cia402_drive_and_keeps_it_running_is_what_canopen_sends(monkeypatch):
    monkeypatch.setattr("hw.can.cia402_setup.configure", lambda *_: (1.0, 1.0, b""))  # SDO is canopen itself
    _, axis = drive()
    bus, theirs = Bus(), Network()

    def _answer(frame):
        if frame.id == cia402.SYNC:
            bus.handlers[cia402.TPDO1 + NODE](struct.pack("<Hih", 0x21, 0, 0), 0, 8)
            bus.handlers[cia402.TPDO2 + NODE](bytes(4), 0, 4)

    bus.answer = _answer
    axis.set_up(bus)
    master = NmtMaster(NODE)
    master.network = theirs
    master.state = "OPERATIONAL"
    rpdo = pdo_of(("6040", UNSIGNED16), ("6071", INTEGER16))
    rpdo["6040"].raw, rpdo["6071"].raw = 0x06, 0
    theirs.send_message(0x200 + NODE, rpdo.data)
    SyncProducer(theirs).transmit()
    assert bus.sent == theirs.sent
    assert NMT_STATES[cia402.OPERATIONAL] == "OPERATIONAL", "the byte of the host's own heartbeat"


def pdo_of(*objects):
    known = ObjectDictionary()
    for name, kind in objects:
        variable = ODVariable(name, int(name, 16))
        variable.data_type = kind
        known.add_object(variable)
    pdo = PdoMap(canopen.RemoteNode(NODE, known).rpdo, None, None)
    for name, _ in objects:
        pdo.add_variable(int(name, 16))
    return pdo


@pytest.mark.parametrize("count", COUNTS)
def test_random_feedback_of_a_cia402_drive_is_what_canopen_reads(count):
    """Emergencies and heartbeats among it. A frame of another length is none: canopen would take what is
    there of it.
    """
    sample, axis = drive()
    handlers, draw, taken = axis.handlers(), random.Random(count), 0
    tpdo1 = pdo_of(("6041", UNSIGNED16), ("6064", INTEGER32), ("6078", INTEGER16))
    tpdo2, last, position = pdo_of(("606C", INTEGER32)), None, 0.0
    master, emergencies = NmtMaster(NODE), EmcyConsumer()
    for _ in range(count):
        can_id = draw.choice(list(handlers))
        size = {cia402.TPDO1 + NODE: 8, cia402.TPDO2 + NODE: 4, cia402.EMERGENCY + NODE: 8}.get(can_id, 1)
        data = random_frames.bent(draw, draw.randbytes(size))[:8]
        sample.fresh = 0
        handlers[can_id](bytes(AT) + data + bytes(8), AT, len(data))
        taken += bool(sample.fresh)
        assert bool(sample.fresh) == (can_id < 0x700 and can_id > 0x100 and len(data) == size)
        if can_id == cia402.TPDO1 + NODE and len(data) == 8:
            tpdo1.data = bytearray(data)
            assert axis.state == cia402.drive_state(tpdo1["6041"].raw)
            counts = tpdo1["6064"].raw
            moved = counts if last is None else (counts - last + 2**31) % 2**32 - 2**31
            before = position
            last, position = counts, sample.position_rad[0]
            assert position - before == pytest.approx(moved * math.tau / 4096, rel=1e-6, abs=1e-3)
            assert sample.current_a[0] == 1e-3 * tpdo1["6078"].raw
        elif can_id == cia402.TPDO2 + NODE and len(data) == 4:
            tpdo2.data = bytearray(data)
            assert sample.velocity_rad_s[0] == tpdo2["606C"].raw * (math.tau / 4096)
        elif can_id == cia402.EMERGENCY + NODE and len(data) == 8:
            emergencies.on_emcy(can_id, data, 0.0)
            assert axis.emergency == emergencies.log[-1].code
            emergencies.log.clear()
        elif can_id == cia402.HEARTBEAT + NODE and len(data) == 1:
            master.on_heartbeat(can_id, data, 0.0)
            assert axis.nmt == master._state_received
        assert math.isfinite(sum(sample.values))
    assert taken > count / 10


# -- pyserial ----------------------------------------------------------------------------------------------
def settings_of(fd):
    """Of the kernel's struct termios2, so that any bit rate is seen: four words of flags, and both rates."""
    data = bytearray(64)
    fcntl.ioctl(fd, 0x802C542A, data)  # TCGETS2
    return (*struct.unpack_from("=4I", data), *struct.unpack_from("=2I", data, 36))


@pytest.mark.parametrize("baud", [9600, 115_200, 460_800, 250_000, 1_234_567])
@pytest.mark.parametrize("left", ["as new", "two stop bits and handshake", "odd parity"])
def test_a_stop_is_sent_with_the_ports_settings_that_pyserial_makes(baud, left):
    ends = [pty.openpty() for _ in range(2)]
    try:
        for _, slave in ends:
            flags = termios.tcgetattr(slave)
            if left != "as new":
                flags[2] |= (
                    termios.CSTOPB | termios.CRTSCTS if "two" in left else termios.PARENB | termios.PARODD
                )
                termios.tcsetattr(slave, termios.TCSANOW, flags)
        with serial.Serial(os.ttyname(ends[0][1]), baud):
            theirs = settings_of(ends[0][1])
        assert port.send_once(os.ttyname(ends[1][1]), baud, b"stop")
        assert os.read(ends[1][0], 16) == b"stop"
        ours = settings_of(ends[1][1])
        assert ours[1:3] == theirs[1:3]
        assert ours[4:] == theirs[4:] == (baud, baud)
        silent = termios.IXON | termios.IXOFF | termios.ICRNL | termios.INLCR | termios.IGNCR | termios.ISTRIP
        assert not (ours[0] | theirs[0]) & silent
        assert not (ours[3] | theirs[3]) & (termios.ICANON | termios.ECHO | termios.ISIG | termios.IEXTEN)
    finally:
        for fd in itertools.chain(*ends):
            os.close(fd)


def test_every_byte_passes_a_port_as_pyserial_passes_it():
    master, slave = pty.openpty()
    every = bytes(range(256))
    try:
        opened = port.Port(os.ttyname(slave), 1_000_000)
        assert opened.write(every)
        heard = io.BytesIO()
        while heard.tell() < 256:
            heard.write(os.read(master, 512))
        assert heard.getvalue() == every
        opened.close()
    finally:
        os.close(master)
        os.close(slave)
