"""Who ran on a core: made-up tasks in a made-up /proc, and this machine's own."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from patience import until

from rtctl.host.telemetry.late_exits import Ended
from rtctl.host.telemetry.late_tasks import HIGHEST, Ran, Tasks

LOOP, MS, S = 4, 1_000_000, 1_000_000_000
FIFO = 80


class Made:
    """A /proc of tasks that do what the test says."""

    def __init__(self, root):
        self.root = root
        self.has(LOOP, "loop", ran=9 * S, core=1, priority=FIFO)

    def has(self, pid, name, *, ran, core=1, priority=0, policy=0):
        folder = self.root / f"proc/{pid}/task/{pid}"
        folder.mkdir(parents=True, exist_ok=True)
        words = ["0"] * 50
        words[36], words[37], words[38] = str(core), str(priority), str(policy)
        (folder / "stat").write_text(f"{pid} ({name}) {' '.join(words)}")
        (folder / "schedstat").write_text(f"{ran} 0 1\n")

    def lacks(self, pid):
        folder = self.root / f"proc/{pid}/task/{pid}"
        for file in folder.iterdir():
            file.unlink()
        folder.rmdir()
        folder.parent.rmdir()
        folder.parent.parent.rmdir()


class Told:
    """Exits that the test tells."""

    def __init__(self):
        self.core, self.waiting, self.refused = None, [], False

    def follow(self, core):
        if self.refused:
            raise PermissionError
        self.core = core

    def read(self):
        now, self.waiting = self.waiting, []
        return now

    def close(self):
        self.core = None


def looked(tasks, at_ns=S, priority=FIFO, core=1, *, everywhere=True):
    tasks.look(at_ns, core, priority, everywhere=everywhere)
    return tasks.mark(core, priority)


@pytest.fixture
def made(tmp_path):
    return Made(tmp_path)


def test_the_first_look_blames_nobody_and_the_next_one_whom_ran_since(made):
    made.has(7, "hog", ran=5 * S, priority=95)
    tasks = Tasks(LOOP, made.root)
    assert looked(tasks) == ()
    made.has(7, "hog", ran=5 * S + 3 * MS, priority=95)
    made.has(LOOP, "loop", ran=10 * S)
    assert looked(tasks) == (Ran("hog 7", 3 * MS, may_preempt=True),)
    assert looked(tasks) == ()


def test_run_time_counts_from_the_mark_and_not_from_an_older_look(made):
    made.has(7, "hog", ran=0, priority=95)
    tasks = Tasks(LOOP, made.root)
    looked(tasks)
    for step in range(
        1, 20
    ):  # it runs a little all the time, and is looked at each time though not everywhere
        made.has(7, "hog", ran=step * MS, priority=95)
        assert looked(tasks, S + step * 100 * MS, everywhere=False) == (Ran("hog 7", MS, may_preempt=True),)


def test_looks_before_a_mark_add_up(made):
    made.has(7, "hog", ran=0, priority=95)
    tasks = Tasks(LOOP, made.root)
    looked(tasks)
    for ran in (2 * MS, 5 * MS):  # while the loop stands
        made.has(7, "hog", ran=ran, priority=95)
        tasks.look(S, 1, FIFO, everywhere=True)
    assert tasks.mark(1, FIFO) == (Ran("hog 7", 5 * MS, may_preempt=True),)


def test_between_looks_at_all_those_are_looked_at_that_ran_lately_or_may_preempt(made):
    for pid, priority in ((7, 95), (8, 10), (9, 0)):
        made.has(pid, "task", ran=MS, priority=priority)
    tasks = Tasks(LOOP, made.root)
    looked(tasks, 0)
    for pid, priority in ((7, 95), (8, 10), (9, 0)):
        made.has(pid, "task", ran=2 * MS, priority=priority)
    quiet = looked(tasks, 60 * S, everywhere=False)
    assert [one.name for one in quiet] == ["task 7"]
    assert {one.name for one in looked(tasks, 60 * S)} == {"task 8", "task 9"}
    for pid in (8, 9):
        made.has(pid, "task", ran=3 * MS)
    assert {one.name for one in looked(tasks, 61 * S, everywhere=False)} == {"task 8", "task 9"}


def test_a_priority_below_the_loops_cannot_have_preempted_it(made):
    tasks = Tasks(LOOP, made.root)
    looked(tasks)
    made.has(7, "below", ran=4 * MS, priority=FIFO - 1)
    made.has(8, "same", ran=3 * MS, priority=FIFO)
    made.has(9, "deadline", ran=2 * MS, policy=6)
    may = {one.name: one.may_preempt for one in looked(tasks)}
    assert may == {"below 7": False, "same 8": True, "deadline 9": True}
    made.has(7, "below", ran=9 * MS, priority=FIFO - 1)
    assert [one.may_preempt for one in looked(tasks, priority=0)] == [True]


def test_a_task_counts_that_was_on_the_core_at_either_end(made):
    made.has(7, "leaves", ran=0, core=1)
    made.has(8, "comes", ran=0, core=0)
    made.has(9, "elsewhere", ran=0, core=0)
    tasks = Tasks(LOOP, made.root)
    looked(tasks)
    made.has(7, "leaves", ran=MS, core=0)
    made.has(8, "comes", ran=MS, core=1)
    made.has(9, "elsewhere", ran=MS, core=0)
    assert {one.name for one in looked(tasks)} == {"leaves 7", "comes 8"}


def test_a_task_that_has_ended_is_known_by_what_was_seen_of_it_last(made):
    made.has(7, "make", ran=MS, priority=95)
    made.has(8, "cc", ran=MS, priority=0)
    made.has(9, "away", ran=MS, core=0)
    tasks = Tasks(LOOP, made.root)
    looked(tasks)
    for pid in (7, 8, 9):
        made.lacks(pid)
    gone = looked(tasks)
    assert {(one.name, one.may_preempt) for one in gone} == {("make 7", True), ("cc 8", False)}
    assert [one for one in gone if one.ran_ns >= 0] == []
    assert looked(tasks) == ()


def test_a_task_that_ended_is_missed_by_a_look_at_those_that_matter_too(made):
    made.has(7, "make", ran=MS, priority=95)
    tasks = Tasks(LOOP, made.root)
    looked(tasks)
    made.lacks(7)
    (gone,) = looked(tasks, everywhere=False)
    assert gone.name == "make 7"


def test_what_the_kernel_tells_of_an_end_counts_from_the_mark(made):
    told = Told()
    made.has(7, "make", ran=MS, priority=10)
    tasks = Tasks(LOOP, made.root, told)
    looked(tasks)
    assert told.core == 1
    told.waiting = [Ended("7", "make", 5 * MS, realtime=True), Ended("31", "brief", 9 * MS, realtime=True)]
    made.has(7, "make", ran=5 * MS, priority=10)  # its parent has not heard yet: /proc shows it
    assert looked(tasks) == (
        Ran("brief 31", 9 * MS, may_preempt=True),
        Ran("make 7", 4 * MS, may_preempt=False),
    )
    assert looked(tasks) == ()
    made.lacks(7)
    assert looked(tasks) == ()
    made.has(7, "other", ran=2 * MS, priority=95)
    assert looked(tasks) == (Ran("other 7", 2 * MS, may_preempt=True),)


def test_an_ordinary_task_never_seen_does_not_preempt_a_real_time_loop(made):
    told = Told()
    tasks = Tasks(LOOP, made.root, told)
    looked(tasks)
    told.waiting = [Ended("31", "brief", 9 * MS, realtime=False)]
    assert looked(tasks) == (Ran("brief 31", 9 * MS, may_preempt=False),)


def test_where_ends_are_not_told_the_rest_works(made):
    told = Told()
    told.refused = True
    made.has(7, "make", ran=MS, priority=HIGHEST)
    tasks = Tasks(LOOP, made.root, told)
    looked(tasks)
    made.lacks(7)
    assert [one.name for one in looked(tasks)] == ["make 7"]


def test_the_task_that_ran_on_the_core_is_named():
    """Of this machine: a child that computes, and is asked for by the core it is on."""
    child = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        tasks = Tasks(os.getpid())
        looked(tasks, priority=0)

        def told():
            with Path(f"/proc/{child.pid}/stat").open() as file:
                core = int(file.read().rpartition(")")[2].split()[36])
            return any(one.name.endswith(f" {child.pid}") for one in looked(tasks, priority=0, core=core))

        assert until(told, 20)
    finally:
        child.kill()
        child.wait()
