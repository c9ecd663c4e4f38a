"""What the scheduler tells of a late loop: records of a ring, stories of one tick each, and this kernel."""

import mmap
import os
import struct
import subprocess
import sys
import time
from dataclasses import replace

import pytest
from patience import until

from rtctl.host.exchange.late_seen import Seen, seen
from rtctl.host.exchange.late_ticks import LateTick
from rtctl.host.exchange.late_trace import (
    _FOLLOWED,
    DONE,
    EVENTS,
    GAP,
    IN,
    OTHER,
    OUT,
    SLACK,
    SOFTIRQ,
    WOKEN,
    Mark,
    Trace,
    marks,
    trace,
)
from rtctl.host.exchange.late_verdict import CAUSES, Rise, judge

LOOP, SWITCH, WAKING, ENTRY, LEAVE, START = 77, 5, 6, 7, 8, 9
NUMBERS = [SWITCH, WAKING, ENTRY, LEAVE, START]
LATE = LateTick(tick=7, woke_ns=100, late_ns=100, own_ns=0, phase="read")
HAD = [Mark(-90, IN, "loop 77", 19), Mark(-80, OUT, "", 120)]  # slept, on a core that is idle


def sample(at_ns, number, body):
    raw = struct.pack("<HBBi", number, 0, 0, 0) + body
    raw += b"\0" * (-(len(raw) + 4) % 8)
    return struct.pack("<IHHQI", 9, 0, 20 + len(raw), at_ns, len(raw)) + raw


def switch(at_ns, before, state, after, priority):
    name, number = after
    body = struct.pack("<16siiq16sii", b"x", before, 120, state, name, number, priority)
    return sample(at_ns, SWITCH, body)


def test_records_are_read_the_newest_first_and_one_that_is_cut_off_is_left_out():
    told = [
        switch(0, 8, 0, (b"loop", LOOP), 19),
        switch(1, LOOP, 1, (b"shell", 8), 120),
        switch(2, 8, 0, (b"make", 9), 120),
        sample(3, ENTRY, struct.pack("<I", 3)),
        sample(4, LEAVE, struct.pack("<I", 3)),
        sample(4, START, struct.pack("<16xqqi", 70, 20, 0)),
        sample(5, WAKING, b"\0" * 28),
        struct.pack("<IHHQQ", 2, 0, 24, 0, 0),  # some were lost
        switch(6, 9, 0, (b"loop", LOOP), 19),
        switch(7, LOOP, 0x100, (b"hog", 4), 4),
    ]
    assert list(marks(b"".join(told[::-1])[:-8], LOOP, NUMBERS)) == [
        Mark(7, OUT, "hog 4", 4, 120, "x 77", ready=True), Mark(6, IN, "loop 77", 19, 120, "x 9"),
        Mark(6, GAP),
        Mark(5, WOKEN), Mark(4, SLACK, slack_ns=50), Mark(4, DONE, "NET_RX"), Mark(3, SOFTIRQ, "NET_RX"),
        Mark(2, OTHER, "make 9", 120, 120, "x 8"),
        Mark(1, OUT, "shell 8", 120, 120, "x 77"),
    ]  # fmt: skip


class Ring:
    """A kernel that writes into a file of one page of its own and one of records."""

    def __init__(self, path):
        self.size, self.head = mmap.PAGESIZE, 0
        self.file = path
        path.write_bytes(bytes(2 * self.size))

    def opened(self, _attributes, _core):
        return os.open(self.file, os.O_RDWR)

    def write(self, record):
        whole = bytearray(self.file.read_bytes())
        self.head -= len(record)
        for k, byte in enumerate(record):
            whole[self.size + (self.head + k) % self.size] = byte
        struct.pack_into("<Q", whole, 1024, self.head % (1 << 64))
        with self.file.open("r+b") as file:
            file.write(whole)


def test_each_look_reads_what_is_new_and_knows_what_was_overwritten(tmp_path, monkeypatch):
    for number, (name, _) in zip(NUMBERS, _FOLLOWED, strict=True):
        (tmp_path / EVENTS / name).mkdir(parents=True)
        (tmp_path / EVENTS / name / "id").write_text(f"{number}\n")
    monkeypatch.setattr("rtctl.host.exchange.late_trace._PAGES", 1)
    monkeypatch.setattr("fcntl.ioctl", lambda *_arguments: 0)
    ring = Ring(tmp_path / "ring")
    told = Trace(LOOP, tmp_path, ring.opened)
    assert told.read(0) == []
    told.follow(1, ordinary=False)
    for k in range(200):  # 88 bytes each: four times through the page
        ring.write(switch(k, LOOP, 1, (b"a", 3), 120) if k % 2 else switch(k, 3, 0, (b"loop", LOOP), 19))
        if k % 10 == 9:
            found = [one.at_ns for one in told.read(k - 5)]
            assert found == list(range(max(k - 7, 2), k + 1))
    for k in range(200, 300):
        ring.write(switch(k, LOOP, 1, (b"a", 3), 120))
    found = [one.at_ns for one in told.read(0)]
    assert found == list(range(300 - mmap.PAGESIZE // 88, 300))
    told.close()


STORIES = {
    "late timer": ([*HAD, Mark(70, WOKEN), Mark(72, IN, "loop 77", 19)], ""),
    "timer slack": (
        [*HAD[:1], Mark(-81, SLACK, slack_ns=90), HAD[1], Mark(70, WOKEN), Mark(72, IN, "loop 77", 19)], ""
    ),
    "steal": ([*HAD, Mark(-20, WOKEN), Mark(-18, IN, "loop 77", 19)], ""),
    "kernel section": (
        [*HAD, Mark(-50, OTHER, "tar 5", 120), Mark(-20, WOKEN), Mark(90, IN, "loop 77", 19, 120)], "tar 5"
    ),
    "another task": (
        [*HAD, Mark(-20, WOKEN), Mark(-19, IN, "loop 77", 19), Mark(5, OUT, "hog 4", 4, ready=True),
         Mark(80, IN, "loop 77", 19, 4)], "hog 4"
    ),
    "quota": (
        [*HAD, Mark(-20, WOKEN), Mark(-19, IN, "loop 77", 19), Mark(5, OUT, "tar 5", 120, ready=True),
         Mark(80, IN, "loop 77", 19, 120)], ""
    ),
    "softirq": (
        [*HAD, Mark(-50, OTHER, "tar 5", 120), Mark(-20, WOKEN), Mark(-19, SOFTIRQ, "NET_RX"),
         Mark(85, DONE, "NET_RX"), Mark(90, IN, "loop 77", 19, 120)], "NET_RX"
    ),
    "unknown": (
        [*HAD, Mark(-50, OTHER, "tar 5", 120), Mark(40, WOKEN), Mark(80, IN, "loop 77", 19, 120)], ""
    ),  # 40 without its timer, 40 behind another task, 20 with the core: none of them half
}  # fmt: skip


@pytest.mark.parametrize("cause", STORIES)
def test_each_story_has_its_cause(cause):
    told, name = STORIES[cause]
    rise = Rise(guest=True, interrupts={"LOC": 900.0}, softirqs={"RCU": 900.0}, run_delay_ns=900)
    verdict = judge(LATE, replace(rise, seen=seen(told, 0, 100)), 100)
    assert verdict.cause == cause
    assert name in verdict.name
    assert verdict.cause in CAUSES


def test_behind_whom_an_ordinary_loop_waited_longest_is_named():
    told = [
        Mark(-90, IN, "loop 77", 120), Mark(-80, OUT, "a 1", 120), Mark(-20, WOKEN),
        Mark(20, OTHER, "b 2", 130, 120), Mark(95, OTHER, "c 3", 120, 130), Mark(98, IN, "loop 77", 120, 120),
    ]  # fmt: skip
    assert seen(told, 0, 100).held() == ("another task", "b 2", 98)


def test_a_task_that_rose_above_the_loop_while_it_had_the_core_may_preempt_it():
    told = [*HAD, Mark(-50, OTHER, "new 6", 120), Mark(-20, WOKEN), Mark(90, IN, "loop 77", 19, 4)]
    assert seen(told, 0, 100).held() == ("another task", "new 6", 90)


def test_who_took_an_idle_core_is_known_from_whom_the_loop_has_it():
    """Linux 6.18 on a guest told of no switch away from the idle task."""
    told = [*HAD, Mark(-20, WOKEN), Mark(90, IN, "loop 77", 19, 4, "hog 4")]
    assert seen(told, 0, 100).held() == ("another task", "hog 4", 90)
    assert seen([*HAD, Mark(-20, WOKEN), Mark(90, IN, "loop 77", 19, 120)], 0, 100).ran == 100


def test_a_stretch_that_begins_before_anything_was_told_is_not_judged():
    assert seen([Mark(5, IN, "loop 77", 19)], 0, 100) is None
    assert seen([], 0, 100) is None


@pytest.mark.parametrize(
    "told",
    [
        [*HAD, Mark(-20, WOKEN)],  # and runs elsewhere
        [*HAD, Mark(-20, WOKEN), Mark(-19, IN, "loop 77", 19), Mark(20, GAP), Mark(90, IN, "loop 77", 19)],
        [*HAD, Mark(70, IN, "loop 77", 19)],  # woken elsewhere
        [*HAD, Mark(-20, WOKEN), Mark(-19, IN, "loop 77", 19), Mark(5, OUT, "hog 4", 4, ready=True)],
    ],
)
def test_a_loop_that_was_on_another_core_or_not_followed_meanwhile_is_not_judged(told):
    assert seen(told, 0, 100) is None


@pytest.mark.parametrize(
    ("rise", "cause"),
    [
        (Rise(), "unknown"),  # a machine of its own
        (Rise(smis=1.0), "SMI"),
        (Rise(minor_faults=90.0, major_faults=0.0), "page fault"),
        (Rise(stopped=True), "stopped"),
        (Rise(timer_slack_ns=1e9, idle_exit_ns=1e9), "idle state"),
    ],
)
def test_a_loop_that_had_its_core_is_judged_by_what_was_counted(rise, cause):
    assert judge(LATE, replace(rise, seen=Seen(ran=90.0)), 100).cause == cause


@pytest.mark.parametrize(
    ("rise", "cause"), [(Rise(timer_slack_ns=90.0), "timer slack"), (Rise(minor_faults=90.0), "late timer")]
)
def test_a_loop_that_was_woken_late_has_had_no_page_fault(rise, cause):
    assert judge(LATE, replace(rise, seen=Seen(slept=90.0)), 100).cause == cause


def test_an_own_cycle_is_one_unless_its_core_was_taken_meanwhile():
    own = replace(LATE, own_ns=90)
    assert judge(own, Rise(guest=True, seen=Seen(ran=190.0)), 100).text == "own cycle (read)"
    assert judge(own, Rise(guest=True, seen=Seen(slept=150.0)), 100).text == "own cycle (read)"
    taken = Seen(ran=100.0)
    taken.waited["another task", "hog 4"] = 90.0
    assert judge(own, Rise(seen=taken), 100).text == "another task (hog 4)"


def test_this_kernel_tells_when_a_sleeper_runs_where_it_may():
    """A child sleeps and runs in turn on one core: between two times that it notes itself it had the core."""
    core = min(os.sched_getaffinity(0))
    script = (
        f"import os, time\nos.sched_setaffinity(0, {{{core}}})\n"
        "while True:\n a = time.monotonic_ns()\n while time.monotonic_ns() < a + 3000000: pass\n"
        " print(a, a + 3000000, flush=True)\n time.sleep(.003)"
    )
    child = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    follower = trace(child.pid)
    try:
        if follower is None:
            pytest.skip("no tracefs, or not the right to it")
        try:
            follower.follow(core, ordinary=True)
        except OSError:
            pytest.skip("perf_event_open is refused")
        follower.follow(core, ordinary=True)

        def told():
            began, ended = (int(word) for word in child.stdout.readline().split())
            what = seen(follower.read(began), began, ended)
            return what is not None and what.ran > 2e6 and not what.slept

        assert until(told)
        now_ns = time.monotonic_ns()
        assert until(lambda: any(one.what == WOKEN for one in follower.read(now_ns)))
    finally:
        child.kill()
        child.wait()
        child.stdout.close()
        if follower is not None:
            follower.close()
            assert follower.read(0) == []


def test_without_tracefs_there_is_none(tmp_path):
    with pytest.raises(OSError, match="sched_switch"):
        Trace(1, tmp_path)
