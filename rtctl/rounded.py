"""Bounds as they are printed: rounded to the side on which the printed number itself still passes."""

from __future__ import annotations

import math
from decimal import ROUND_CEILING, ROUND_FLOOR, Context

_SAME = 1e-12
"""Share by which a number may be off the round one that it is: 0.3 is .29999999999999998 in binary, and would
be rounded down to .299."""


def up(value: float, digits: int = 3) -> str:
    """So many significant digits, no less than the value; what is not finite as it is."""
    return _rounded(value * (1 - math.copysign(_SAME, value)), digits, ROUND_CEILING)


def down(value: float, digits: int = 3) -> str:
    """So many significant digits, no more than the value; "0" for one that is not above 0, NaN too: nothing
    passes."""
    return _rounded(value * (1 + _SAME), digits, ROUND_FLOOR) if value > 0 else "0"


def _rounded(value: float, digits: int, way: str) -> str:
    rounded = Context(prec=digits, rounding=way).create_decimal_from_float(value)
    return f"{float(rounded):.{digits}g}"
