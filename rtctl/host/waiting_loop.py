"""A loop process that waits for its rig: it imports what a loop needs while the host reads and proves the rig
file.

Imports little: it is made before anything heavy is imported in the host."""

from __future__ import annotations

import contextlib
import errno
import os
import signal
import socket
import subprocess
import sys
import threading
from typing import Self

from hw import installed_anew  # first of all: it notes what is installed now
from rtctl.errors import RtctlError
from rtctl.rt.birth import OF_THE_TERMINAL
from rtctl.standard_streams import above_standard_streams

MORE_TASKS = "allow this user or service more processes and threads (`ulimit -u`, TasksMax= of its unit)"


def require_one_version() -> None:
    """Raise RtctlError where rtctl was installed anew since this process began: it and its loop may have read
    some of either version."""
    if installed_anew():
        raise RtctlError("rtctl was installed anew while it started: start it again")


def require_threads(count: int = 4) -> None:
    """Raise RtctlError where this process may not start so many threads (ZeroMQ's two, and the recorders').

    Asked before ZeroMQ does: it ends the process where it is refused one, without a name."""
    enough = threading.Event()
    try:
        for _ in range(count):
            threading.Thread(target=enough.wait, daemon=True).start()
    except RuntimeError as error:
        raise RtctlError(f"the host may start no more threads ({error}): {MORE_TASKS}") from error
    finally:
        enough.set()


class WaitingLoop:
    """A loop process that does not drive yet: it opens no device.

    A context manager: leaving ends the process at once and without a word, unless it was told to begin.

    Attributes
    ----------
    process
        What was started. Its standard output is a pipe to this process."""

    def __init__(self) -> None:
        self._line, theirs = socket.socketpair()  # a Unix socket: descriptors are sent over it (SCM_RIGHTS)
        self._order: bytes | None = None
        self._began = False
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
        except OSError as error:  # EAGAIN, ENOMEM: said with what was refused
            self._line.close()
            said = f"the loop process cannot be started ({error.strerror})"
            raise RtctlError(f"{said}: {MORE_TASKS}" if error.errno == errno.EAGAIN else said) from error
        except BaseException:
            self._line.close()
            raise
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, held)
            os.close(line)

    def prepare(self, order: bytes) -> None:
        """Say which rig it is going to be: it loads, or compiles, what that needs, and opens no device. Once,
        or the same again.

        Raises
        ------
        ValueError
            It prepares for another order."""
        if self._order is None:
            self._order = order
            self._tell(order)
        elif self._order != order:
            raise ValueError("this loop process prepares for another rig")

    def begin(self, *descriptors: int) -> None:
        """Have it drive the rig, with the descriptors it needs: those of the shared memory and of the rig's
        lock."""
        self._tell(b"\n", *descriptors)
        self._line.close()
        self._began = True

    def _tell(self, text: bytes, *descriptors: int) -> None:
        # has it died, its end is told as any other
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            sent = socket.send_fds(self._line, [text], descriptors)
            # a stream takes what fits; the descriptors went with its first byte
            self._line.sendall(text[sent:])

    def close(self) -> None:
        """End it, if it was not told to begin. Idempotent."""
        if self._began:
            return
        self._began = True
        self._line.close()
        # killed, not asked: it has opened nothing, and may be in the middle of an import
        self.process.kill()
        self.process.wait()
        if self.process.stdout is not None:
            self.process.stdout.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()
