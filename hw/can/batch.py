"""All frames that wait on a CAN socket in one system call (recvmmsg), into one buffer.

A call per frame costs as much as decoding it, and the call that finds nothing more costs an exception."""

from __future__ import annotations

import ctypes
import errno
import os
import socket

# 4 ms of a full bus of 1 Mbit/s: one call takes all that a cycle of 1 kHz finds
FRAMES = 32
STRIDE = 72
"""Bytes of the buffer from one frame to the next: room for a CAN FD frame."""


class _Piece(ctypes.Structure):
    """struct iovec."""

    _fields_ = (("base", ctypes.c_void_p), ("length", ctypes.c_size_t))


class _Header(ctypes.Structure):
    """struct msghdr."""

    _fields_ = (
        ("name", ctypes.c_void_p),
        ("name_length", ctypes.c_uint32),
        ("pieces", ctypes.POINTER(_Piece)),
        ("n_pieces", ctypes.c_size_t),
        ("control", ctypes.c_void_p),
        ("control_length", ctypes.c_size_t),
        ("flags", ctypes.c_int),
    )


class _Message(ctypes.Structure):
    """struct mmsghdr."""

    _fields_ = (("header", _Header), ("received", ctypes.c_uint))


class Batch:
    """Up to `FRAMES` frames of the socket with descriptor `fd`.

    Attributes
    ----------
    buffer
        Frame k, as the kernel gives it, begins at `buffer[k * STRIDE]`.
    address
        Of the `FRAMES` struct mmsghdr that lead there."""

    def __init__(self, fd: int) -> None:
        # made once and kept: the structures below hold its address
        self.buffer = bytearray(FRAMES * STRIDE)
        # exported: a bytearray that the kernel writes into can no longer be resized
        self._held = (ctypes.c_char * len(self.buffer)).from_buffer(self.buffer)
        start = ctypes.addressof(self._held)
        # an attribute, not a local: the kernel writes where they point for as long as this lives
        self._pieces = (_Piece * FRAMES)(*(_Piece(start + k * STRIDE, STRIDE) for k in range(FRAMES)))
        self._messages = (_Message * FRAMES)()
        for message, piece in zip(self._messages, self._pieces, strict=True):
            message.header.pieces, message.header.n_pieces = ctypes.pointer(piece), 1
        # ctypes keeps a copy of errno at the call: Python code in between changes the C one
        self._call = ctypes.CDLL(None, use_errno=True).recvmmsg
        self._call.argtypes = (ctypes.c_int, ctypes.c_void_p, ctypes.c_uint, ctypes.c_int, ctypes.c_void_p)
        self._fd = ctypes.c_int(fd)
        self.address = ctypes.addressof(self._messages)
        self._where = ctypes.c_void_p(self.address)
        # made once: a call makes no object but the number that it returns
        self._room, self._flags = ctypes.c_uint(FRAMES), ctypes.c_int(socket.MSG_DONTWAIT)

    def take(self) -> int:
        """Number of frames received, 0 when none waits. Never blocks. Raises OSError."""
        n: int = self._call(self._fd, self._where, self._room, self._flags, None)
        if n < 0:
            code = ctypes.get_errno()
            # nothing waits, or a signal came (stop, shutdown): both are told by the next look
            if code in (errno.EAGAIN, errno.EINTR):
                return 0
            raise OSError(code, os.strerror(code))
        return n

    def aim(self, fd: int) -> None:
        """Take the frames of this socket from now on."""
        self._fd = ctypes.c_int(fd)

    def close(self) -> None:
        """Use no descriptor any more: its number may soon be another's."""
        self.aim(-1)
