"""Ticks of recordings made before rtctl wrote CDR: a JSON object each. Read only, and slowly."""

from __future__ import annotations

import base64

import numpy as np
import orjson

from rtctl.errors import DataError
from rtctl.recording.tick_cdr import RECORDED
from rtctl.tick import forget, tick_dtype

RAW_TOPIC = "rtctl/raw"
"""Had the exact bits of a tick with a number that JSON cannot say."""


def fields_of(schema: bytes) -> list[str]:
    """Names of the fields, by the schema. Raises DataError for a damaged one."""
    try:
        return list(orjson.loads(schema)["properties"])
    except (ValueError, KeyError, TypeError) as error:
        raise DataError("the schema of the ticks is damaged") from error


def axes_of(text: bytes) -> int:
    """Number of axes by a tick; 0 where it does not say."""
    try:
        return len(orjson.loads(text)["position_rad"])
    except (ValueError, KeyError, TypeError):
        return 0


def decode(texts: list[bytes], raws: list[bytes], n_axes: int) -> np.ndarray:
    """Ticks of JSON objects and of the exact bits beside them; null is NaN, and of missing fields they say
    nothing (`forget`).

    Raises
    ------
    DataError
        Text that is not JSON, or not a tick of this rig size."""
    rows = np.zeros(len(texts), tick_dtype(n_axes))
    forget(rows, rows.dtype.names or ())  # until the file says otherwise
    try:
        objects = [orjson.loads(text) for text in texts]
        if not all(isinstance(o, dict) for o in objects):
            raise DataError("a recorded tick is no JSON object")
        for field in RECORDED:
            # by the first: a recording has the same fields throughout
            if objects and field.name in objects[0]:
                rows[field.name] = np.array([o[field.name] for o in objects], rows.dtype[field.name].base)
        for raw in map(orjson.loads, raws):
            words = base64.b64decode(raw["words"])
            # by its number: not every tick has one, only those that JSON could not say
            at = np.flatnonzero(rows["tick"] == raw["tick"])
            # of a version with another tick the bits mean something else
            if len(at) and len(words) == rows.dtype.itemsize:
                rows[at[0]] = np.frombuffer(words, rows.dtype)[0]
                # computed anew by whoever needs it: the seal of then was of that tick in that memory
                rows["seal"][at[0]] = 0
    except (ValueError, TypeError, KeyError, OverflowError) as error:
        raise DataError(f"a recorded tick cannot be read: {error}") from error
    return rows
