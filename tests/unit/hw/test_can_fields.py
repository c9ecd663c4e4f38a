"""Numbers in frames: exact in both directions, saturating, agreeing with cantools on random layouts."""

import math
import random
import struct

import cantools
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hw.can.fields import (
    CHECKSUMS,
    Field,
    Sequence,
    Unwrap,
    byte_field,
    decoder,
    encoder,
    raw_decoder,
    to_raw,
)
from hw.interface import BackendError


@st.composite
def fields(draw, kinds=("uint", "int", "float")):
    kind = draw(st.sampled_from(kinds))
    length = draw(st.sampled_from([8, 16, 64]))
    bits = draw(st.sampled_from([32, 64]) if kind == "float" else st.integers(1, 64))
    shift = draw(st.integers(0, 8 * length - bits))
    order = draw(st.sampled_from(["little", "big"]))
    start = shift
    if order == "big":
        top = shift + bits - 1  # counted from the frame's last bit
        start = 8 * (length - 1 - top // 8) + top % 8
    field = Field(length, start, bits, order, kind)
    assert field.shift == shift
    return field


@given(fields(), st.binary(min_size=80, max_size=80), st.integers(0, 8))
def test_any_bits_decode_to_a_number_and_encode_back_to_themselves(field, noise, offset):
    buffer = bytearray(noise)
    value = decoder(field)(buffer, offset)
    if field.kind == "float" and not math.isfinite(value):
        return
    encoder(field)(buffer, offset, value)
    if field.kind != "float" and field.bits > 53:
        assert decoder(field)(buffer, offset) == pytest.approx(value, rel=1e-15)
    else:
        assert decoder(field)(buffer, offset) == value
        assert buffer == noise


@given(fields(), st.floats() | st.integers(-(2**70), 2**70).map(float))
def test_encoding_saturates_and_never_wraps(field, value):
    buffer = bytearray(field.length)
    encoder(field)(buffer, 0, value)
    low, high = field.raw_range
    wanted = 0.0 if math.isnan(value) else min(max(value, low), high)
    got = raw_decoder(field)(buffer, 0)
    if field.kind == "float":
        assert got == pytest.approx(wanted, rel=1e-6, abs=1e-40)
    else:
        assert low <= got <= high
        assert abs(got - wanted) <= 0.5


@given(fields(("uint", "int")), st.binary(min_size=64, max_size=64))
def test_encoding_touches_no_other_bit(field, noise):
    buffer = bytearray(noise)
    encoder(field)(buffer, 0, 3.0)
    mask = ((1 << field.bits) - 1) << field.shift
    before = int.from_bytes(noise[: field.length], field.order)
    after = int.from_bytes(buffer[: field.length], field.order)
    assert before & ~mask == after & ~mask


def test_scale_and_offset_apply_and_nan_is_physical_zero():
    field = Field(8, 0, 8, "little", "uint", scale=0.5, offset=-40.0)
    buffer = bytearray(8)
    encoder(field)(buffer, 0, 20.0)
    assert buffer[0] == 120
    assert decoder(field)(buffer, 0) == 20.0
    encoder(field)(buffer, 0, math.nan)
    assert decoder(field)(buffer, 0) == 0.0
    assert to_raw(field, math.inf) == 255
    assert to_raw(field, -math.inf) == 0


@pytest.mark.parametrize(
    "bad",
    [
        {"start_bit": 60, "bits": 8}, {"start_bit": -1, "bits": 8}, {"start_bit": 0, "bits": 0},
        {"start_bit": 0, "bits": 65},
        {"start_bit": 0, "bits": 16, "kind": "float"}, {"start_bit": 0, "bits": 8, "scale": 0.0},
        {"start_bit": 0, "bits": 8, "scale": math.nan}, {"start_bit": 0, "bits": 8, "offset": math.inf},
        {"start_bit": 3, "bits": 64, "order": "big"},
    ],
)  # fmt: skip
def test_impossible_fields_are_refused(bad):
    with pytest.raises(BackendError):
        Field(length=8, **bad)


def test_whole_bytes_in_either_order():
    data = bytes(range(8))
    assert decoder(byte_field(8, 2, 32))(data, 0) == struct.unpack_from("<I", data, 2)[0]
    assert decoder(byte_field(8, 2, 32, "big"))(data, 0) == struct.unpack_from(">I", data, 2)[0]
    assert decoder(byte_field(8, 1, 24, "big"))(data, 0) == 0x010203


def _random_database(rng):
    lines = ['VERSION ""', "BU_: A"]
    layouts = []
    for number in range(40):
        kind = rng.choice(["uint", "int", "float"])
        bits = rng.choice([32, 64]) if kind == "float" else rng.randint(1, 64)
        order, shift = rng.choice(["little", "big"]), rng.randint(0, 64 - bits)
        start = shift
        if order == "big":
            top = shift + bits - 1
            start = 8 * (7 - top // 8) + top % 8
        scale = rng.choice([1, 0.25, 0.1, 2])
        lines.append(f"BO_ {256 + number} M{number}: 8 A")
        sign, endian = "+" if kind == "uint" else "-", 1 if order == "little" else 0
        lines.append(f' SG_ S : {start}|{bits}@{endian}{sign} ({scale},-3) [0|0] "" A')
        layouts.append((256 + number, kind, bits, Field(8, start, bits, order, kind, scale, -3.0)))
    lines += [f"SIG_VALTYPE_ {m} S : {1 if b == 32 else 2};" for m, k, b, _ in layouts if k == "float"]
    return cantools.database.load_string("\n\n".join(lines), "dbc"), layouts


@pytest.mark.parametrize("seed", range(5))
def test_random_layouts_decode_as_cantools_does(seed):
    rng = random.Random(seed)
    database, layouts = _random_database(rng)
    for identifier, _, _, field in layouts:
        for _ in range(20):
            data = rng.randbytes(8)
            theirs = float(database.decode_message(identifier, data)["S"])
            ours = float(decoder(field)(data, 0))
            assert ours == pytest.approx(theirs, rel=1e-12, nan_ok=True)


@settings(max_examples=60)
@given(st.sampled_from([8, 12, 14, 16, 32]), st.lists(st.integers(-100, 100), max_size=60), st.booleans())
def test_a_counter_is_followed_through_its_wraps(bits, steps, negative):
    unwrap, true = Unwrap(bits), -3 if negative else 5
    first = unwrap(true & (1 << bits) - 1) - true
    for step in steps:
        true += step if bits > 8 else step % 100
        assert unwrap(true & (1 << bits) - 1) - true == first


@given(st.integers(1, 16), st.integers(0, 65535), st.integers(0, 65535))
def test_only_newer_counts_are_accepted(bits, first, second):
    mask = (1 << bits) - 1
    sequence = Sequence(bits)
    assert sequence.newer(first & mask)
    assert not sequence.newer(first & mask), "a duplicate"
    ahead = (second - first) & mask
    assert sequence.newer(second & mask) == (0 < ahead <= (mask + 1) // 2)


def test_checksums_have_their_published_check_values():
    data = b"123456789"
    assert CHECKSUMS["crc8_j1850"](data) == 0x4B
    assert CHECKSUMS["crc8_autosar"](data) == 0xDF
    assert CHECKSUMS["xor8"](data) == 0x31
    assert CHECKSUMS["sum8"](data) == 0xDD


@pytest.mark.parametrize("kind", ["crc8_j1850", "crc8_autosar"])
def test_a_crc_rejects_all_flips_of_one_or_two_bits(kind):
    data = bytearray(random.Random(1).randbytes(7))
    good = CHECKSUMS[kind](data)
    frame = bytearray([*data, good])
    for i in range(64):
        for j in range(i, 64):
            flipped = bytearray(frame)
            flipped[i // 8] ^= 1 << i % 8
            if j != i:
                flipped[j // 8] ^= 1 << j % 8
            assert CHECKSUMS[kind](flipped[:7]) != flipped[7]
