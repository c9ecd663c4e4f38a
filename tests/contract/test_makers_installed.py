"""Against libraries that are installed with the tests: canopen's frames, cantools' numbers, pyserial's port settings."""

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
import cantools
import pytest
import serial
from canopen.emcy import EmcyConsumer
from canopen.nmt import NMT_STATES, NmtMaster
from canopen.objectdictionary import ObjectDictionary, ODVariable
from canopen.objectdictionary.datatypes import INTEGER16, INTEGER32, UNSIGNED16
from canopen.pdo.base import PdoMap
from canopen.sync import SyncProducer
from makers import random_frames
from makers_read import AT, RIG

from hw.can import board_backend as board
from hw.can import cia402
from hw.can.board_options import BoardOptions
from hw.can.sample import Sample
from hw.serial import port

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


class Bus:
    """Takes what we send, and hears what the drive would answer."""

    class Frame:
        def __init__(self, can_id, length):
            self.id, self.buffer, self.offset, self.length = can_id, bytearray(length), 0, length

    def __init__(self):
        self.sent, self.answer = [], lambda frame: None

    def outgoing(self, can_id, length):
        return self.Frame(can_id, length)

    def send(self, frame):
        self.sent.append((frame.id, bytes(frame.buffer)))
        self.answer(frame)
        return True

    def subscribe(self, handlers):
        self.handlers = handlers

    def receive(self):
        return True


TABLE = {
    "node": NODE, "direction": 1, "shaft": "motor", "offset_rad": 0.0, "current_max_a": 20.0, "counts_per_turn": 4096.0,
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
    """Emergencies and heartbeats among it. A frame of another length is none: canopen would take what is there of it."""
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


# -- cantools ----------------------------------------------------------------------------------------------
DBC = """
VERSION ""
NS_ :
BS_:
BU_: host board
BO_ 257 State: 8 board
 SG_ angle : 0|20@1- (0.01,-3) [0|0] "deg" host
 SG_ speed : 31|16@0- (0.125,0) [0|0] "rpm" host
 SG_ current : 40|11@1+ (0.02,-20) [0|0] "A" host
 SG_ stop : 63|1@1+ (1,0) [0|0] "" host
BO_ 258 Wrench: 16 board
 SG_ fx : 0|32@1- (1,0) [0|0] "N" host
 SG_ fy : 39|32@0- (1,0) [0|0] "N" host
 SG_ fz : 64|64@1- (1,0) [0|0] "N" host
BO_ 259 Slow: 8 board
 SG_ which M : 0|8@1+ (1,0) [0|0] "" host
 SG_ heat m7 : 23|12@0- (0.1,20) [0|0] "degC" host
BO_ 512 Drive: 8 host
 SG_ wanted : 3|13@1- (0.01,0) [0|0] "A" board
 SG_ on : 32|1@1+ (1,0) [0|0] "" board
SIG_VALTYPE_ 258 fx : 1;
SIG_VALTYPE_ 258 fy : 1;
SIG_VALTYPE_ 258 fz : 2;
"""
SIGNALS = (
    ("position", 0, "State", "angle", math.pi / 180), ("velocity", 0, "State", "speed", math.pi / 30),
    ("current", 0, "State", "current", 1.0), ("force", 0, "Wrench", "fx", 1.0), ("force", 1, "Wrench", "fy", 1.0),
    ("force", 2, "Wrench", "fz", 1.0), ("temperature", 0, "Slow", "heat", 1.0),
)  # fmt: skip


@pytest.fixture
def described(tmp_path):
    (tmp_path / "board.dbc").write_text(DBC)
    wanted = [
        ("current_command", 0, "Drive", "wanted"),
        ("enable", 0, "Drive", "on"),
        ("estop", 0, "State", "stop"),
    ]
    entries = [
        {"channel": channel, "axis": axis, "message": message, "signal": signal}
        for channel, axis, message, signal, *_ in (*SIGNALS, *wanted)
    ]
    table = {
        "bus": {"interface": "virtual", "channel": "x", "fd": True},
        "dbc": "board.dbc",
        "signal": entries,
    }
    valid = BoardOptions.model_validate(table, context={"folder": tmp_path}).model_dump()
    return valid, cantools.database.load_string(DBC, "dbc")


@pytest.mark.parametrize("count", COUNTS)
def test_random_frames_of_a_board_are_what_cantools_reads(described, count):
    valid, base = described
    sample, draw, taken = Sample(1), random.Random(count), 0
    made = [(table["id"], board.ReceivedFrame(table, RIG, sample)) for table in valid["receive"]]
    arrays = {
        "position": sample.position_rad, "velocity": sample.velocity_rad_s, "current": sample.current_a,
        "force": sample.force_n, "temperature": sample.temperature_c,
    }  # fmt: skip
    for _ in range(count):
        can_id, frame = draw.choice(made)
        message = base.get_message_by_frame_id(can_id)
        good = b"".join(random_frames.number(draw) for _ in range(message.length // 4))
        if can_id == 259:
            good = bytes([draw.choice((7, 7, 3))]) + good[1:]
        data = random_frames.bent(draw, good)
        sample.fresh = 0
        frame.handler(bytes(AT) + data + bytes(72), AT, len(data))
        if len(data) != message.length or (can_id == 259 and data[0] != 7):
            assert not sample.fresh
            continue
        read = message.decode(data, decode_choices=False)
        ours = {
            name: (channel, axis, unit) for channel, axis, of, name, unit in SIGNALS if of == message.name
        }
        whole = all(math.isfinite(read[name]) for name in ours)
        assert bool(sample.fresh) == whole
        taken += whole
        for name, (channel, axis, unit) in ours.items() if whole else ():
            assert arrays[channel][axis] == pytest.approx(unit * float(read[name]), rel=1e-12, abs=1e-12)
        if message.name == "State":
            assert sample.estop == read["stop"]
        assert all(map(math.isfinite, sample.values))
    assert taken > count / 10


@pytest.mark.parametrize("count", COUNTS)
def test_commands_to_a_board_are_what_cantools_packs(described, count):
    """Where cantools refuses a number that has no room, the largest there is is sent."""
    valid, base = described
    message, draw = base.get_message_by_name("Drive"), random.Random(count)
    bus = Bus()
    sent = board.SentFrame(valid["send"][0], RIG, bus)
    for _ in range(count):
        current, on = draw.choice((draw.uniform(-60, 60), 0.0, math.inf)), draw.random() < 0.8
        sent.send(bus, [current], [0.0], on)
        raw = round(min(max(current, -40.96), 40.95) / 0.01) if on and math.isfinite(current) else 0
        enabled = on and math.isfinite(current)
        theirs = message.encode({"wanted": raw, "on": int(enabled)}, scaling=False)
        assert bus.sent.pop() == (512, theirs)


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
