"""A loop process that waits for its rig: it imports what a loop needs while the host reads and proves the rig file.

Imports little: it is made before anything heavy is imported in the host.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
from typing import Self

from rtctl.rt.birth import OF_THE_TERMINAL
from rtctl.standard_streams import above_standard_streams


class WaitingLoop:
    """A loop process that has no order yet: it knows no device, and opens none.

    A context manager: leaving ends the process at once and without a word, unless it was given an order.

    Attributes
    ----------
    process
        What was started. Its standard output is a pipe to this process.
    """

    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        self._line: socket.socket | None = ours
        line = above_standard_streams(theirs.detach())
        held = signal.pthread_sigmask(signal.SIG_BLOCK, OF_THE_TERMINAL)  # until it ignores them
        try:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "rtctl.rt", str(line), str(os.getpid())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                pass_fds=(line,),
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
            )
        except BaseException:
            ours.close()
            raise
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, held)
            os.close(line)

    def order(self, text: bytes, *descriptors: int) -> None:
        """Say what to run, once, with the descriptors it needs: those of the shared memory and of the rig's lock."""
        assert self._line is not None
        with self._line as line, contextlib.suppress(BrokenPipeError, ConnectionResetError):
            sent = socket.send_fds(line, [text], descriptors)  # has it died, its end is told as any other
            line.sendall(text[sent:])
        self._line = None

    def close(self) -> None:
        """End it, if it was given no order. Idempotent."""
        if self._line is None:
            return
        self._line.close()
        self._line = None
        self.process.kill()
        self.process.wait()
        if self.process.stdout is not None:
            self.process.stdout.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()
