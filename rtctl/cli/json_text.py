"""What every `--json` prints: one encoder, so that a row of any kind ends as JSON that any reader takes."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from enum import Enum
from pathlib import PurePath
from typing import Any

from rtctl.cli.invocation import as_run


def plain(value: object) -> Any:  # noqa: ANN401
    """A value in the types that JSON has: NumPy numbers and arrays as Python's, enumerations by name, paths as text.

    A float that is not finite is null, for JSON has none. Raises TypeError for what is no data.
    """
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
        return {str(plain(key)): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if hasattr(value, "as_dict"):
        return plain(value.as_dict())
    if is_dataclass(value) and not isinstance(value, type):
        return plain(asdict(value))
    if hasattr(value, "tolist"):  # NumPy scalars and arrays
        return plain(value.tolist())
    msg = f"{type(value).__name__} is no data"
    raise TypeError(msg)


def json_text(value: object, indent: int | None = None) -> str:
    """`value` as JSON on one line, or indented. A command in any of its texts is one that runs here, as on a terminal."""
    return json.dumps(_as_run(plain(value)), indent=indent, allow_nan=False)


def _as_run(value: object) -> Any:  # noqa: ANN401 - what `plain` returns
    if isinstance(value, str):
        return as_run(value)
    if isinstance(value, dict):
        return {key: _as_run(item) for key, item in value.items()}
    return [_as_run(item) for item in value] if isinstance(value, list) else value
