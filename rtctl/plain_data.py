"""What any result is as data: the types that JSON has, and no others."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from enum import Enum
from pathlib import PurePath
from typing import TypeAlias

Plain: TypeAlias = "bool | int | float | str | list[Plain] | dict[str, Plain] | None"


def as_data(value: object) -> Plain:
    """A value in the types that JSON has: NumPy numbers and arrays as Python's, enumerations by name (those
    that are numbers as such), paths as text.

    A float that is not finite is null, for JSON has none. Raises TypeError for what is no data."""
    if value is None or isinstance(value, str | bool):
        return value
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, Mapping):
        return {str(as_data(key)): as_data(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [as_data(item) for item in value]
    if hasattr(value, "as_dict"):
        return as_data(value.as_dict())
    if is_dataclass(value) and not isinstance(value, type):
        return as_data(asdict(value))
    if hasattr(value, "tolist"):  # NumPy scalars and arrays
        return as_data(value.tolist())
    raise TypeError(f"{type(value).__name__} is no data")
