"""The first moments of the loop process: it must not outlive its host, nor be ended by a terminal.

Imports nothing that takes time: the 0.7 s in which the rest is imported are long enough for the host to die.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys

from rtctl.standard_streams import open_standard_streams

_PR_SET_PDEATHSIG = 1

OF_THE_TERMINAL = frozenset({signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP})
"""Sent by a terminal to every process in it. They are for the host, which says what the loop shall do."""


def be_guarded(host: int) -> None:
    """Die with the process `host`, ignore what a terminal sends, have all three standard descriptors open.

    Ends this process at once if the host has gone already: the kernel announces only deaths that are to come.
    """
    die_with(host)
    # ignored before they are let through again: one that waits must not end this process
    for number in OF_THE_TERMINAL:
        signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, OF_THE_TERMINAL)  # the host held them back until now
    open_standard_streams()


def die_with(host: int) -> None:
    """Have the kernel send SIGTERM when the host process dies, so that the rig is stopped."""
    # its parent is the thread that started it (prctl(2)): the host does so in its main one
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
    if os.getppid() != host:
        sys.exit(1)
