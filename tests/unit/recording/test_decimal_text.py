"""Decimal text to floats: the very bits that Python reads, wherever the text comes from."""

import math
import struct

import numpy as np
import orjson
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rtctl.recording.decimal_text import POWERS, read_number

pytestmark = pytest.mark.compiled


def read(text):
    data = np.frombuffer(text.encode() + b",9", np.uint8)
    at, bits = read_number(data, 0, len(text), POWERS)
    return int(at), int(bits)


def bits(value):
    return struct.unpack("<Q", struct.pack("<d", value))[0]


@settings(max_examples=2000, deadline=None)
@given(st.integers(0, 2**64 - 1))
@example(1)
@example(0x000FFFFFFFFFFFFF)
@example(0x0010000000000000)
@example(0x7FEFFFFFFFFFFFFF)
@example(0x8000000000000000)
def test_every_finite_float_comes_back(word):
    value = struct.unpack("<d", struct.pack("<Q", word))[0]
    if math.isfinite(value):
        for text in (repr(value), orjson.dumps(value).decode()):
            assert read(text) == (len(text), word)


@settings(max_examples=2000, deadline=None)
@given(st.integers(0, 10**19 - 1), st.integers(-350, 320))
@example(9007199254740993, 0)  # half way between two floats
@example(24703282292062327, -340)  # half of the smallest
@example(17976931348623158, 292)
@example(10**19 - 1, -343)
def test_any_nineteen_digits_are_rounded_as_python_rounds_them(digits, power):
    text = f"{digits}e{power}"
    assert read(text) == (len(text), bits(float(text)))


@settings(max_examples=500, deadline=None)
@given(st.integers(0, 10**9), st.integers(0, 10**10 - 1), st.booleans())
def test_fractions_with_leading_zeros_count_their_digits_right(whole, rest, negative):
    text = f"{'-' * negative}{whole}.000000{rest:010d}"
    if len(f"{whole}{rest:016d}".lstrip("0")) <= 19:
        assert read(text) == (len(text), bits(float(text)))


@pytest.mark.parametrize(
    "text", ["", "-", ".", "1.", "-.5", "1e", "1e+", "nan", "12345678901234567890", "x1"]
)
def test_what_is_no_number_of_this_kind_is_not_read(text):
    assert read(text) == (0, 0)
