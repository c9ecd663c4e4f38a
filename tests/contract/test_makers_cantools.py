"""Against cantools, which is installed with the tests: frames of a board by its field map, both ways."""

import math
import random

import cantools
import pytest
from makers import random_frames
from makers_bus import Bus
from makers_read import AT, RIG

from hw.can import board_backend as board
from hw.can.board_options import BoardOptions
from hw.can.sample import Sample

MANY = 200_000
COUNTS = [1000, pytest.param(MANY, marks=pytest.mark.volume)]
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
    ("current", 0, "State", "current", 1.0), ("force", 0, "Wrench", "fx", 1.0),
    ("force", 1, "Wrench", "fy", 1.0),
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
