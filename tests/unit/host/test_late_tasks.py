"""Who ran on a core: made-up tasks in a made-up /proc, and this machine's own."""

import pytest

from rtctl.host.exchange.late_exits import Ended
from rtctl.host.exchange.late_tasks import HIGHEST, Ran, Tasks

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


class Hand:
    """A clock that the test sets, ns; each reading takes what `step_ns` says."""

    def __init__(self):
        self.now_ns, self.step_ns = 0, 0

    def __call__(self):
        self.now_ns += self.step_ns
        return self.now_ns


@pytest.fixture
def made(tmp_path):
    return Made(tmp_path)


@pytest.fixture
def hand():
    return Hand()


def looked(tasks, hand, at_ns, priority=FIFO, *, everywhere=True, core=1):
    """Look at a time; who ran since the time before it that the clock shows."""
    before_ns, hand.now_ns = hand.now_ns, at_ns
    tasks.look(core, priority, everywhere=everywhere)
    return tasks.ran(core, priority, before_ns, at_ns)


def test_the_first_look_blames_nobody_and_the_next_one_who_ran_since(made, hand):
    made.has(7, "hog", ran=5 * S, priority=95)
    tasks = Tasks(LOOP, made.root, clock=hand)
    assert looked(tasks, hand, 10 * MS) == ()
    made.has(7, "hog", ran=5 * S + 3 * MS, priority=95)
    made.has(LOOP, "loop", ran=10 * S)
    assert looked(tasks, hand, 20 * MS) == (Ran("hog 7", 3 * MS, may_preempt=True, likely_ns=3 * MS),)
    assert looked(tasks, hand, 30 * MS) == ()


def test_only_what_was_run_in_the_time_asked_for_counts(made, hand):
    made.has(7, "before", ran=0)
    made.has(8, "within", ran=0)
    tasks = Tasks(LOOP, made.root, clock=hand)
    looked(tasks, hand, 0)
    made.has(7, "before", ran=60 * MS)
    looked(tasks, hand, 100 * MS)
    made.has(8, "within", ran=9 * MS)
    looked(tasks, hand, 110 * MS)
    ran = tasks.ran(1, 0, 95 * MS, 110 * MS)
    assert ran == (
        Ran("within 8", 9 * MS, may_preempt=True, likely_ns=9 * MS),
        Ran("before 7", 5 * MS, may_preempt=True, likely_ns=3 * MS),
    )


def test_a_reading_bears_its_own_time_and_not_that_of_the_look(made, hand):
    """The look was interrupted for 20 ms: what the task ran for meanwhile is of that time."""
    made.has(7, "hog", ran=0, priority=95)
    tasks = Tasks(LOOP, made.root, clock=hand)
    looked(tasks, hand, 0)
    hand.step_ns = 20 * MS
    made.has(7, "hog", ran=20 * MS, priority=95)
    hand.now_ns = 10 * MS
    tasks.look(1, FIFO, everywhere=False)
    hand.step_ns = 0
    looked(tasks, hand, 60 * MS, everywhere=False)
    (ran,) = tasks.ran(1, FIFO, 10 * MS, 50 * MS)
    assert ran.ran_ns == 20 * MS
    assert ran.likely_ns > 10 * MS


def test_a_task_that_did_not_run_for_long_did_not_run_evenly_since(made, hand):
    made.has(7, "hog", ran=0, priority=95)
    tasks = Tasks(LOOP, made.root, clock=hand)
    for at in range(50):
        looked(tasks, hand, at * 100 * MS)
    made.has(7, "hog", ran=40 * MS, priority=95)
    looked(tasks, hand, 5 * S)
    (ran,) = tasks.ran(1, FIFO, 4950 * MS, 5 * S)
    assert (ran.ran_ns, ran.likely_ns) == (40 * MS, 20 * MS)
    assert tasks.ran(1, FIFO, 4 * S, 4900 * MS) == ()


def test_between_looks_at_all_those_are_looked_at_that_may_preempt(made, hand):
    for pid, priority in ((7, 95), (8, 10), (9, 0)):
        made.has(pid, "task", ran=MS, priority=priority)
    tasks = Tasks(LOOP, made.root, clock=hand)
    looked(tasks, hand, 0)
    for pid, priority in ((7, 95), (8, 10), (9, 0)):
        made.has(pid, "task", ran=2 * MS, priority=priority)
    assert [one.name for one in looked(tasks, hand, 60 * S, everywhere=False)] == ["task 7"]
    assert {one.name for one in looked(tasks, hand, 61 * S)} == {"task 8", "task 9"}


def test_beside_an_ordinary_loop_those_that_ran_lately_on_its_core(made, hand):
    tasks = Tasks(LOOP, made.root, clock=hand)
    for at_ns, ran in ((0, MS), (60 * S, 2 * MS)):
        for pid, core in ((7, 1), (8, 0)):
            made.has(pid, "task", ran=ran, core=core)
        made.has(9, "task", ran=MS)
        looked(tasks, hand, at_ns, priority=0)
    for pid, core in ((7, 1), (8, 0), (9, 1)):
        made.has(pid, "task", ran=3 * MS, core=core)
    assert [one.name for one in looked(tasks, hand, 61 * S, priority=0, everywhere=False)] == ["task 7"]


def test_a_priority_below_the_loops_cannot_have_preempted_it(made, hand):
    tasks = Tasks(LOOP, made.root, clock=hand)
    looked(tasks, hand, 0)
    made.has(7, "below", ran=4 * MS, priority=FIFO - 1)
    made.has(8, "same", ran=3 * MS, priority=FIFO)
    made.has(9, "deadline", ran=2 * MS, policy=6)
    may = {one.name: one.may_preempt for one in looked(tasks, hand, 10 * MS)}
    assert may == {"below 7": False, "same 8": True, "deadline 9": True}
    made.has(7, "below", ran=9 * MS, priority=FIFO - 1)
    assert [one.may_preempt for one in looked(tasks, hand, 20 * MS, priority=0)] == [True]


def test_a_task_counts_that_was_on_the_core_at_either_end(made, hand):
    made.has(7, "leaves", ran=0, core=1)
    made.has(8, "comes", ran=0, core=0)
    made.has(9, "elsewhere", ran=0, core=0)
    tasks = Tasks(LOOP, made.root, clock=hand)
    looked(tasks, hand, 0)
    made.has(7, "leaves", ran=MS, core=0)
    made.has(8, "comes", ran=MS, core=1)
    made.has(9, "elsewhere", ran=MS, core=0)
    assert {one.name for one in looked(tasks, hand, 10 * MS)} == {"leaves 7", "comes 8"}


def test_a_task_that_has_ended_is_known_by_what_was_seen_of_it_last(made, hand):
    made.has(7, "make", ran=MS, priority=95)
    made.has(8, "cc", ran=MS, priority=0)
    made.has(9, "away", ran=MS, core=0)
    tasks = Tasks(LOOP, made.root, clock=hand)
    looked(tasks, hand, MS)
    for pid in (7, 8, 9):
        made.lacks(pid)
    gone = looked(tasks, hand, 10 * MS)
    assert {(one.name, one.may_preempt) for one in gone} == {("make 7", True), ("cc 8", False)}
    assert [one for one in gone if one.ran_ns >= 0] == []
    assert looked(tasks, hand, 20 * MS) == ()


def test_a_task_that_ended_is_missed_by_a_look_at_those_that_matter_too(made, hand):
    made.has(7, "make", ran=MS, priority=95)
    tasks = Tasks(LOOP, made.root, clock=hand)
    looked(tasks, hand, MS)
    made.lacks(7)
    (gone,) = looked(tasks, hand, 10 * MS, everywhere=False)
    assert gone.name == "make 7"


def test_what_the_kernel_tells_of_an_end_is_whole(made, hand):
    told = Told()
    made.has(7, "make", ran=MS, priority=10)
    tasks = Tasks(LOOP, made.root, told, clock=hand)
    looked(tasks, hand, 0)
    assert told.core == 1
    told.waiting = [Ended("7", "make", 5 * MS, realtime=True), Ended("31", "brief", 9 * MS, realtime=True)]
    made.has(7, "make", ran=5 * MS, priority=10)  # its parent has not heard yet: /proc shows it
    found = looked(tasks, hand, 20 * MS)
    assert [one[:3] for one in found] == [("brief 31", 9 * MS, True), ("make 7", 4 * MS, False)]
    made.has(7, "make", ran=6 * MS, priority=10)
    assert looked(tasks, hand, 30 * MS) == ()
    made.lacks(7)
    assert looked(tasks, hand, 40 * MS) == ()
    made.has(7, "other", ran=2 * MS, priority=95)
    assert [one[:3] for one in looked(tasks, hand, 50 * MS)] == [("other 7", 2 * MS, True)]


def test_an_ordinary_task_never_seen_does_not_preempt_a_real_time_loop(made, hand):
    told = Told()
    tasks = Tasks(LOOP, made.root, told, clock=hand)
    looked(tasks, hand, 0)
    told.waiting = [Ended("31", "brief", 9 * MS, realtime=False)]
    assert [one[:3] for one in looked(tasks, hand, 20 * MS)] == [("brief 31", 9 * MS, False)]


def test_a_task_that_ended_while_all_were_looked_at_is_not_held_to_have_begun_then(made, hand):
    told = Told()
    tasks = Tasks(LOOP, made.root, told, clock=hand)
    looked(tasks, hand, 0)
    looked(tasks, hand, 100 * MS)  # it began at 90 ms, and ended before this look came to it
    told.waiting = [Ended("31", "brief", 15 * MS, realtime=True)]
    hand.now_ns = 120 * MS
    tasks.look(1, FIFO, everywhere=False)
    (ran,) = tasks.ran(1, FIFO, 90 * MS, 105 * MS)
    assert (ran.name, ran.ran_ns) == ("brief 31", 15 * MS)


def test_one_that_filled_the_wait_comes_before_one_that_is_known_better(made, hand):
    told = Told()
    made.has(7, "fan", ran=0, priority=95)
    tasks = Tasks(LOOP, made.root, told, clock=hand)
    looked(tasks, hand, 0)
    made.has(7, "fan", ran=80 * MS, priority=95)
    looked(tasks, hand, 980 * MS, everywhere=False)
    told.waiting = [Ended("31", "brief", 20 * MS, realtime=True)]
    made.has(7, "fan", ran=84 * MS, priority=95)
    hand.now_ns = S
    tasks.look(1, FIFO, everywhere=False)
    assert [one.name for one in tasks.ran(1, FIFO, 980 * MS, S)] == ["brief 31", "fan 7"]


def test_those_that_have_ended_are_forgotten_in_time(made, hand):
    told = Told()
    tasks = Tasks(LOOP, made.root, told, clock=hand)
    looked(tasks, hand, 0)
    told.waiting = [Ended("31", "brief", 9 * MS, realtime=True)]
    looked(tasks, hand, 20 * MS)
    assert len(tasks.ran(1, FIFO, 0, 20 * MS)) == 1
    looked(tasks, hand, 9 * S)
    assert tasks.ran(1, FIFO, 0, 20 * MS) == ()


def test_where_ends_are_not_told_the_rest_works(made, hand):
    told = Told()
    told.refused = True
    made.has(7, "make", ran=MS, priority=HIGHEST)
    tasks = Tasks(LOOP, made.root, told, clock=hand)
    looked(tasks, hand, MS)
    made.lacks(7)
    assert [one.name for one in looked(tasks, hand, 10 * MS)] == ["make 7"]
