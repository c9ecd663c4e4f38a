"""A bag of ROS 2 as a log: the joint states in an MCAP file, a column for each joint and quantity,
`/joint_states/elbow/position`.

Only `sensor_msgs/msg/JointState` in CDR, little-endian, as rosbag2 writes it. A stamp is that of the
message's header; of messages without one, when they were recorded."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path

import numpy as np

from rtctl.errors import DataError
from rtctl.recording.mcap_scan import Contents, chunks

SCHEMA = "sensor_msgs/msg/JointState"

QUANTITIES = ("position", "velocity", "effort")

# a longer list is a damaged length, not a robot
MOST_JOINTS = 1000


OVERTAKEN = 5
"""Most places by which a message may have come before or behind its turn: threads overtake each other by one
or two; a clock that is set back moves all that follows."""


@dataclass(frozen=True)
class JointState:
    """One message: stamp in ns (0 without one), joints, and position, velocity and effort of each (empty
    where they were not told)."""

    stamp_ns: int
    names: tuple[str, ...]
    values: tuple[np.ndarray, np.ndarray, np.ndarray]


class _Cdr:
    """Reads little-endian CDR; places are aligned to what stands there, counted behind the four bytes of
    encapsulation."""

    def __init__(self, data: bytes) -> None:
        # as rosbag2 writes on little-endian machines; parameter lists and XCDR2 align otherwise
        if data[:2] != b"\x00\x01":
            raise ValueError("not little-endian CDR")
        self.data, self.at = data[4:], 0

    def _aligned(self, size: int) -> int:
        # up to the next multiple: -at % size is what is missing
        self.at += -self.at % size
        return self.at

    def number(self, kind: str) -> int:
        size = struct.calcsize(kind)
        (value,) = struct.unpack_from("<" + kind, self.data, self._aligned(size))
        self.at += size
        return int(value)

    def string(self) -> str:
        size = self.number("I")
        text = self.data[self.at : self.at + size]
        if len(text) < size:
            raise ValueError("cut off")
        self.at += size
        return text.rstrip(b"\x00").decode()

    def doubles(self) -> np.ndarray:
        count = self.number("I")
        # no padding before an element that is not there: what follows stands right behind the length
        if not count:
            return np.zeros(0)
        start = self._aligned(8)
        self.at += 8 * count
        return np.frombuffer(self.data, "<f8", count, start)


def decoded(data: bytes) -> JointState:
    """Decode one message. Raises ValueError for one that is damaged."""
    cdr = _Cdr(data)
    try:
        seconds, nanoseconds = cdr.number("i"), cdr.number("I")
        # the frame of the header: nothing that a joint needs
        cdr.string()
        count = cdr.number("I")
        if count > MOST_JOINTS:
            raise ValueError(f"{count} joints")
        names = tuple(cdr.string() for _ in range(count))
        values = cdr.doubles(), cdr.doubles(), cdr.doubles()
    except struct.error as error:
        raise ValueError(str(error)) from error
    return JointState(seconds * 10**9 + nanoseconds, names, values)


def read_joint_states(path: Path, wanted: Sequence[str] = ()) -> Mapping[str, np.ndarray]:
    """Columns of every joint of every topic of joint states, (n,) each, and `time_s` of the first topic
    (`TOPIC/time_s` of each); of the messages with the joints of the `wanted` columns, or of the first one.

    Raises
    ------
    DataError
        No MCAP file, or none with joint states."""
    contents = Contents()
    # by channel first: what is in it may be told within chunks, and for us only at the end of the file
    found: dict[int, list[tuple[int, bytes]]] = {}
    for chunk in chunks(path, contents):
        for channel, _, time_ns, start, end in chunk.table.tolist():
            found.setdefault(channel, []).append((time_ns, chunk.records[start:end]))
    topics: dict[str, list[tuple[int, bytes]]] = {}
    for channel, messages in sorted(found.items()):
        if contents.numbered.get(contents.kinds.get(channel, -1)) == SCHEMA:
            # a topic has several channels where bags were merged, or two programs published it
            topics.setdefault(contents.topics[channel], []).extend(messages)
    columns: dict[str, np.ndarray] = {}
    for topic, messages in sorted(topics.items()):
        messages.sort(key=itemgetter(0))  # a bag promises no order, and of two channels there is none
        columns |= _columns(topic, messages, wanted)
    if not columns:
        if topics:
            raise DataError(
                f"{path}: no message of {next(iter(topics))} can be read: packed one by one, or no CDR; "
                "write the bag anew without that (ros2 bag convert), or export the topic as CSV"
            )
        # the topic is declared before its first message: a recorder that saw none writes it all the same
        empty = [
            contents.topics[k] for k, kind in contents.kinds.items() if contents.numbered.get(kind) == SCHEMA
        ]
        if empty:
            raise DataError(
                f"{path}: a bag without a message of {empty[0]} (empty, or cut off before the first); record "
                "again while the joint states are published"
            )
        seen = ", ".join(sorted(contents.topics.values())) or "none"
        raise DataError(
            f"{path}: neither a recording of rtctl nor a bag with {SCHEMA} (topics: {seen[:300]}); export "
            "the topic as CSV"
        )
    # a bag of one topic, which most are, has its time under the plain name, too
    first = next(name for name in columns if name.endswith("/time_s"))
    return {"time_s": columns[first], **columns}


def _columns(topic: str, messages: list[tuple[int, bytes]], wanted: Sequence[str]) -> dict[str, np.ndarray]:
    states = []
    for recorded_ns, data in messages:
        try:
            state = decoded(data)
        except (ValueError, UnicodeDecodeError):
            continue
        states.append((recorded_ns, state))
    if not states:
        return {}
    # 0 throughout: a publisher that fills no header; a first one of 0 is how the clock of a simulation begins
    if any(state.stamp_ns for _, state in states):
        states = _in_turn([(state.stamp_ns, state) for _, state in states])
    joints = dict.fromkeys(name for _, state in states for name in state.names)
    asked = {name for name in joints if any(each.startswith(f"{topic}/{name}/") for each in wanted)}
    # else the joints of the first message: a bag may mix an arm's with a gripper's
    asked = asked or set(states[0][1].names)
    states = [(ns, state) for ns, state in states if asked <= set(state.names)]
    if not states:
        raise DataError(
            f"{topic} has no message with all of {', '.join(sorted(asked))}: name the columns of one joint, "
            "or of joints that are told together"
        )
    names = [name for name in joints if all(name in state.names for _, state in states)]
    stamps = np.array([ns for ns, _ in states], np.int64)
    columns = {f"{topic}/time_s": (stamps - stamps[0]) * 1e-9}
    for name in names:
        at = [state.names.index(name) for _, state in states]
        for k, quantity in enumerate(QUANTITIES):
            # velocity and effort may be left empty, as the message allows
            if all(len(state.values[k]) > place for (_, state), place in zip(states, at, strict=True)):
                values = [state.values[k][place] for (_, state), place in zip(states, at, strict=True)]
                columns[f"{topic}/{name}/{quantity}"] = np.array(values)
    return columns


def _in_turn(states: list[tuple[int, JointState]]) -> list[tuple[int, JointState]]:
    """Messages by their stamps, where none is far from its turn; else as they came, for the reader to refuse:
    by its stamps two runs of a clock that was set back would be one."""
    order = sorted(range(len(states)), key=lambda k: states[k][0])
    near = max((abs(k - place) for place, k in enumerate(order)), default=0) <= OVERTAKEN
    return [states[k] for k in order] if near else states
