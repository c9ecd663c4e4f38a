"""Descriptors 0, 1 and 2 lead somewhere, whoever started this process.

A program started with one of them closed gets its number for the next file it opens. What is then written for
a person goes into that file: into the memory shared with the loop, say, or into the rig's lock."""

from __future__ import annotations

import fcntl
import os
import sys

FIRST_OWN = 3
"""Descriptors below are those of the standard streams."""


def open_standard_streams() -> None:
    """Open to nothing what of them is closed. Call it before anything else is opened."""
    # the lowest free number is given: it is asked until that is none of theirs
    while (fd := os.open(os.devnull, os.O_RDWR)) < FIRST_OWN:
        os.set_inheritable(fd, True)
    os.close(fd)
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115, PTH123 - as long as the process


def above_standard_streams(fd: int) -> int:
    """A descriptor of the file of `fd` above those of the standard streams; `fd` is closed if it was one of
    theirs."""
    if fd >= FIRST_OWN:
        return fd
    try:
        return fcntl.fcntl(fd, fcntl.F_DUPFD_CLOEXEC, FIRST_OWN)
    finally:
        os.close(fd)
