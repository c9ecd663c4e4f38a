"""The signals of the host process: counted where they arrive, looked at by the one thread that polls."""

from __future__ import annotations

import contextlib
import os
import signal


class Signals:
    """Counts SIGINT and SIGTERM (`ends`; `terminated`: a SIGTERM was among them) and SIGHUP (`hangups`) from
    now on, until `close`. Main thread only.

    A SIGHUP by which the terminal says that it is gone is an end: nobody is at this program any more. Under
    `nohup` it is not.

    Any signal makes `fileno()` readable until `drain`, so a poll ends at once."""

    def __init__(self) -> None:
        self.ends = 0
        self.hangups = 0
        self.terminated = False
        self._at_terminal = _has_terminal() and signal.getsignal(signal.SIGHUP) != signal.SIG_IGN
        # a pipe, as a handler of Python runs between two of its instructions only, and a poll is one
        self._read, self._write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        # a poll in C is ended by it at once; a full pipe wakes as well, so no warning
        self._old_wakeup = signal.set_wakeup_fd(self._write, warn_on_full_buffer=False)
        self._old = {
            number: signal.signal(number, self._on_end) for number in (signal.SIGINT, signal.SIGTERM)
        }
        self._old[signal.SIGHUP] = signal.signal(signal.SIGHUP, self._on_hangup)
        # In the background of a terminal set to `tostop`, a word would stop the whole process.
        self._old[signal.SIGTTOU] = signal.signal(signal.SIGTTOU, signal.SIG_IGN)

    def fileno(self) -> int:
        """For a poller."""
        return self._read

    def drain(self) -> None:
        """Make `fileno()` wait for the next signal."""
        with contextlib.suppress(BlockingIOError):
            os.read(self._read, 4096)

    def close(self) -> None:
        """Put back the signal handlers that were there before this object, and close its pipe."""
        for number, handler in self._old.items():
            signal.signal(number, handler)
        # before the pipe goes: its number may be another file's by the next signal
        signal.set_wakeup_fd(self._old_wakeup)
        os.close(self._read)
        os.close(self._write)

    def _on_end(self, number: int, _frame: object) -> None:
        self.ends += 1
        self.terminated |= number == signal.SIGTERM

    def _on_hangup(self, _signal: int, _frame: object) -> None:
        if self._at_terminal and not _has_terminal():
            # kernel and shell both send it, and a second end would cut
            self.ends = max(self.ends, 1)
        else:
            self.hangups += 1


def _has_terminal() -> bool:
    try:
        # ENXIO where this process has no controlling terminal (any more): isatty(2) of a descriptor tells
        # less
        os.close(os.open("/dev/tty", os.O_RDONLY | os.O_NOCTTY | os.O_CLOEXEC))
    except OSError:
        return False
    return True
