"""What a reading is made of, for the digests: numbers in one form, whoever read them."""

from __future__ import annotations

import hashlib
import math
import struct

TURN = 2 * math.pi
NOTHING = b"-"
"""No sample: damaged, not vouched for, or not a number."""


def finite(*numbers: float) -> bool:
    """Whether all are numbers."""
    return all(map(math.isfinite, numbers))


def doubles(*numbers: float) -> bytes:
    """Numbers that were read; -0 is 0."""
    return struct.pack(f"<{len(numbers)}d", *(number + 0.0 for number in numbers))


def digest(readings: list[bytes]) -> str:
    """Of a chunk."""
    return hashlib.sha256(b"|".join(readings)).hexdigest()[:16]
