"""Where a field stands in a record."""

from __future__ import annotations

import numpy as np


def placed(record: np.dtype[np.void], name: str) -> tuple[np.dtype[np.generic], int]:
    """Type of the field and its offset in the record, bytes. Raises KeyError for a field that the record does
    not have."""
    if record.fields is None:
        raise KeyError(name)
    kind, offset = record.fields[name][:2]
    return kind, offset
