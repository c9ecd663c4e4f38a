"""Processes that need the same function compiled at once: one compiles it, the others wait and load it.

On a first start loop and host need the same law. Locks are taken from caller to callee, so no two processes wait for each
other; the kernel lets go for a process that dies.
"""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PATIENCE_S = 60.0
"""Longest wait for one function. The other process may have stopped, or get no processor; then this one waits no more at all."""

_POLL_S = 0.02
_ours: set[Path] = set()
_given_up: set[Path] = set()


@contextmanager
def turn(lock: Path) -> Iterator[None]:
    """Be the only process between entry and exit, if that can be had in `PATIENCE_S`.

    Within a process it does not keep threads apart: Numba's own lock does.
    """
    if lock in _ours or _given_up:
        yield
        return
    descriptor = os.open(lock, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    _ours.add(lock)
    try:
        _wait(lock, descriptor)
        yield
    finally:
        _ours.discard(lock)
        os.close(descriptor)


def _wait(lock: Path, descriptor: int) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > deadline:
                _given_up.add(lock)
                return
            time.sleep(_POLL_S)
        else:
            return
