"""Ticks as ROS 2 messages (`ros2msg`, `cdr`) in MCAP records, and back: whole blocks with NumPy, nothing per
tick.

A tick is 8-byte words, so that CDR asks for no padding between them. Every bit is kept, of infinities and of
any NaN, too."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache

import numpy as np

from hw.record_fields import placed
from rtctl.errors import DataError
from rtctl.tick import FIELD, FIELDS, Field, forget, tick_dtype

RECORDED = tuple(field for field in FIELDS if field.name != "seal")
"""Fields of a recorded tick. The seal guards shared memory; readers compute it anew."""

SCHEMA_NAME = "rtctl_msgs/msg/Tick"
ENCAPSULATION = b"\x00\x01\x00\x00"
"""What stands before every message: plain CDR, little endian."""

MESSAGE_HEAD = 1 + 8 + 2 + 4 + 8 + 8
"""Bytes of an MCAP message record before its data: opcode, length, channel, sequence, two times."""

_HEAD = [("op", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log", "<u8"),
    ("publish", "<u8")]  # fmt: skip
_MESSAGE = 5
_BLOCK = 128
"""Ticks that are put into order at a time: they fit into the first cache, the rest of a chunk does not."""

_TYPES = {"int64": "<i8", "uint64": "<u8", "float64": "<f8"}
TYPE_OF = {"int": "int64", "bits": "uint64", "float": "float64"}
_LINE = re.compile(r"(int64|uint64|float64)(?:\[([1-9][0-9]{0,2})\])? ([a-z][a-z0-9_]{0,63})")
# a schema is a stranger's text: each line costs memory for every tick
_MOST_FIELDS = 1000

# What costs the most bytes is how often what changes is parted by what does not, and how far what repeats
# together stands apart: a repeated pair of neighbours is one match of the compressor. Measured:
# docs/decisions/0021.
_NEIGHBOURS = (
    "time_ns", "tick", "sample_count", "target_age_ticks",
    "wakeup_ns", "read_ns", "law_ns", "write_ns", "record_ns", "cycle_ns",
    "current_a", "motor_torque_nm",
    "force_n", "hand_torque_raw_nm", "hand_torque_nm", "force_tared_n",
    "friction_observed_nm", "observer_torque_nm", "torque_wanted_nm", "torque_applied_nm",
    "current_command_a",
    "position_rad", "proxy_position_rad", "velocity_rad_s", "friction_model_nm", "feedforward_torque_nm",
    "friction_gate", "velocity_difference_rad_s", "friction_sign",
    "energy_port_j", "energy_hand_j", "energy_feedforward_j", "torque_share", "force_offset_nm",
)  # fmt: skip


def file_order() -> tuple[Field, ...]:
    """The recorded fields in the order in which a message has them."""
    first = tuple(FIELD[name] for name in _NEIGHBOURS)
    return (*first, *(field for field in RECORDED if field not in first))


@cache
def schema_text(n_axes: int) -> str:
    """The `ros2msg` definition of a tick of a rig with `n_axes` axes."""
    lines = []
    for field in file_order():
        length = {"scalar": "", "axis": f"[{n_axes}]", "xyz": "[3]"}[field.shape]
        lines.append(f"{TYPE_OF[field.kind]}{length} {field.name} # {field.meaning} [{field.unit}]\n")
    return "".join(lines)


def lines_of(schema: bytes, line: re.Pattern[str], what: str) -> Iterator[tuple[str, ...]]:
    """The groups of `line` in each line of a definition. Raises DataError for one that is damaged."""
    try:
        lines = [text.split("#")[0].strip() for text in schema.decode().splitlines()]
    except UnicodeDecodeError as error:
        raise DataError(f"the schema of the {what} is damaged") from error
    for at, text in enumerate(filter(None, lines)):
        match = line.fullmatch(text)
        if match is None or at >= _MOST_FIELDS:
            raise DataError(f"the schema of the {what} is damaged, or of another kind")
        yield match.groups()


def layout_of(schema: bytes) -> np.dtype[np.void]:
    """The dtype of a message, its encapsulation included, of a definition made of 64-bit words.

    Raises
    ------
    DataError
        Anything else, fields of a tick with another type, or more than 1000 fields."""
    descriptors: list[tuple[str, str] | tuple[str, str, tuple[int, ...]]] = [("encapsulation", "V4")]
    for kind, count, name in lines_of(schema, _LINE, "ticks"):
        if name in FIELD and kind != TYPE_OF[FIELD[name].kind]:
            raise DataError(f"the schema of the ticks says that {name} is {kind}")
        shape = (int(count),) if count else ()
        descriptors.append((name, _TYPES[kind], shape))  # an empty shape is a scalar
    try:
        layout = np.dtype(descriptors)
    except ValueError as error:  # a name twice
        raise DataError("the schema of the ticks is damaged") from error
    if "tick" not in (layout.names or ()):
        raise DataError("the schema of the ticks has no field tick")
    return layout


@cache
def own_layout(n_axes: int) -> np.dtype[np.void]:
    """The dtype of a message as this version writes it."""
    return layout_of(schema_text(n_axes).encode())


def axes_of(layout: np.dtype[np.void]) -> int:
    """Number of axes of ticks with this layout; 0 where it does not say."""
    shape = layout["position_rad"].shape if "position_rad" in (layout.names or ()) else ()
    # a scalar: of a rig that this version could not read
    return int(shape[0]) if len(shape) == 1 else 0


def encode(rows: np.ndarray, channel: int, sequences: np.ndarray, times_ns: np.ndarray) -> np.ndarray:
    """MCAP message records of ticks; bytes of shape (n, bytes per record).

    Parameters
    ----------
    rows
        Ticks, shape (n,).
    channel
        Channel id.
    sequences, times_ns
        Number and log time (ns since 1970) of each message, shape (n,)."""
    # by a field that every rig has, with a number for each axis
    layout = own_layout(rows.dtype["position_rad"].shape[0])
    head = np.empty(len(rows), [*_HEAD, ("encapsulation", "V4")])
    head["op"], head["length"], head["channel"] = _MESSAGE, MESSAGE_HEAD - 9 + layout.itemsize, channel
    head["sequence"] = sequences & 0xFFFFFFFF  # 32 bits in MCAP: readers count on
    head["log"] = head["publish"] = times_ns
    head["encapsulation"] = np.void(ENCAPSULATION)
    out = np.empty((len(rows), MESSAGE_HEAD + layout.itemsize), np.uint8)
    out[:, : head.itemsize] = _matrix(head, np.uint8)
    words, (of_message, of_row) = _matrix(rows, np.uint64), _places(layout, rows.dtype)
    # places in the tick, in the order in which a message has them
    order = of_row[np.argsort(of_message)]
    for at in range(0, len(rows), _BLOCK):
        out[at : at + _BLOCK, head.itemsize :] = words[at : at + _BLOCK].take(order, axis=1).view(np.uint8)
    return out


def decode(
    records: bytes, starts: np.ndarray, ends: np.ndarray, layout: np.dtype[np.void], n_axes: int
) -> np.ndarray:
    """Ticks of the messages that lie in `records` from `starts` to `ends`, each of shape (n,).

    Of fields that the layout lacks the ticks say nothing (`forget`); those that are unknown are left out.

    Raises
    ------
    DataError
        Messages of another length or encoding than the layout's, or of a rig of another size."""
    rows = np.zeros(len(starts), tick_dtype(n_axes))
    known = [name for name in rows.dtype.names or () if name in (layout.names or ())]
    # a recording of before the field: no 0, which would be a value
    forget(rows, (name for name in rows.dtype.names or () if name not in known))
    if len(starts) == 0:
        return rows
    # before any is read: places in a message are those of the layout
    if (ends - starts != layout.itemsize).any():
        raise DataError("a recorded tick has another length than its schema says")
    if any(layout[name].shape != rows.dtype[name].shape for name in known):
        raise DataError("the recorded ticks are of a rig of another size")
    messages = _gathered(records, starts, layout.itemsize)
    # of another order of bytes or another padding every number would be read, and wrong
    if (messages[:, :4] != np.frombuffer(ENCAPSULATION, np.uint8)).any():
        raise DataError("a recorded tick is not little-endian CDR")
    words, (of_message, of_row) = _matrix(rows, np.uint64), _places(layout, rows.dtype)
    # every word from the first on is known: then they stand in the tick one behind the other
    whole = len(of_row) == of_row[-1] + 1
    place = slice(len(of_row)) if whole else of_row  # a slice is five times as quick
    for at in range(0, len(rows), _BLOCK):
        block = np.ascontiguousarray(messages[at : at + _BLOCK, 4:]).view(np.uint64)
        words[at : at + _BLOCK, place] = block.take(of_message, axis=1)
    return rows


def _matrix(records: np.ndarray, kind: type[np.generic]) -> np.ndarray:
    """Records as bytes or words, shape (n, each); the same memory where they are contiguous."""
    size = records.dtype.itemsize // np.dtype(kind).itemsize
    return np.ascontiguousarray(records).view(kind).reshape(len(records), size)


@cache
def _places(layout: np.dtype[np.void], row: np.dtype[np.void]) -> tuple[np.ndarray, np.ndarray]:
    """Words of a message that a tick has, and where the tick has them."""
    of_message: list[int] = []
    of_row: list[int] = []
    for name in row.names or ():
        if name in (layout.names or ()):
            size = row[name].itemsize // 8
            there, here = (placed(kind, name)[1] // 8 for kind in (layout, row))
            of_message += range(there, there + size)
            of_row += range(here, here + size)
    return np.array(of_message, np.int64), np.array(of_row, np.int64)


def _gathered(records: bytes, starts: np.ndarray, size: int) -> np.ndarray:
    """The messages' bytes, shape (n, size): a view where they follow one another evenly."""
    stride = MESSAGE_HEAD + size
    breaks = np.flatnonzero(np.diff(starts) != stride) + 1
    firsts, counts = starts[np.r_[0, breaks]], np.diff(np.r_[0, breaks, len(starts)])
    # a view of each run without a gap: events between two ticks part them
    runs = [
        np.ndarray((count, size), np.uint8, records, first, (stride, 1))
        for first, count in zip(firsts.tolist(), counts.tolist(), strict=True)
    ]
    return runs[0] if len(runs) == 1 else np.concatenate(runs)
