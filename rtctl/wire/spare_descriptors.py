"""Descriptors kept in reserve, for what has to work when a crowd has taken all others."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator

RESERVE = 16
"""To open a socket of libzmq with its monitor takes seven."""


class Reserve:
    """Holds descriptors open to nothing."""

    def __init__(self, count: int = RESERVE) -> None:
        self._count = count
        self._held: list[int] = []
        self._fill()

    @contextlib.contextmanager
    def lent(self) -> Iterator[None]:
        """While this lasts they are free for others; afterwards as many are taken back as there are."""
        self.close()
        try:
            yield
        finally:
            self._fill()

    def close(self) -> None:
        """Give them up. Idempotent."""
        while self._held:
            os.close(self._held.pop())

    def _fill(self) -> None:
        with contextlib.suppress(OSError):
            while len(self._held) < self._count:
                self._held.append(os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC))
