"""What made a tick late, from composed counters: one case for each cause, and those that are taken for each
other.
"""

from dataclasses import replace

import pytest

from rtctl.host.exchange.late_tasks import Ran
from rtctl.host.exchange.late_ticks import LateTick
from rtctl.host.exchange.late_verdict import CAUSES, Rise, judge

NAN = float("nan")
LATE = LateTick(tick=7, woke_ns=0, late_ns=400_000, own_ns=0, phase="read")
OWN = replace(LATE, own_ns=390_000, phase="write", cycle_ns=1_390_000)
NOTHING = Rise(
    run_delay_ns=0, steal_ns=0, throttled_ns=0, minor_faults=0, major_faults=0, softirqs={}, interrupts={}
)
WAITED = replace(NOTHING, run_delay_ns=3e5)
HOG, BEFORE_IT = (
    Ran("hog 12", 4e5, may_preempt=True, likely_ns=4e5),
    Ran("bystander 3", 1e5, may_preempt=True),
)
PERHAPS = Ran("fan 9", 4e5, may_preempt=True, likely_ns=3e4)  # ran as long in a time ten times as long
ORDINARY = Ran("shell 8", 9e5, may_preempt=False)
GONE, GONE_TOO = Ran("make 5", NAN, may_preempt=True), Ran("cc 6", NAN, may_preempt=True)
KERNELS = Ran("ksoftirqd/1 20", 4e5, may_preempt=True, likely_ns=4e5)
NET = {"NET_RX": 80.0, "RCU": 3.0}


@pytest.mark.parametrize(
    ("tick", "rise", "cause", "name"),
    [
        (LATE, NOTHING, "unknown", ""),
        (LATE, Rise(), "unknown", ""),  # nothing can be read here
        (LATE, Rise(run_delay_ns=1e5), "unknown", ""),  # a quarter
        # another task
        (LATE, replace(WAITED, tasks=(HOG,)), "another task", "hog 12"),
        (LATE, replace(WAITED, tasks=(HOG, BEFORE_IT)), "another task", "hog 12"),
        (LATE, replace(WAITED, tasks=(BEFORE_IT,)), "another task", ""),  # ran for too short a time
        (LATE, replace(WAITED, tasks=(BEFORE_IT, Ran("c 4", 9e4, may_preempt=True))), "another task",
            "bystander 3"),
        (LATE, replace(WAITED, tasks=(HOG,), softirqs=NET), "another task", "hog 12"),
        (LATE, replace(WAITED, tasks=(PERHAPS,)), "another task", "fan 9"),
        (LATE, replace(WAITED, tasks=(ORDINARY, HOG)), "another task", "hog 12"),
        (LATE, replace(WAITED, tasks=(ORDINARY,)), "another task", "shell 8"),  # in a section of the kernel
        (LATE, replace(WAITED, tasks=(BEFORE_IT, GONE)), "another task", "make 5"),
        (LATE, replace(WAITED, tasks=(GONE, GONE_TOO)), "another task", ""),  # one of the two
        (LATE, replace(WAITED, tasks=(HOG, GONE)), "another task", "hog 12"),
        # softirq and interrupt
        (LATE, replace(WAITED, softirqs=NET), "softirq", "NET_RX"),
        # runs in whoever it interrupts
        (LATE, replace(WAITED, softirqs=NET, tasks=(ORDINARY,)), "softirq", "NET_RX"),
        (LATE, replace(WAITED, softirqs=NET, tasks=(PERHAPS,)), "softirq", "NET_RX"),
        (LATE, replace(WAITED, interrupts={"25 eth0": 90.0}, tasks=(PERHAPS,)), "interrupt", "25 eth0"),
        (LATE, replace(WAITED, softirqs=NET, tasks=(GONE,)), "softirq", "NET_RX"),
        (LATE, replace(WAITED, softirqs={"NET_RX": 10.0}, tasks=(KERNELS,)), "softirq", "NET_RX"),
        (LATE, replace(WAITED, softirqs={}, tasks=(KERNELS,)), "softirq", ""),
        (LATE, Rise(softirqs={"NET_RX": 80.0}), "softirq", "NET_RX"),
        (LATE, Rise(softirqs={"NET_RX": 10.0}), "unknown", ""),
        (LATE, replace(WAITED, interrupts={"25 eth0": 90.0}), "interrupt", "25 eth0"),
        (LATE, Rise(interrupts={"25 eth0": 90.0}), "interrupt", "25 eth0"),
        # exact ones
        (LATE, Rise(throttled_ns=1e6, run_delay_ns=4e5, tasks=(HOG,)), "quota", ""),
        (LATE, Rise(stopped=True, run_delay_ns=4e5), "stopped", ""),
        (LATE, Rise(steal_ns=1e7), "steal", ""),
        (LATE, Rise(minor_faults=0, major_faults=1), "page fault", "read"),
        (LATE, Rise(minor_faults=50, major_faults=0), "page fault", "read"),
        # the core itself
        (LATE, Rise(smis=1.0), "SMI", ""),
        (LATE, Rise(smis=0.0), "unknown", ""),
        (LATE, Rise(clock_change_ns=250_000), "frequency change", ""),
        (LATE, Rise(clock_change_ns=250_000, too_hot=True), "frequency change", "heat"),
        (LATE, Rise(slower=0.6, too_hot=True), "unknown", ""),  # a slow clock wakes nobody late
        (LATE, Rise(idle_exit_ns=250_000), "idle state", ""),
        (LATE, Rise(timer_slack_ns=50_000), "unknown", ""),
        (replace(LATE, late_ns=90_000), Rise(timer_slack_ns=50_000), "timer slack", ""),
        # the cycle before
        (OWN, NOTHING, "own cycle", "write"),
        (OWN, Rise(), "own cycle", "write"),
        (OWN, replace(NOTHING, run_delay_ns=4e5, tasks=(HOG,)), "another task", "hog 12"),
        (OWN, replace(NOTHING, minor_faults=120), "page fault", "write"),
        (OWN, replace(NOTHING, steal_ns=1e7), "steal", ""),
        (OWN, replace(NOTHING, smis=2.0), "SMI", ""),
        (OWN, replace(NOTHING, softirqs=NET), "softirq", "NET_RX"),  # in the middle of the cycle
        (OWN, replace(NOTHING, softirqs={"NET_RX": 9.0}), "own cycle", "write"),
        (OWN, replace(NOTHING, interrupts={"25 eth0": 90.0}), "interrupt", "25 eth0"),
        (OWN, replace(NOTHING, slower=0.3), "frequency change", ""),
        (OWN, replace(NOTHING, slower=0.3, too_hot=True), "frequency change", "heat"),
        (OWN, replace(NOTHING, slower=0.05), "own cycle", "write"),
        (OWN, replace(NOTHING, slower=-0.5), "own cycle", "write"),
    ],
)  # fmt: skip
def test_what_explains_half_is_the_cause(tick, rise, cause, name):
    verdict = judge(tick, rise, tick.late_ns)
    assert (verdict.cause, verdict.name) == (cause, name)
    assert verdict.cause in CAUSES
    assert (verdict.share >= 0.5) is (cause != "unknown")


def test_a_cause_must_explain_half_of_all_ticks_that_were_late_meanwhile():
    assert judge(LATE, Rise(run_delay_ns=3e5), 4e5).cause == "another task"
    assert judge(LATE, Rise(run_delay_ns=3e5), 4e6).cause == "unknown"
