import os
import signal
import subprocess
import sys

import pytest

from rtctl.host.loop_process import LoopProcess, is_dying

LEAVE = """
import os, threading, types, zmq
from rtctl.host.loop_process import LoopProcess

zmq.Context.instance().socket(zmq.PUB).bind("inproc://here")
threading.Thread(target=threading.Event().wait, daemon=True).start()
core = max(os.sched_getaffinity(0))
before = [os.sched_getaffinity(int(thread)) for thread in os.listdir("/proc/self/task")]
loop = types.SimpleNamespace(core=core, _left={})
LoopProcess.leave_it_its_core(loop)
after = [os.sched_getaffinity(int(thread)) for thread in os.listdir("/proc/self/task")]
assert len(after) == len(before) >= 4, after
assert after == [one - {core} or one for one in before], after
LoopProcess._come_back(loop)
assert [os.sched_getaffinity(int(thread)) for thread in os.listdir("/proc/self/task")] == before
"""


def test_every_thread_of_the_host_leaves_the_loop_its_core():
    """ZeroMQ's threads, which write to each subscriber, had stayed there. After the run each is back: else
    the loop of a second one in the same process shared its core with the host.
    """
    subprocess.run([sys.executable, "-c", LEAVE], check=True)


@pytest.mark.parametrize(("taken", "core"), [({3}, 3), ({0, 1}, -1), (OSError, -1)])
def test_the_loops_core_is_the_one_it_keeps_to(monkeypatch, taken, core):
    def affinity(_pid):
        if taken is OSError:
            raise ProcessLookupError
        return set(taken)

    monkeypatch.setattr(os, "sched_getaffinity", affinity)
    process = LoopProcess.__new__(LoopProcess)
    process._process = subprocess.CompletedProcess([], 0)
    process._process.pid = 1
    assert process.core == core


def test_a_process_counts_as_dying_from_its_end_on_before_anybody_has_waited_for_it():
    with subprocess.Popen(
        [sys.executable, "-c", "import time; print(flush=True); time.sleep(60)"], stdout=-1
    ) as process:
        assert process.stdout.read(1) == b"\n"
        assert not is_dying(process.pid)
        os.kill(process.pid, signal.SIGSTOP)
        assert not is_dying(process.pid)
        process.kill()
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
        assert is_dying(process.pid)
        process.wait()
        assert is_dying(process.pid)


def test_asking_interns_nothing(monkeypatch):
    """What is interned and dropped keeps its place in a table of the interpreter, which grew by 1.9 MB in ten
    minutes.
    """
    interned = []
    monkeypatch.setattr(sys, "intern", lambda text: interned.append(text) or text)
    assert not is_dying(os.getpid())
    assert not interned
