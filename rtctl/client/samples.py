"""What a client receives: typed state samples, tick rows, events and health."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from rtctl.control.vocabulary import Fault, State
from rtctl.errors import ClientError
from rtctl.tick import single_words, tick_dtype

# ten state samples of the default 100 a second
STALE_S = 0.1
"""Age of a sample from which it no longer tells what the rig does."""

Vector = tuple[float, ...]


@dataclass(frozen=True)
class RigState:
    """One decimated sample of the rig. Vectors have one value per axis; signs as in `rtctl.tick`.

    Attributes
    ----------
    timestamp
        Wall-clock time of the sample, s.
    monotonic_s
        The loop's clock at the sample, s.
    age_s
        Age when this object was made, s: how long ago the rig was like this; over TCP without the shortest
        way that a message took. NaN on a virtual clock.
    energy_hand_j, energy_port_j
        Net energy the hand has put in; what the passivity observer has seen the controller absorb. J.
    lease_held
        A renderer moves the proxy.
    fields
        Every field of the sample by its name in the tick record."""

    timestamp: float
    monotonic_s: float
    age_s: float
    tick: int
    position_rad: Vector
    velocity_rad_s: Vector
    hand_torque_nm: Vector
    torque_applied_nm: Vector
    feedforward_torque_nm: Vector
    energy_hand_j: Vector
    energy_port_j: Vector
    state: State
    epoch: int
    faults: tuple[Fault, ...]
    authority: float
    lease_held: bool
    missed_ticks: int
    command_seq: int
    session: int
    sequence: int
    fields: Mapping[str, Any]

    @property
    def stale(self) -> bool:
        """True when the rig was like this more than `STALE_S` ago: do not act on it."""
        return self.age_s > STALE_S

    def as_of(self, now_s: float) -> RigState:
        """A copy of this sample with its `age_s` as of `now_s` of CLOCK_MONOTONIC, s."""
        # from what was sent, not from the age it was made with: that would count the time here twice
        return replace(self, age_s=self.fields["age_s"] + now_s - self.fields["sent_monotonic_s"])


# by the class itself: a field that is added is read, too
_VECTORS = tuple(one.name for one in fields(RigState) if one.type == "Vector")


def rig_state(message: Mapping[str, Any], now_s: float | None = None) -> RigState:
    """Build a sample from one map of `rtctl/state`. Raises ClientError when it is not one."""
    now = time.monotonic() if now_s is None else now_s  # as of now, where nobody says when
    try:
        bits = int(message["faults"])
        return RigState(
            timestamp=message["timestamp"],
            monotonic_s=message["monotonic_s"],
            age_s=message["age_s"] + now - message["sent_monotonic_s"],
            tick=int(message["tick"]),
            **{name: tuple(message[name]) for name in _VECTORS},
            state=State(int(message["state"])),
            epoch=int(message["epoch"]),
            # faults that this version does not know are left out: their number means nothing here
            faults=tuple(fault for fault in Fault if bits & fault),
            authority=message["authority"],
            # get: recordings and daemons of before lack it
            lease_held=bool(message.get("lease_held", 0)),
            missed_ticks=int(message["missed_ticks"]),
            command_seq=int(message["command_seq"]),
            session=int(message["session"]),
            sequence=int(message["sequence"]),
            fields=message,
        )
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise ClientError(
            f"a state sample this client cannot read ({error!r}); is the daemon another version?"
        ) from error


def fill(rows: np.ndarray, columns: Mapping[str, Any]) -> None:
    """Take the fields of records, in one piece, from their columns; columns that this version does not know
    are left out."""
    words, n = single_words(rows.dtype), len(rows)
    places: list[int] = []  # words of a record that one column each fills
    together: list[bytes] = []
    for name in rows.dtype.names or ():
        # of an older daemon: the field stays 0
        if name not in columns:
            continue
        column, word = columns[name], words.get(name)
        data = column["data"]
        if (
            word
            and (column["dtype"], column["shape"]) == (word.dtype, [n, *word.shape])
            and len(data) == 8 * n
        ):
            places.append(word.place)
            together.append(data)
        else:
            # of another type or shape than here, of an older daemon: NumPy converts, or refuses
            rows[name] = np.frombuffer(data, np.dtype(column["dtype"])).reshape(column["shape"])
    if places:  # all at once: field by field takes twice as long
        table = rows.view((np.uint64, rows.dtype.itemsize // 8))
        table[:, places] = np.frombuffer(b"".join(together), np.uint64).reshape(len(places), n).T


def tick_rows(message: Mapping[str, Any]) -> np.ndarray:
    """Rebuild the structured array of a batch of `rtctl/ticks`; columns that are missing are 0.

    Raises
    ------
    ClientError
        A batch whose columns do not fit together."""
    try:
        columns = message["columns"]
        # by a column that every tick has: its second dimension is the axes
        position, n = columns["position_rad"], int(message["rows"])
        axes = position["shape"][1]
        if n * axes > len(position["data"]):  # before room is made for what did not come
            raise ValueError(f"{n} rows of {axes} axes in {len(position['data'])} bytes")
        rows = np.zeros(n, tick_dtype(axes))
        fill(rows, columns)
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise ClientError(
            f"a tick batch this client cannot read ({error!r}); is the daemon another version?"
        ) from error
    return rows
