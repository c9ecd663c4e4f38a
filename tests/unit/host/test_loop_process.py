import contextlib
import os
import signal
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.host.loop_guard import LoopGuard
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


def test_a_loop_that_dies_has_no_priority_while_its_devices_are_told_and_then_its_own_again(monkeypatch):
    now = {7: (os.SCHED_FIFO, os.sched_param(80))}
    monkeypatch.setattr(os, "sched_getscheduler", lambda pid: now[pid][0])
    monkeypatch.setattr(os, "sched_getparam", lambda pid: now[pid][1])
    monkeypatch.setattr(os, "sched_setscheduler", lambda pid, *policy: now.update({pid: policy}))
    process = LoopProcess.__new__(LoopProcess)
    process._process = subprocess.CompletedProcess([], 0)
    process._process.pid = 7
    with process.out_of_the_way():
        assert now[7][0] == os.SCHED_OTHER
    assert now[7] == (os.SCHED_FIFO, os.sched_param(80))


def test_a_loop_that_is_gone_has_no_priority_to_lose():
    process = LoopProcess.__new__(LoopProcess)
    process._process = subprocess.CompletedProcess([], 0)
    process._process.pid = 2**22 + 1  # beyond what there may be
    with process.out_of_the_way():
        pass


def test_a_dying_loop_is_out_of_the_way_while_its_devices_are_told():
    said = []

    @contextlib.contextmanager
    def aside():
        said.append("aside")
        yield
        said.append("back")

    guard = LoopGuard.__new__(LoopGuard)
    guard._memory = SimpleNamespace(header=np.zeros(1, [("head", "<i8")]))
    guard._loop = SimpleNamespace(opening=False, ended=None, dying=True, out_of_the_way=aside)
    guard._watch = SimpleNamespace(look=lambda *_, **__: None, is_silent=True)
    guard._stop = SimpleNamespace(tell=lambda: said.append("told"))
    guard._virtual, guard._told_at = False, -1
    guard.look()
    assert said == ["aside", "told", "back"]


def test_asking_interns_nothing(monkeypatch):
    """What is interned and dropped keeps its place in a table of the interpreter, which grew by 1.9 MB in ten
    minutes.
    """
    interned = []
    monkeypatch.setattr(sys, "intern", lambda text: interned.append(text) or text)
    assert not is_dying(os.getpid())
    assert not interned
