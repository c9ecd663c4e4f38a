"""A record in compiled code, and where a field stands in it."""

from __future__ import annotations

from typing import Any

import numpy as np

Record = Any
"""One row of a structured array inside compiled code: fields are attributes."""


def placed(record: np.dtype[np.void], name: str) -> tuple[np.dtype[np.generic], int]:
    """Type of the field and its offset in the record, bytes. Raises KeyError for a field that the record does
    not have."""
    if record.fields is None:
        raise KeyError(name)
    kind, offset = record.fields[name][:2]
    return kind, offset
