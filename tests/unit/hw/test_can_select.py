"""Frames of one identifier: multiplexed, by node, in parts; that start, ask and stop; angles start over."""

import math
import struct

import can
import numpy as np
import pytest
from board_frames import RIG, SENT, Bus, opened
from test_can_configs import rig

from hw import registry
from hw.can.board_in import ReceivedFrame, handlers
from hw.can.board_options import BoardOptions
from hw.can.sample import Sample
from hw.encoder import Modulo
from hw.interface import LinkFault

DBC = """VERSION ""

BU_: HOST BOARD

BO_ 257 Status: 8 BOARD
 SG_ Kind M : 0|8@1+ (1,0) [0|0] "" HOST
 SG_ Angle m1 : 8|16@1+ (0.01,0) [0|0] "deg" HOST
 SG_ Current m1 : 24|16@1- (0.001,0) [0|0] "A" HOST
 SG_ Heat m2 : 8|16@1- (0.1,0) [0|0] "degC" HOST
 SG_ Trouble : 56|8@1+ (1,0) [0|0] "" HOST
 SG_ Twice m3 : 8|8@1+ (1,0) [0|0] "" HOST

BO_ 512 Command: 8 HOST
 SG_ Order M : 0|8@1+ (1,0) [0|0] "" BOARD
 SG_ Wanted m7 : 8|16@1- (0.001,0) [0|0] "A" BOARD

SG_MUL_VAL_ 257 Twice Kind 3-4;
"""
SIGNALS = [
    {"channel": "position", "message": "Status", "signal": "Angle", "wrap_at": 360.0},
    {"channel": "current", "message": "Status", "signal": "Current"},
    {"channel": "temperature", "message": "Status", "signal": "Heat", "required": False, "period_ms": 100.0},
    {"channel": "fault", "message": "Status", "signal": "Trouble"},
    {"channel": "current_command", "message": "Command", "signal": "Wanted"},
]


def multiplexed(folder, signals=SIGNALS):
    (folder / "board.dbc").write_text(DBC)
    options = {"bus": {"channel": "can0"}, "dbc": "board.dbc", "signal": signals}
    return BoardOptions.model_validate(options, context={"folder": folder, "rate_hz": 500.0})


def receiving(tables):
    """Sample and handlers of `[[device.options.receive]]` tables."""
    options = BoardOptions.model_validate({"bus": {"channel": "can0"}, "receive": tables}).model_dump()
    sample = Sample(1)
    frames = [ReceivedFrame(table, RIG, sample) for table in options["receive"]]
    return sample, frames, handlers(options["receive"], frames)


def test_a_multiplexed_dbc_is_read_and_written_by_its_multiplexer(tmp_path):
    dumped = multiplexed(tmp_path).model_dump(mode="json")
    assert [len(table["select"]) for table in dumped["receive"]] == [1, 1, 0]
    assert [table["required"] for table in dumped["receive"]] == [True, False, True]
    sample = Sample(1)
    frames = [ReceivedFrame(table, rig(), sample) for table in dumped["receive"]]
    take = handlers(dumped["receive"], frames)[0x101]
    first, second = struct.pack("<BHhxxB", 1, 9000, -1500, 0), struct.pack("<BhxxxxB", 2, 455, 9)
    take(first, 0, 8)
    assert sample.position_rad[0] == pytest.approx(math.pi / 2)
    assert sample.current_a[0] == pytest.approx(-1.5)
    assert sample.fresh == sample.needed
    take(second, 0, 8)
    assert (sample.temperature_c[0], sample.current_a[0]) == (pytest.approx(45.5), pytest.approx(-1.5))
    assert frames[2].fault
    bus = Bus(lambda n: [])
    backend = registry.create("can", dumped, rig())
    backend._sent = []
    from hw.can.board_out import SentFrame

    SentFrame(dumped["send"][0], rig(), bus).send(bus, [0.25], [0.0], True)
    assert bus.sent == [struct.pack("<Bhxxxxx", 7, 250)]


def test_a_signal_of_several_multiplexer_values_is_refused_with_what_to_write(tmp_path):
    twice = {"channel": "estop", "message": "Status", "signal": "Twice"}
    with pytest.raises(ValueError, match=r"several values of Kind: \[3, 4\]; describe the frame as"):
        multiplexed(tmp_path, [*SIGNALS, twice])


PARTS = {
    "id": 0x100,
    "length": 16,
    "parts": [8, 8],
    "select": [{"byte": 0, "bits": 16, "order": "big", "value": 0xAA07}],
    "counter": {"byte": 2, "bits": 16, "order": "big"},
    "checksum": {"kind": "sum16", "byte": 14},
    "field": [{"channel": "force", "byte": 8, "bits": 16, "order": "big", "type": "int", "unit": "N"}],
}


def parts(count, force, head=0xAA07):
    body = struct.pack(">HHIhhh", head, count, 0, force, 0, 0)
    whole = body + (sum(body) & 0xFFFF).to_bytes(2, "big")
    return whole[:8], whole[8:]


def feed(take, *frames):
    for frame in frames:
        take(frame, 0, len(frame))


def test_two_frames_of_one_identifier_are_one():
    sample, _, by_id = receiving([PARTS])
    first, second = parts(1, -250)
    feed(by_id[0x100], first)
    assert not sample.fresh
    feed(by_id[0x100], second)
    assert (sample.force_n[0], sample.fresh) == (-250.0, sample.needed)


@pytest.mark.parametrize(
    ("lost", "damaged"),
    [
        ("second", 1),  # the next first part is taken for it, does not fit, and begins anew
        ("first", 0),  # a second part without a first is none of ours
        ("short", 1),
        ("flipped", 1),
    ],
)
def test_a_lost_part_never_joins_the_next_frame(lost, damaged):
    sample, _, by_id = receiving([PARTS])
    take, (a, b), (c, d) = by_id[0x100], parts(1, 10), parts(2, 20)
    wrong = bytes([b[0] ^ 4]) + b[1:]
    feed(take, *{"second": [a], "first": [b], "short": [a, b[:7]], "flipped": [a, wrong]}[lost])
    assert not sample.fresh
    feed(take, c, d)
    assert (sample.force_n[0], sample.fresh) == (20.0, sample.needed)
    assert sample.counts["damaged"] == damaged


def test_forces_that_look_like_the_beginning_of_a_frame_do_no_harm():
    sample, _, by_id = receiving([PARTS])
    for count in range(1, 6):
        feed(by_id[0x100], *parts(count, 0xAA07 - 65536))
    assert sample.force_n[0] == 0xAA07 - 65536
    assert sample.counts == {"damaged": 0, "not_newer": 0, "not_finite": 0}


POSITION = {"channel": "position", "byte": 0, "bits": 16, "unit": "deg"}
WANTED = {"channel": "torque", "byte": 0, "bits": 16, "type": "int", "unit": "Nm"}


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"receive": [{"id": 1, "field": [POSITION]},
            {"id": 1, "field": [{**POSITION, "channel": "estop", "unit": "1"}]}]},
         "received twice: tell the frames apart by select"),
        ({"receive": [{**PARTS, "parts": [8, 7]}]}, "two or more that add up"),
        ({"receive": [{**PARTS, "checksum": None}]}, "needs select .* and checksum"),
        ({"receive": [{**PARTS, "select": [{"byte": 7, "bits": 16, "value": 1}]}]}, "does not fit"),
        ({"receive": [{"id": 1, "field": [{**POSITION, "wrap": True, "wrap_at": 360.0}]}]},
            "in place of wrap"),
        ({"receive": [{"id": 1, "field": [POSITION]}], "poll": [{"id": 0x800, "data": [1]}]},
            "needs extended"),
        ({"receive": [{"id": 1, "field": [POSITION]}], "start": [{"id": 1, "data": [0] * 9}]},
            "a frame has one of"),
        ({"receive": [{"id": 1, "field": [POSITION]}],
            "send": [{"id": 2, "enter": [1] * 8, "field": [WANTED]}]},
         "enter needs idle"),
        ({"receive": [{"id": 1, "field": [POSITION]}],
            "send": [{"id": 2, "idle": [1] * 3, "field": [WANTED]}]},
         "idle has 3 bytes, the frame 8"),
        ({"receive": [{"id": 1, "field": [POSITION]}],
            "send": [{"id": 2, "field": [{**WANTED, "type": "uint", "offset": 1.5, "scale": 0.1}]}]},
         "cannot say 0, only 1.5"),
    ],
)  # fmt: skip
def test_frames_that_cannot_be_told_apart_or_cannot_stop_are_refused(change, text):
    with pytest.raises(ValueError, match=text):
        BoardOptions.model_validate({"bus": {"channel": "can0"}, **change})


@pytest.mark.parametrize("period", [360.0, 45.0, 1000.0, 2 * math.pi])
def test_an_angle_is_followed_over_any_end_in_both_directions(period):
    follow, true = Modulo(period), np.cumsum(np.sin(np.arange(4000) / 300) * 0.45 * period)
    seen = [follow(value % period) for value in true]
    assert np.asarray(seen) - seen[0] == pytest.approx(true - true[0], abs=1e-9 * period)
    assert np.ptp(true) > 50 * period


def test_a_number_beyond_the_angles_range_is_none_and_is_forgotten():
    follow = Modulo(360.0)
    assert follow(350.0) == 350.0
    for wrong in (1e30, math.nan, math.inf, -600.0):
        assert math.isnan(follow(wrong))
    assert follow(10.0) == 370.0


def test_a_board_may_be_asked_by_remote_frames():
    """On the bus of python-can, which has data for none of them."""
    asked = []
    options = {
        "bus": {"interface": "virtual", "channel": "asked"},
        "receive": [{"id": 1, "length": 2, "field": [POSITION]}],
    }
    valid = BoardOptions.model_validate({**options, "poll": [{"id": 1, "remote": True}]}).model_dump()
    with can.Bus(interface="virtual", channel="asked", ignore_config=True) as board:
        backend = registry.create("can", valid, rig())
        answer = can.Message(arbitration_id=1, data=b"\x10\0", is_extended_id=False)
        told = [lambda message: asked.append(message.is_remote_frame) or board.send(answer)]
        notifier = can.Notifier(board, told, timeout=0.01)
        try:
            backend.open()
        finally:
            notifier.stop()
        backend.close()
    assert asked[0]
    for wrong, text in (({"data": [1]}, "carries no data"), ({}, "no remote frames")):
        table = {
            **options,
            "poll": [{"id": 1, "remote": True, **wrong}],
            "bus": {**options["bus"], "fd": not wrong},
        }
        with pytest.raises(ValueError, match=text):
            BoardOptions.model_validate(table)


START, POLL, STOP = ({"id": 0x300 + k, "data": [k]} for k in range(3))


def test_start_poll_and_stop_frames_are_sent_when_they_should(monkeypatch):
    angle = {"id": 1, "length": 2, "field": [POSITION]}

    def answer(n):
        return [(1, b"\0\0")] if bus and bus[-1].sent[-1:] == [b"\1"] else []

    bus = []
    made = {"receive": [angle], "send": [], "start": [START], "poll": [POLL], "stop": [STOP]}
    monkeypatch.setattr("board_frames.Bus", lambda given: bus.append(Bus(given)) or bus[-1])
    backend, _, tick = opened(monkeypatch, answer, **made)
    assert bus[0].sent[:2] == [b"\0", b"\1"]
    before = len(bus[0].sent)
    backend.read(tick)
    backend.write(tick)
    assert bus[0].sent[before:] == [b"\1"], "asked once in every cycle"
    assert tick["sample_count"][0] == 1
    backend.stop()
    assert bus[0].sent[-1] == b"\2"


def test_a_drive_is_switched_on_once_and_off_by_what_is_not_a_number(monkeypatch):
    angle = {"id": 1, "length": 2, "field": [POSITION]}
    sent = {"id": 2, "length": 2, "enter": [0xFF, 0xFC], "idle": [0xFF, 0xFD], "field": [WANTED]}
    backend, bus, tick = opened(monkeypatch, lambda n: [(1, b"\0\0")], receive=[angle], send=[sent])
    seen = len(bus.sent)
    for enabled, torque in [(0, 5.0), (1, 5.0), (1, 5.0), (1, math.nan), (1, 5.0), (1, -3.0), (0, 1.0)]:
        tick["enabled"], tick["torque_applied_nm"] = enabled, torque
        backend.write(tick)
    on, off = b"\xff\xfc", b"\xff\xfd"
    assert bus.sent[seen:] == [off, on, b"\5\0", off, on, struct.pack("<h", -3), off]
    backend.stop()
    assert bus.sent[-1] == off


def test_a_poll_counts_on_the_bus():
    angle = {"id": 1, "length": 2, "field": [POSITION]}
    options = {"bus": {"channel": "can0"}, "receive": [angle, PARTS], "send": [SENT], "poll": [POLL]}
    found = BoardOptions.model_validate(options)
    assert [frame.length for frame in found.frames(1000.0)] == [2, 8, 8, 8, 1]
    assert 0x301 in found.identifiers()


def test_a_sample_is_damaged_when_a_selected_frame_has_another_length():
    sample, _, by_id = receiving(
        [{"id": 1, "select": [{"byte": 0, "bits": 8, "value": 1}], "field": [{**POSITION, "byte": 1}]}]
    )
    feed(by_id[1], b"\1\0")
    assert sample.faults == LinkFault.CHECKSUM


def test_of_parts_of_different_lengths_a_first_one_begins_anew():
    sample, _, by_id = receiving(
        [{**PARTS, "length": 14, "parts": [8, 6], "checksum": {"kind": "sum16", "byte": 12}}]
    )
    body = struct.pack(">HHIhh", 0xAA07, 1, 0, 30, 0)
    whole = body + (sum(body) & 0xFFFF).to_bytes(2, "big")
    feed(by_id[0x100], whole[:8], whole[:8], whole[8:])
    assert (sample.force_n[0], sample.fresh, sample.counts["damaged"]) == (30.0, sample.needed, 0)


def test_several_numbers_may_tell_a_frame():
    chosen = [{"byte": k, "bits": 8, "value": 7 + k} for k in range(2)]
    sample, frames, by_id = receiving(
        [{"id": 1, "length": 3, "select": chosen, "field": [{"channel": "estop", "byte": 2, "bits": 8}]}]
    )
    feed(by_id[1], b"\7\7\1", b"\x08\x08\1")
    assert not sample.fresh
    feed(by_id[1], b"\7\x08\1")
    assert (sample.fresh, sample.estop, frames[0].label) == (sample.needed, 1, "frame 0x1 (select 7, 8)")
