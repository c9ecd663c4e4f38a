"""Decimal text to the nearest 64-bit float, compiled: the conversion of Lemire (2021).

Notes
-----
w 10^q = w 5^q 2^q. With the first 128 bits of 5^q in a table, the upper 128 bits of w 5^q decide how the product rounds to
53 bits, for every w of up to 19 digits (Mushtak and Lemire 2023); orjson writes 17 at most. D. Lemire, Number parsing at a gigabyte per second, Software: Practice
and Experience 51 (2021).
"""

from __future__ import annotations

import numpy as np

from rtctl.recording.jit import compiled

SMALLEST_Q, LARGEST_Q = -342, 308
MOST_DIGITS = 19

_MINUS, _POINT, _ZERO, _NINE, _PLUS, _E, _BIG_E = (ord(c) for c in "-.09+eE")
_U0, _U1, _U2, _U3, _U9 = (np.uint64(n) for n in (0, 1, 2, 3, 9))
_TEN, _U32, _U63, _U55 = (np.uint64(n) for n in (10, 32, 63, 55))
_LOW32, _LOW9, _ALL = (np.uint64(n) for n in (0xFFFFFFFF, 0x1FF, 0xFFFFFFFFFFFFFFFF))
_HIDDEN, _BELOW_HIDDEN, _CARRIED = (np.uint64(n) for n in (1 << 52, (1 << 52) - 1, 1 << 53))
_SHIFT = np.uint64(64 - 52 - 3)
_FRACTION_BITS = np.uint64(52)
_INFINITE = np.uint64(0x7FF0000000000000)
_SIGN = np.uint64(1 << 63)


def _power_of_five(q: int) -> int:
    """The first 128 bits of 5^q: cut off for q >= 0, of the reciprocal and rounded up below."""
    five: int = 5 ** abs(q)
    if q >= 0:
        size = five.bit_length()
        return five << (128 - size) if size <= 128 else five >> (size - 128)
    z = (five - 1).bit_length()
    found: int = 2 ** (z + 127 if q >= -27 else 2 * z + 128) // five + 1
    return found >> max(found.bit_length() - 128, 0)


def _table() -> np.ndarray:
    powers = [_power_of_five(q) for q in range(SMALLEST_Q, LARGEST_Q + 1)]
    return np.array([(p >> 64, p & (2**64 - 1)) for p in powers], np.uint64)


POWERS = _table()


@compiled
def _times(a: np.uint64, b: np.uint64) -> tuple[np.uint64, np.uint64]:
    """Upper and lower half of a product of 64-bit numbers."""
    a_high, a_low, b_high, b_low = a >> _U32, a & _LOW32, b >> _U32, b & _LOW32
    low, middle, other = a_low * b_low, a_high * b_low, a_low * b_high
    carry = (low >> _U32) + (middle & _LOW32) + (other & _LOW32)
    high = a_high * b_high + (middle >> _U32) + (other >> _U32) + (carry >> _U32)
    return high, (carry << _U32) | (low & _LOW32)


@compiled
def _leading_zeros(w: np.uint64) -> int:
    n, step = 0, 32
    while step > 0:
        if w >> np.uint64(64 - step) == _U0:
            n, w = n + step, w << np.uint64(step)
        step //= 2
    return n


@compiled
def bits_of(w: np.uint64, q: int, powers: np.ndarray) -> np.uint64:
    """Bits of the float nearest to w 10^q, w of at most 19 digits. `powers`: `POWERS`."""
    if w == _U0 or q < SMALLEST_Q:
        return _U0
    if q > LARGEST_Q:
        return _INFINITE
    zeros = _leading_zeros(w)
    w = w << np.uint64(zeros)
    high, low = _times(w, powers[q - SMALLEST_Q, 0])
    if high & _LOW9 == _LOW9:
        more, _ = _times(w, powers[q - SMALLEST_Q, 1])
        low = low + more
        if more > low:
            high = high + _U1
    upper = high >> _U63
    mantissa = high >> (upper + _SHIFT)
    exponent = ((217706 * q) >> 16) + 63 + np.int64(upper) - zeros + 1023
    if exponent <= 0:  # below the normal numbers: as many bits as are left, and the exponent field 0
        if exponent <= -63:
            return _U0
        mantissa = mantissa >> np.uint64(1 - exponent)
        return (mantissa + (mantissa & _U1)) >> _U1
    if low <= _U1 and -4 <= q <= 23 and mantissa & _U3 == _U1 and mantissa << (upper + _SHIFT) == high:
        mantissa = mantissa & (_ALL - _U1)  # exactly half way: to even
    mantissa = (mantissa + (mantissa & _U1)) >> _U1
    if mantissa >= _CARRIED:
        mantissa, exponent = _HIDDEN, exponent + 1
    if exponent >= 0x7FF:
        return _INFINITE
    return (mantissa & _BELOW_HIDDEN) | (np.uint64(exponent) << _FRACTION_BITS)


@compiled
def read_number(text: np.ndarray, at: int, end: int, powers: np.ndarray) -> tuple[int, np.uint64]:
    """Read a JSON number.

    Returns
    -------
    at : int
        Position after it; that given where there is none, or one of more than 19 digits.
    bits : uint64
        Of the nearest float.
    """
    first = at
    sign = _U0
    if at < end and text[at] == _MINUS:
        sign, at = _SIGN, at + 1
    w, digits, q, before = _U0, 0, 0, at
    while at < end and _ZERO <= text[at] <= _NINE:
        w = w * _TEN + np.uint64(text[at] - _ZERO)
        digits += 1 if w != _U0 else 0
        at += 1
    if at == before:
        return first, _U0
    if at < end and text[at] == _POINT:
        at += 1
        point = at
        while at < end and _ZERO <= text[at] <= _NINE:
            w = w * _TEN + np.uint64(text[at] - _ZERO)
            digits += 1 if w != _U0 else 0
            at += 1
        if at == point:
            return first, _U0
        q = point - at
    if at < end and (text[at] == _E or text[at] == _BIG_E):
        at, power = _exponent(text, at + 1, end)
        if at < 0:
            return first, _U0
        q += power
    if digits > MOST_DIGITS:
        return first, _U0
    return at, bits_of(w, q, powers) | sign


@compiled
def _exponent(text: np.ndarray, at: int, end: int) -> tuple[int, int]:
    """Position after the exponent, and its value; -1 where there is none."""
    negative = at < end and text[at] == _MINUS
    if at < end and (text[at] == _MINUS or text[at] == _PLUS):
        at += 1
    first, value = at, 0
    while at < end and _ZERO <= text[at] <= _NINE:
        value = min(value * 10 + int(text[at] - _ZERO), 100_000)
        at += 1
    return (at if at > first else -1), (-value if negative else value)
