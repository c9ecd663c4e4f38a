"""What makes a daemon that `lanes.py` has born a short-lived one: it is ready and armed sooner (`QUICK`), and
its loop is punctual.
"""

import contextlib
import ctypes
import os
import signal

import nursery

from rtctl.check import law_plan as plan

QUICK = {
    "READY_S": 0.1,
    "SOFT_START_S": 0.3,
    "MIN_SOFT_START_TICKS": 10,
    "ARMING_PART_S": 0.06,
    "STALE_LIMIT_TICKS": 6,
    "LATE_LIMIT_TICKS": 30,
}
"""Life is short here: ready after 0.1 s; parts of the test pulse that are several ticks at 100 Hz; and a rig
that survives the lateness of a machine that runs six rigs and other tests. The board's time to live is as
ever."""

_PR_SET_PDEATHSIG = 1


def live_shortly():
    """Called in the daemon, before it begins."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    for name, value in QUICK.items():
        setattr(plan, name, value)
    nursery.at_birth_of_a_loop.append(_be_punctual)


def _be_punctual():
    # without the locked memory that comes with all rights of a loop: 300 MB of each of six
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
