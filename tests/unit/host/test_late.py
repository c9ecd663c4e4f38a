"""Late ticks: which they are, what the kernel counts, and the verdict."""

import math
import signal
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from patience import until

from rtctl.host.exchange.late_counters import Counters, Reading, rates, rise
from rtctl.host.exchange.late_tasks import Ran
from rtctl.host.exchange.late_ticks import LateTick, bound_ns, late_ticks
from rtctl.host.exchange.late_verdict import judge
from rtctl.host.exchange.late_watch import TELL_NS, LateNews, LateWatch
from rtctl.tick import new_ticks

MS = 1_000_000
LATE = LateTick(tick=7, woke_ns=0, late_ns=400_000, own_ns=0, phase="read")


@pytest.mark.parametrize(
    ("period_ns", "early_us", "bound_us"),
    [(MS, 40, 50), (MS // 10, 20, 25), (MS, 0, 200), (MS // 10, 0, 50), (10 * MS, 40, 200)],
)
def test_the_bound_follows_period_and_early_look(period_ns, early_us, bound_us):
    assert bound_ns(period_ns, 1000 * early_us) == 1000 * bound_us


def ticks(late_ns, slots=None, **parts):
    rows = new_ticks(len(late_ns), 1)
    rows["tick"] = np.arange(len(late_ns)) if slots is None else slots
    rows["time_ns"] = 10 * MS + rows["tick"] * MS
    rows["wakeup_ns"] = late_ns
    for name, values in parts.items():
        rows[name] = values
    return rows


def test_a_slot_that_was_skipped_is_lateness_too():
    found = late_ticks(ticks([0, 0, 300_000, 0], slots=[0, 1, 5, 6]), 100_000)
    assert [(one.tick, one.late_ns) for one in found] == [(5, 3 * MS + 300_000)]


def test_what_the_cycle_before_took_beyond_its_period_is_told_with_its_longest_part():
    rows = ticks([0, 500_000, 0], write_ns=[1_400_000, 0, 0], read_ns=[90_000, 0, 0], record_ns=[0, 8_000, 0])
    (one,) = late_ticks(rows, 100_000)
    assert (one.phase, one.own_ns) == ("write", 498_000)


def test_a_single_row_or_none_says_nothing():
    assert late_ticks(ticks([900_000]), 0) == late_ticks(ticks([]), 0) == []


def made_up(root, *, delay=0, minor=0, net=0, state="S", throttled=0):
    """A /proc of one loop, number 12, on core 1 of 2."""
    fields = ["0"] * 50
    fields[0], fields[7], fields[9], fields[36], fields[37] = state, str(minor), "0", "1", "80"
    files = {
        "proc/12/stat": f"12 (rt ctl) {' '.join(fields)}",
        "proc/12/schedstat": f"5 {delay} 3",
        "proc/12/timerslack_ns": "50000",
        "proc/12/cgroup": "0::/rig.slice\n",
        "sys/fs/cgroup/rig.slice/cpu.stat": f"usage_usec 5\nthrottled_usec {throttled}\n",
        "proc/stat": "cpu 1 2 3\ncpu0 0 0 0 0 0 0 0 7 0 0\ncpu1 0 0 0 0 0 0 0 2 0 0\n",
        "proc/softirqs": f"     CPU0  CPU1\n NET_RX:  9  {net}\n RCU: 1 1\n",
        "proc/interrupts": "     CPU0  CPU1\n 25:  9  4  IO-APIC 5-edge eth0\nLOC: 5 6 Local timer\nERR: 0\n",
    }
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return root


def test_counters_are_those_of_the_loops_core(tmp_path):
    counters = Counters(12, None, made_up(tmp_path, delay=100, minor=4, net=50))
    before = counters.look(0)
    assert counters.core == 1
    made_up(tmp_path, delay=400_100, minor=5, net=350, throttled=3)
    after = counters.look(MS)
    counters.close()
    found = rise(before, after, {"NET_RX": 10_000.0})
    assert (found.run_delay_ns, found.minor_faults, found.throttled_ns) == (400_000, 1, 3000)
    assert found.softirqs == {"NET_RX": 300 - 30 - 20}
    assert found.interrupts == {}
    assert math.isnan(found.timer_slack_ns), "with real-time rights the kernel takes no slack"
    assert rates(before, after)["NET_RX"] == pytest.approx(300 / 1e-3)


@pytest.mark.parametrize(
    "rows",
    [
        "00000010 0 0 0 0 0 0 0 0 0 0 0 00000000\n{:08x} 0 0 0 0 0 0 0 0 0 0 0 00000001\n",
        "{:08x} 0 0 0 0 0 0 0 0 0 0 0 00000001\n",  # of a machine whose core 0 is off
        "00000010 0 0\n{:08x} 0 0\n",  # of an old kernel
    ],
)
def test_packets_count_as_softirqs(tmp_path, rows):
    file = tmp_path / "proc/net/softnet_stat"
    file.parent.mkdir(parents=True)
    file.write_text(rows.format(700))
    counters = Counters(12, None, made_up(tmp_path, net=50))
    before = counters.look(0)
    file.write_text(rows.format(4200))
    made_up(tmp_path, net=60)
    after = counters.look(MS)
    counters.close()
    assert rise(before, after, {}).softirqs == {"NET_RX": 3500 + 10 - 20}


def test_time_that_the_hypervisor_took_is_that_of_the_loops_core(tmp_path):
    """Recorded on a guest of two cores: core 1 lost 30 ms, core 0 more."""
    stat = made_up(tmp_path) / "proc/stat"
    lines = (
        "cpu  22213 7246 4350 24562 766 0 116 {} 0 0\ncpu0 10127 1830 2295 15032 330 0 8 {} 0 0\ncpu1 "
        "12086 5416 2054 9530 435 0 107 {} 0 0\n"
    )
    stat.write_text(lines.format(82, 40, 42))
    counters = Counters(12, None, tmp_path)
    before = counters.look(0)
    stat.write_text(lines.format(95, 50, 45))
    after = counters.look(40 * MS)
    counters.close()
    found = rise(before, after, {})
    assert found.steal_ns == 30 * MS
    assert judge(replace(LATE, late_ns=29 * MS), found, 29 * MS).text == "steal"


def test_a_group_of_version_1_tells_in_nanoseconds(tmp_path):
    made_up(tmp_path)
    (tmp_path / "proc/12/cgroup").write_text("3:cpuset:/\n1:cpu:/rig\n0::/rig.slice\n")
    stat = tmp_path / "sys/fs/cgroup/cpu/rig/cpu.stat"
    stat.parent.mkdir(parents=True)
    stat.write_text("nr_periods 4\nnr_throttled 1\nthrottled_time 4500\n")
    counters = Counters(12, 1, tmp_path)
    before = counters.look(0)
    assert before.throttled_ns == 4500
    stat.write_text("nr_periods 9\nnr_throttled 2\nthrottled_time 9500\n")
    held = counters.look(MS)
    (tmp_path / "proc/12/cgroup").write_text("0::/rig.slice\n")
    away = counters.look(2 * MS)
    counters.close()
    assert rise(before, held, {}).throttled_ns == 5000
    assert math.isnan(rise(held, away, {}).throttled_ns), "of another group"


def test_a_machine_that_tells_nothing_gives_no_cause(tmp_path):
    counters = Counters(12, 0, tmp_path)
    found = rise(counters.look(0), counters.look(MS), {})
    assert judge(LATE, found, LATE.late_ns).cause == "unknown"


def test_a_stopped_process_is_seen():
    child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    counters = Counters(child.pid)
    try:
        assert not counters.stopped()
        child.send_signal(signal.SIGSTOP)
        assert until(lambda: counters.look(0).stopped)
        child.send_signal(signal.SIGCONT)
        assert until(lambda: not counters.look(0).stopped)
        assert counters.stopped(), "it was, and nobody had asked"
        assert until(lambda: not counters.stopped())
    finally:
        counters.close()
        child.kill()
        child.wait()


class Scripted:
    """Counters that say what the test wants."""

    core = 0

    def __init__(self, priority=0):
        self.delay_ns, self.is_stopped, self.looks, self.priority = 0.0, False, 0, priority
        self.minor_faults = 0.0

    def look(self, at_ns, *, late):
        self.looks += 1
        return Reading(
            at_ns,
            run_delay_ns=self.delay_ns,
            minor_faults=self.minor_faults,
            major_faults=0.0,
            priority=self.priority,
        )

    def stopped(self):
        return self.is_stopped

    def close(self):
        pass


def test_the_watch_counts_causes_and_tells_each_listener_once():
    counters = Scripted()
    watch = LateWatch(counters, None, MS, lambda: 40_000)
    one, other = LateNews(watch), LateNews(watch)
    watch.follow(ticks([0, 0]), 0)
    assert watch.health()["ticks"] == 0
    counters.delay_ns = 350_000
    watch.follow(ticks([400_000], slots=[2]), 10 * MS + TELL_NS)
    (told,) = one.changes()
    assert told[0] == "late"
    assert (told[1]["cause"], told[1]["worst_tick"], told[1]["ticks"]) == ("another task", 2, 1)
    assert one.changes() == []
    assert other.changes() == [told]
    assert watch.health()["causes"] == {"another task": 1}
    watch.follow(ticks([400_000], slots=[3]), 20 * MS + TELL_NS)
    assert one.changes() == [], "just now"
    watch.follow(ticks([0], slots=[4]), 20 * MS + 2 * TELL_NS)
    assert one.changes()[0][1]["causes"] == {"unknown": 1}


def test_a_loop_that_was_stopped_while_no_tick_came_is_known_to_have_been():
    counters = Scripted()
    watch = LateWatch(counters, None, MS, lambda: 0)
    watch.follow(ticks([0, 0]), 0)
    counters.is_stopped = True
    watch.follow(ticks([]), 30 * MS)
    counters.is_stopped = False
    watch.follow(ticks([0], slots=[60]), 60 * MS)
    assert watch.health()["causes"] == {"stopped": 1}


def test_what_held_the_loop_up_before_a_look_in_the_middle_counts():
    """A batch of ticks comes some ms late, while the cycle after it already works on memory that is not
    there."""
    counters = Scripted(80)
    watch = LateWatch(counters, None, MS, lambda: 40_000)
    watch.follow(ticks([0], slots=[101]), 12 * MS)
    counters.minor_faults = 7500.0
    watch.follow(ticks([0], slots=[102], read_ns=[17 * MS]), 122 * MS)
    counters.minor_faults = 8000.0
    watch.follow(ticks([0], slots=[119]), 130 * MS)
    assert watch.health()["causes"] == {"page fault": 1}
    counters.minor_faults += 1000.0
    watch.follow(ticks([600_000], slots=[120]), 131 * MS)
    assert watch.health()["causes"] == {"page fault": 1, "unknown": 1}, "what was judged is no cause again"


@pytest.mark.parametrize(("priority", "looks"), [(80, 10), (0, 20)])
def test_while_nothing_is_late_the_counters_are_looked_at_a_few_times_a_second(priority, looks):
    counters = Scripted(priority)
    watch = LateWatch(counters, None, MS, lambda: 0)
    for k in range(1000):
        watch.follow(ticks([0], slots=[k]), k * MS)
    assert counters.looks == looks


class ScriptedTasks:
    """Tasks of which one runs, whenever it is asked."""

    def __init__(self):
        self.asked, self.everywhere = [], 0

    def look(self, _core, _priority, *, everywhere):
        self.everywhere += everywhere

    def ran(self, _core, priority, since_ns, until_ns):
        self.asked.append((priority, since_ns, until_ns))
        return (Ran("hog 7", 1e9, may_preempt=True, likely_ns=1e9),)

    def close(self):
        pass


def test_the_tasks_asked_for_are_those_of_the_time_that_each_tick_was_waited_for():
    counters, tasks = Scripted(80), ScriptedTasks()
    watch = LateWatch(counters, tasks, MS, lambda: 40_000)
    watch.follow(ticks([0, 0]), 12 * MS)
    counters.delay_ns = 900_000
    watch.follow(ticks([400_000, 500_000], slots=[2, 3]), 15 * MS)
    assert tasks.asked == [(80, 11 * MS, 12 * MS + 400_000), (80, 12 * MS, 13 * MS + 500_000)]
    watch.follow(ticks([0], slots=[4]), 15 * MS + TELL_NS)
    ((_, told),) = LateNews(watch).changes()
    assert (told["worst_tick"], told["name"]) == (3, "hog 7")
    assert watch.health()["causes"] == {"another task": 2}


def test_while_the_loop_stands_the_tasks_are_looked_at():
    counters, tasks = Scripted(80), ScriptedTasks()
    watch = LateWatch(counters, tasks, MS, lambda: 40_000)
    watch.follow(ticks([0, 0]), 12 * MS)
    seen = tasks.everywhere
    watch.follow(ticks([]), 14 * MS)
    assert tasks.everywhere == seen, "a batch may be empty"
    watch.follow(ticks([]), 80 * MS)
    assert tasks.everywhere == seen + 1
    watch.follow(ticks([]), 100 * MS)
    assert tasks.everywhere == seen + 1, "not again at once"


def test_without_counters_late_ticks_are_counted_all_the_same():
    watch = LateWatch(None, None, MS, lambda: 0)
    watch.follow(ticks([0, 0, 900_000]), 0)
    assert watch.health()["causes"] == {"unknown": 1}
