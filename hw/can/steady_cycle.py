"""Reading and writing of a CAN device as compiled halves of a cycle: what `CanBackend.read` and `write` do
while nothing happens but samples and commands.

Whatever else comes is left to them: frames that were taken from the kernel and not decoded yet are kept for
Python, which goes on with the first of them."""

from __future__ import annotations

import numpy as np

from hw.can.batch import FRAMES, STRIDE
from hw.can.bus import DRAIN_LIMIT, ERROR, LINE_FULL, SILENT_TICKS, UNKNOWN_AGE_TICKS
from hw.can.steady_codec import is_for_python, is_writable, put, take
from hw.can.steady_line import END, next_line, put_line
from hw.can.steady_records import ON, TOLD
from hw.interface import LinkFault
from hw.jit import compiled
from hw.system_calls import FAILED, last_error, read_some, receive_many, write_all

DATA_AT = 8
"""Where the data of a frame begins; before it lie identifier (4 bytes) and length (1)."""

_LOST, _DEVICE = int(LinkFault.LOST), int(LinkFault.DEVICE)

_MORE, _DRAINED, _PYTHON = range(3)


@compiled
def _key(data: np.ndarray, at: int) -> int:
    """Identifier with flags of the frame that begins at `data[at]`."""
    key = np.int64(0)
    for k in range(4):
        key |= np.int64(data[at + k]) << (8 * k)
    return int(key)


@compiled
def _serve(
    b: np.record,
    inbox: np.ndarray,
    frames: np.ndarray,
    numbers: np.ndarray,
    values: np.ndarray,
    scratch: np.ndarray,
) -> bool:
    """Decode frames `b.at` to `b.n` of the inbox. False at the first that is for Python."""
    while b.at < b.n:
        head = b.at * STRIDE
        key, length, data = _key(inbox, head), int(inbox[head + 4]), head + DATA_AT
        # the state of the controller decides over everything: Python has the rules (`hw.can.health`)
        if key & ERROR:
            return False
        # before any is decoded: a frame that is left to Python must not count twice
        for k in range(b.frames):
            if frames[k].key == key and is_for_python(inbox, data, length, frames[k], numbers):
                return False
        for k in range(b.frames):
            if frames[k].key == key:
                take(inbox, data, length, frames[k], numbers, b, values, scratch)
        # after all tables have had it: what is left for Python begins with the frame that it has to see
        b.at += 1
    return True


@compiled
def _from_socket(
    b: np.record,
    inbox: np.ndarray,
    frames: np.ndarray,
    numbers: np.ndarray,
    values: np.ndarray,
    scratch: np.ndarray,
) -> int:
    """Take all frames that wait on a socket."""
    for _ in range(DRAIN_LIMIT // FRAMES):
        n = receive_many(b.fd, b.messages_at, FRAMES)
        if n == FAILED:
            b.error = last_error()
            return _PYTHON
        # said before they are looked at: leaving in the middle keeps those that follow
        b.at, b.n = 0, n
        if not _serve(b, inbox, frames, numbers, values, scratch):
            return _PYTHON
        # one call less: a batch that is not full has found the end of the queue
        if n < FRAMES:
            return _DRAINED
    return _MORE


@compiled
def _from_line(
    b: np.record,
    inbox: np.ndarray,
    chunk: np.ndarray,
    frames: np.ndarray,
    numbers: np.ndarray,
    values: np.ndarray,
    scratch: np.ndarray,
) -> int:
    """Take all frames that wait on the port of an adapter that writes lines. `chunk` holds `b.left` bytes
    from `b.begin` on.

    One read takes all that the kernel's line discipline holds; where that was full, more waits behind it."""
    # to the front of the chunk: behind it there is then room for all that a read can bring
    for k in range(b.left):  # the beginning of a line, left by the cycle before
        chunk[k] = chunk[b.begin + k]
    n, begin = read_some(b.fd, chunk[b.left :]), 0
    end = b.left + max(n, 0)
    while True:
        # kept up to date at each step: whoever takes the device back finds the bytes that nobody has read
        b.begin, b.left = begin, end - begin
        used, is_frame = next_line(chunk, begin, end - begin, inbox)
        if used < 0 or n == FAILED:
            return _PYTHON
        if used == 0:
            return _MORE if n >= LINE_FULL else _DRAINED
        begin += used
        b.begin, b.left = begin, end - begin
        b.at, b.n = 0, 1 if is_frame else 0
        if not _serve(b, inbox, frames, numbers, values, scratch):
            return _PYTHON


@compiled
def read_cycle(
    bus: np.ndarray,
    inbox: np.ndarray,
    chunk: np.ndarray,
    frames: np.ndarray,
    numbers: np.ndarray,
    values: np.ndarray,
    taken: np.ndarray,
    scratch: np.ndarray,
    shown: np.ndarray,
    words: np.ndarray,
    floats: np.ndarray,
) -> int:
    """Newest sample into the tick; 0, or 1 to leave what is not done yet to `CanBackend.read`."""
    b = bus[0]
    if b.on != ON:
        return 1
    b.faults = 0
    if b.ascii:
        drained = _from_line(b, inbox, chunk, frames, numbers, values, scratch)
    else:
        drained = _from_socket(b, inbox, frames, numbers, values, scratch)
    if drained == _PYTHON:
        return 1
    slot = words[b.slot_at]
    if drained == _MORE or slot - b.slot > UNKNOWN_AGE_TICKS:
        b.fresh = 0
    # what was left waiting is of this cycle at best: for the next one its age is not known either
    b.slot = slot - UNKNOWN_AGE_TICKS if drained == _MORE else slot
    faults = b.faults | b.standing_faults
    # boards that tell a fault by a flag: it stands until a frame says otherwise, not for one cycle
    for k in range(b.frames):
        if frames[k].fault:
            faults |= _DEVICE
    if b.fresh == b.needed:
        for k in range(len(taken)):
            taken[k] = values[k]
        b.estop_taken = b.estop
        b.fresh, b.silent = 0, 0
        b.count += 1
    else:
        b.silent += 1
        if b.silent > SILENT_TICKS:
            faults |= _LOST
    for k in range(b.shown):
        floats[shown[k, 0]] = taken[shown[k, 1]]
    if b.estop_at >= 0:
        words[b.estop_at] = b.estop_taken
    words[b.count_at] = b.count
    words[b.faults_at] = faults
    return 0


@compiled
def write_cycle(
    bus: np.ndarray,
    line: np.ndarray,
    commands: np.ndarray,
    entries: np.ndarray,
    packets: np.ndarray,
    words: np.ndarray,
    floats: np.ndarray,
) -> int:
    """Commands out; 0, or 1 to leave it to `CanBackend.write`. A frame that found no room is told in the next
    cycle."""
    b = bus[0]
    if b.on != ON or b.passed >= b.budget or words[b.enabled_at] != b.enabled:
        return 1
    # all before the first is sent: a board that got half of a cycle's commands would be out of step
    for k in range(b.commands):
        if not is_writable(commands[k], entries, floats):
            return 1
    for k in range(b.commands):
        r, packet = commands[k], packets[k]
        put(packet, DATA_AT, r, entries, floats)
        if b.ascii:
            begin = 0
            # the line before may have been taken in part: an end of line first, as `SlcanBus.send` does
            if b.on == TOLD:
                line[0], begin = END, 1
            size = begin + put_line(packet, _key(packet, 0), r.length, line[begin:])
            r.outcome = write_all(b.fd, line, size)
        else:
            r.outcome = write_all(b.fd, packet, b.frame_bytes)
        if r.outcome == FAILED:
            b.error = last_error()
            return 1
        # the other frames still go out; what it means for the bus, Python counts in the next cycle
        if r.outcome == 0:
            b.on = TOLD
    b.passed += 1
    return 0
