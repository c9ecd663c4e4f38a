"""A user or service that may have no more processes or threads: what was refused is named, before a device is
open.
"""

import errno
import os
import threading
from pathlib import Path

import pytest

from rtctl.errors import RtctlError
from rtctl.host import waiting_loop
from rtctl.host.waiting_loop import WaitingLoop, require_threads


def test_a_loop_process_that_cannot_be_started_is_named_and_leaves_nothing(monkeypatch):
    def refuse(*_given, **_named):
        raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    monkeypatch.setattr(waiting_loop.subprocess, "Popen", refuse)
    before = sorted(Path("/proc/self/fd").iterdir())
    with pytest.raises(RtctlError, match=r"the loop process cannot be started .*TasksMax"):
        WaitingLoop()
    assert sorted(Path("/proc/self/fd").iterdir()) == before


def test_threads_that_are_refused_are_named_and_those_that_were_begun_end(monkeypatch):
    begun, start = [], threading.Thread.start

    def refuse_the_third(thread):
        if len(begun) == 2:
            raise RuntimeError("can't start new thread")
        begun.append(thread)
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", refuse_the_third)
    with pytest.raises(RtctlError, match=r"no more threads .*TasksMax"):
        require_threads()
    for thread in begun:
        thread.join()
