"""A frame that comes in several CAN frames, put together."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hw.can.fields import Buffer


class Parts:
    """A frame that comes in several, all of one identifier: the first is told by its numbers, the others
    follow it."""

    def __init__(self, lengths: Sequence[int], begins: Callable[[Buffer, int], bool] | None) -> None:
        self.lengths, self._begins = tuple(lengths), begins
        self._data, self._n = bytearray(), 0

    def forget(self) -> None:
        """Drop what is there of a frame."""
        self._n = 0

    def add(self, buffer: Buffer, offset: int, length: int) -> bytearray | None:
        """Take a part; the whole frame once it has all of them. A part of another length, or out of turn,
        ends it."""
        if length != self.lengths[self._n]:
            # what came may be the first part of the next frame: it is looked at below
            self._n = 0
            # neither the next part nor a first one: whatever it is, a frame begins anew behind it
            if length != self.lengths[0]:
                return None
        if self._n == 0:
            if self._begins is not None and not self._begins(buffer, offset):
                return None
            self._data = bytearray()
        self._data += buffer[offset : offset + length]
        self._n += 1
        if self._n < len(self.lengths):
            return None
        self._n = 0
        return self._data
