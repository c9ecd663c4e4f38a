"""Cuts a byte stream into frames of one length that begin with a header and end with a checksum.

A header may also occur inside the data, so only the checksum decides what a frame is. In step with the stream
the next frame begins where the last one ended; after damage the search goes on one byte further."""

from __future__ import annotations

from collections.abc import Callable


class Frames:
    """The frames of one stream. What came before the first intact frame is skipped without a word.

    Parameters
    ----------
    header
        First bytes of every frame.
    length
        Bytes of a whole frame.
    intact
        Tells whether `length` bytes that begin with the header carry the right checksum.

    Attributes
    ----------
    good, damaged : int
        Intact frames, and places where one was due and none stood."""

    def __init__(self, header: bytes, length: int, intact: Callable[[bytes], bool]) -> None:
        self._header, self._length, self._intact = header, length, intact
        self._rest = b""
        self._in_step = False
        # not in step yet: who listens first to a running stream hears half a frame, which is no damage
        self.good = self.damaged = 0

    def newest(self, data: bytes) -> bytes | None:
        """Take in bytes; the last intact frame they complete, or None. Keeps less than one frame back."""
        # a read ends anywhere: what is left of a frame stands before the bytes that complete it
        stream = self._rest + data if self._rest else data
        header, length = self._header, self._length
        at, found = 0, None
        while True:
            # by the C code of `bytes`: 1 us for 4095 bytes, where a loop in Python takes 500
            start = stream.find(header, at)
            # bytes between two frames: lost or added ones, counted once, however many they are
            if start != at and self._in_step and self._begun(stream, at):
                self._in_step = False
                self.damaged += 1
            if start < 0:
                # what may be the beginning of a header is kept
                # one byte less than a header: with it whole, `find` would have found it
                self._rest = stream[max(at, len(stream) - len(header) + 1) :]
                return found
            # the header may be data, too: the checksum of the whole frame decides
            frame = stream[start : start + length]
            if len(frame) < length:
                self._rest = frame
                return found
            if self._intact(frame):
                self.good += 1
                self._in_step = True
                # not returned yet: a newer frame may stand behind it, and only the newest is shown
                found, at = frame, start + length
            else:
                if self._in_step:
                    self._in_step = False
                    self.damaged += 1
                # one byte on, not a frame: the true header may stand within what was taken for one
                at = start + 1

    def _begun(self, stream: bytes, at: int) -> bool:
        """True when the bytes at hand cannot be the beginning of a frame."""
        # a part of a header at the end of a read is no damage, and an empty one neither
        begun = stream[at : at + len(self._header)]
        return not self._header.startswith(begun)

    def forget(self) -> None:
        """Drop what is kept of an unfinished frame: bytes were lost behind it."""
        self._rest = b""
        self._in_step = False
