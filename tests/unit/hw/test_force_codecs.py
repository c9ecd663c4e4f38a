"""Force sensor frames: published layouts, checksums, and a stream that is cut, damaged or misleading."""

import itertools
import math
import random
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hw.force import optoforce, rdt, rokubi
from hw.force.checksum import crc16_x25
from hw.force.frames import Frames

ROKUBI = rokubi.encode((1.5, -2.25, 3.0), stamp_us=123456, status=0, torque_nm=(0.1, 0.2, 0.3))
OPTO = optoforce.encode("3-axis", [100, -200, 300], count=7)
CODECS = {
    "rokubi": (rokubi.HEADER, rokubi.LENGTH, rokubi.intact, rokubi.decode, ROKUBI),
    **{
        f"optoforce {layout}": (
            optoforce.header(layout),
            optoforce.length(layout),
            optoforce.intact,
            optoforce.decode,
            optoforce.encode(layout, [100, -200, 300, 4, 5, 6], count=7),
        )
        for layout in ("3-axis", "6-axis", "4x3-axis")
    },
}


@pytest.fixture(params=CODECS)
def codec(request):
    return CODECS[request.param]


def frames_of(codec):
    header, length, intact, _, _ = codec
    return Frames(header, length, intact)


def flipped(data, *bits):
    out = bytearray(data)
    for bit in bits:
        out[bit // 8] ^= 1 << bit % 8
    return bytes(out)


def crc16_x25_by_hand(data):
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc ^ 0xFFFF


def test_the_crc_gives_the_check_value_of_the_catalogue():
    assert crc16_x25(b"123456789") == 0x906E


@given(st.binary(max_size=80))
def test_the_crc_is_that_of_its_definition(data):
    assert crc16_x25(data) == crc16_x25_by_hand(data)


def test_a_rokubi_frame_has_the_published_layout():
    assert len(ROKUBI) == 37
    assert ROKUBI[0] == 0xAA
    assert struct.unpack_from("<H", ROKUBI, 1) == (0,)
    assert struct.unpack_from("<3f", ROKUBI, 3) == (1.5, -2.25, 3.0)
    assert struct.unpack_from("<I", ROKUBI, 27) == (123456,)
    assert struct.unpack_from("<H", ROKUBI, 35) == (crc16_x25_by_hand(ROKUBI[1:35]),)
    reading = rokubi.decode(ROKUBI)
    assert (reading.mark, reading.status, reading.force) == (123456, 0, (1.5, -2.25, 3.0))


def test_a_rokubis_status_is_told_in_words():
    assert rokubi.explain(rokubi.Status.OVERRANGE | rokubi.Status.RAW) == "OVERRANGE, RAW"
    assert rokubi.explain(0x20) == "0x20"


@pytest.mark.parametrize("force", [(math.nan, 0.0, 0.0), (0.0, math.inf, 0.0), (0.0, 0.0, -math.inf)])
def test_a_force_that_is_no_number_is_a_status_of_its_own(force):
    frame = rokubi.encode(force)
    assert rokubi.intact(frame)
    assert rokubi.decode(frame).status & rokubi.Status.NOT_FINITE


def test_an_optoforce_frame_has_the_published_layout():
    assert OPTO[:4] == bytes((0xAA, 7, 8, 10))
    assert struct.unpack(">HHhhhH", OPTO[4:]) == (7, 0, 100, -200, 300, sum(OPTO[:14]))
    assert [optoforce.length(layout) for layout in ("3-axis", "6-axis", "4x3-axis")] == [16, 22, 34]


def test_each_of_four_optoforce_sensors_can_be_chosen():
    frame = optoforce.encode("4x3-axis", list(range(12)))
    assert [optoforce.decode(frame, k).force for k in range(4)] == [
        (0, 1, 2),
        (3, 4, 5),
        (6, 7, 8),
        (9, 10, 11),
    ]


@pytest.mark.parametrize(
    ("status", "usable"),
    [(0, True), (0x7, True), (0x8, True), (0x200, False), (0x400, False), (0x2000, False)],
)
def test_optoforce_errors_and_overload_make_a_sample_unusable_its_number_does_not(status, usable):
    assert (optoforce.decode(optoforce.encode("3-axis", [], status=status)).status == 0) is usable


def test_the_optoforce_configuration_has_the_published_bytes():
    assert optoforce.configure(1000, 0) == bytes((0xAA, 0, 0x32, 3, 1, 0, 0, 0, 0xE0))
    assert optoforce.configure(0, 15) == bytes((0xAA, 0, 0x32, 3, 0, 4, 0, 0, 0xE3))
    assert optoforce.configure(100, 500, zero=True) == bytes((0xAA, 0, 0x32, 3, 10, 1, 255, 1, 0xE9))


def test_rdt_has_the_published_layout():
    assert rdt.request(rdt.START_REALTIME) == bytes.fromhex("1234 0002 00000000")
    assert rdt.request(rdt.STOP) == bytes.fromhex("1234 0000 00000000")
    record = rdt.encode(5, 35, (1_000_000, -2_000_000, 3), status=0)
    assert record == struct.pack(">III6i", 5, 35, 0, 1_000_000, -2_000_000, 3, 0, 0, 0)
    number, reading = rdt.decode(record)
    assert (number, reading.mark, reading.status, reading.force) == (5, 35, 0, (1_000_000, -2_000_000, 3))


@pytest.mark.parametrize(
    ("status", "usable"),
    [
        (0, True),
        (0x00010000, True),
        (0x80010000, True),
        (0x80000000, False),
        (0xC0000000, False),
        (0x80020000, False),
        (0x80000008, False),
        (0x00000008, False),
        (0x80010001, False),
    ],
)
def test_a_latched_monitor_condition_is_no_fault_of_the_sample_everything_else_is(status, usable):
    assert (rdt.unusable(status) == 0) is usable


def test_every_single_flipped_bit_is_rejected(codec):
    good = codec[-1]
    for bit in range(8 * len(good)):
        assert frames_of(codec).newest(flipped(good, bit)) is None
    assert frames_of(codec).newest(good) == good


def test_every_pair_of_flipped_bits_of_a_rokubi_frame_is_rejected():
    for bits in itertools.combinations(range(8, 8 * 37), 2):
        assert not rokubi.intact(flipped(ROKUBI, *bits))


def test_the_pairs_of_flips_that_pass_the_optoforce_sum_are_only_those_that_cancel():
    """The vendor's additive sum cannot show these; docs/force-sensors.md says so."""
    n = 8 * (len(OPTO) - 2)
    for a, b in itertools.combinations(range(n), 2):
        cancel = a % 8 == b % 8 and bool(OPTO[a // 8] & 1 << a % 8) != bool(OPTO[b // 8] & 1 << b % 8)
        assert optoforce.intact(flipped(OPTO, a, b)) == cancel


def test_the_newest_of_several_frames_is_shown(codec):
    frames, good = frames_of(codec), codec[-1]
    assert frames.newest(good * 3) == good
    assert (frames.good, frames.damaged) == (3, 0)


def test_of_different_frames_the_last_one_is_shown_also_behind_a_damaged_one():
    first, second, third = (rokubi.encode((float(k), 0.0, 0.0), stamp_us=k) for k in (1, 2, 3))
    frames = frames_of(CODECS["rokubi"])
    assert frames.newest(first + second) == second
    assert frames.newest(flipped(first, 100) + third) == third


def test_what_is_forgotten_is_no_beginning_of_a_frame_and_no_damage(codec):
    frames, good = frames_of(codec), codec[-1]
    assert frames.newest(good + good[:10]) == good
    frames.forget()
    assert frames.newest(good[10:]) is None
    assert frames.newest(good) == good
    assert frames.damaged == 0


def test_a_frame_may_come_in_pieces_of_any_size(codec):
    good = codec[-1]
    for size in range(1, len(good) + 1):
        frames = frames_of(codec)
        stream = good * 3
        found = [frames.newest(stream[at : at + size]) for at in range(0, len(stream), size)]
        assert frames.good == 3
        assert [frame for frame in found if frame is not None][-1] == good


def test_it_comes_into_step_from_the_middle_of_a_frame_without_counting_damage(codec):
    good = codec[-1]
    for cut in range(1, len(good)):
        frames = frames_of(codec)
        assert frames.newest(good[cut:] + good) == good
        assert frames.damaged == 0


def test_one_damaged_frame_counts_once_and_the_next_one_is_found(codec):
    good = codec[-1]
    for at in range(len(good)):
        frames = frames_of(codec)
        damaged = flipped(good, 8 * at)
        assert frames.newest(good + damaged + good) == good
        assert (frames.good, frames.damaged) == (2, 1)


def test_lost_and_additional_bytes_count_once_and_the_next_frame_is_found(codec):
    good = codec[-1]
    for at in range(len(good)):
        for broken in (good[:at] + good[at + 1 :], good[:at] + b"\x55" + good[at:]):
            frames = frames_of(codec)
            frames.newest(good + broken + good + good)
            assert frames.damaged == 1
            assert frames.good >= 3 - (at == 0)


def test_headers_inside_the_data_do_not_mislead_it():
    good = rokubi.encode(struct.unpack("<3f", b"\xaa" * 12), stamp_us=0xAAAAAAAA)
    frames = frames_of(CODECS["rokubi"])
    for _ in range(50):
        assert frames.newest(good) == good
    assert frames_of(CODECS["rokubi"]).newest(good[5:] + good * 2) == good


@settings(max_examples=300)
@given(st.data())
def test_no_bytes_whatever_raise_or_pass_with_a_wrong_checksum(data):
    header, length, intact, decode, good = data.draw(st.sampled_from(list(CODECS.values())))
    frames = Frames(header, length, intact)
    pieces = st.one_of(st.binary(max_size=60), st.just(good), st.just(header), st.just(good[:-1]))
    for chunk in data.draw(st.lists(pieces, max_size=12)):
        found = frames.newest(chunk)
        if found is not None:
            assert intact(found)
            assert len(found) == length
            decode(found)
        assert len(frames._rest) < length


def test_thousands_of_mutated_frames_raise_nothing_and_pass_only_intact():
    draw = random.Random(7)
    for _ in range(20_000):
        header, length, intact, decode, good = draw.choice(list(CODECS.values()))
        mutated = bytearray(good)
        for _ in range(draw.randrange(1, 5)):
            mutated[draw.randrange(length)] = draw.randrange(256)
        found = Frames(header, length, intact).newest(bytes(mutated))
        if found is not None:
            assert intact(found)
            decode(found)


@given(st.binary(min_size=36, max_size=36))
def test_any_36_bytes_are_a_record(data):
    number, reading = rdt.decode(data)
    assert 0 <= number < 2**32
    assert all(math.isfinite(x) for x in reading.force)


@given(st.binary(max_size=20))
def test_only_requests_are_taken_for_commands(data):
    command = rdt.command_of(data)
    assert (command is None) == (len(data) != 8 or data[:2] != b"\x12\x34")
