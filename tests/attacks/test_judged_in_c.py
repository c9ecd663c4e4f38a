"""Loop or host is killed or halted under torque, judged by a board that shares no code with rtctl
(`board.c`).

The board has a watchdog of its own, writes down the longest time for which torque stayed on without a fresh
command, and sees whether any came back. What is halted shorter than the rig notices goes on and obeys then;
the rest is stopped by whoever still runs: the loop without its host (HOST_SILENT), the host or the board's
own watchdog without their loop. A STOP is sent in the first moment of each standstill.
"""

import os
import random
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest
from judged import Stopper, armed, ended, judged_lanes, run_out_of_memory, show, stand_still
from lanes import SEED, Death
from nursery import shared
from patience import PATIENCE_S

from tests.bench.attacks import MOST_MB
from tests.bench.flood import memory_mb

TARGETS = ("loop", "host")
MOST_LIVES = 5
"""For one planned death. The daemons have no real-time rights, and their starts side by side take the machine
from each other's loops."""
LONG_S = 1.0
"""Beyond the 200 ms after which a loop does not go on without its host, on any machine."""


def planned(kills):
    """Loop and host in turn, each at some random moment after torque has begun."""
    draw = random.Random(SEED)
    return [Death(k, TARGETS[k % 2], signal.SIGKILL, "torque", draw.randrange(60)) for k in range(kills)]


def lives(lane, planned_death, nursery):
    """The planned death, and again as long as a late loop had lost its torque to the board's watchdog before:
    each counts as a death.
    """
    lived = []
    while len(lived) < MOST_LIVES and not (lived and lived[-1].had_torque):
        lived.append(lane.live(replace(planned_death), nursery))
    return lived


def kill(lanes, nursery, kills):
    """All deaths, side by side, each of them judged."""
    every = planned(kills)

    def share(k):
        return [lived for death in every[k :: len(lanes)] for lived in lives(lanes[k], death, nursery)]

    with ThreadPoolExecutor(len(lanes)) as pool:
        deaths = [death for part in pool.map(share, range(len(lanes))) for death in part]
    had = sum(death.had_torque for death in deaths)
    show(f"\n{len(deaths)} deaths, {had} of them under torque")
    assert len(deaths) >= kills
    assert had >= kills / 2
    for death in deaths:
        assert len(death.after), str(death)
        assert not death.after["torque_nm"].any(), str(death)
        assert not death.after["enabled"].any(), str(death)
        assert not death.unarmed["enabled"].any(), str(death)
        assert death.code == (9 if death.target == "loop" else -signal.SIGKILL), f"{death}: {death.words}"


def judge(found, halted_s):
    show(found)
    assert not found.torque_later, f"{found}: torque came back by itself: {found.words}"
    if halted_s >= LONG_S:  # a fact, whatever the machine: it was over before the halted process went on
        assert found.obeyed_ms < 1e3 * halted_s, f"{found}: {found.words}"


def standstill_under_torque(lane, nursery, target):
    """A long one; and again, each judged, as long as the machine had kept the loop from its board: a
    watchdog's fault ends torque before a host can be missed.
    """
    for _ in range(MOST_LIVES):
        found = stand_still(lane, nursery, target, LONG_S)
        judge(found, LONG_S)
        if target == "loop" or "FAULT" not in found.state or "DEVICE" not in found.words:
            break
    return found


def test_four_kills_no_memory_and_a_standstill_of_loop_and_host(tmp_path_factory):
    with judged_lanes(tmp_path_factory.mktemp("judged"), 3) as lanes:
        kill(lanes[:2], shared(), 4)
        with ThreadPoolExecutor(3) as pool:
            starved = pool.submit(run_out_of_memory, lanes[2], shared())
            loop, host = pool.map(
                lambda lane, target: standstill_under_torque(lane, shared(), target), lanes[:2], TARGETS
            )
            judge(starved.result(), 0.0)
    assert "IDLE" in host.state, f"{host}: {host.words}"
    assert "exit 9" in loop.state, f"{loop}: {loop.words}"


@pytest.mark.system
@pytest.mark.timeout(300)
def test_a_hundred_kills(tmp_path_factory):
    with judged_lanes(tmp_path_factory.mktemp("kills"), 4) as lanes:
        kill(lanes, shared(), 100)


@pytest.mark.system
@pytest.mark.timeout(300)
def test_standstills_of_20_ms_to_10_s(tmp_path_factory):
    shares = (
        (("host", 10.0),),
        (("host", 0.02), ("host", 0.2), ("host", 2.0)),
        (("loop", 0.02), ("loop", 0.1), ("loop", 2.0)),
    )
    with (
        judged_lanes(tmp_path_factory.mktemp("halted"), len(shares)) as lanes,
        ThreadPoolExecutor(len(lanes)) as pool,
    ):
        done = pool.map(
            lambda lane, share: [stand_still(lane, shared(), *one) for one in share], lanes, shares
        )
        every = [found for part in done for found in part]
    for (_, seconds), found in zip((one for share in shares for one in share), every, strict=True):
        judge(found, seconds)


HOG = """
import os, sys, time
os.sched_setaffinity(0, {int(sys.argv[1])})
os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(int(sys.argv[2])))
print("hogging", flush=True)
end = time.monotonic() + float(sys.argv[3])
while time.monotonic() < end:
    pass
"""
HOG_S = 0.8


@pytest.mark.system
def test_a_hog_of_the_loops_priority_on_the_loops_core(tmp_path_factory):
    """The loop gets no core: its board is stopped by the host, or by its own watchdog."""
    with judged_lanes(tmp_path_factory.mktemp("hog"), 1) as (lane,):
        daemon, client = armed(lane, None)
        client.close()
        loop = daemon.loop()
        priority = os.sched_getparam(loop).sched_priority
        if os.sched_getscheduler(loop) != os.SCHED_FIFO:
            os.kill(daemon.pid, signal.SIGTERM)
            daemon.exit_code()
            pytest.skip("no real-time rights")
        (core,) = os.sched_getaffinity(loop)
        lane.board.be_punctual(priority + 1)  # a board has a processor of its own
        stopper, first = Stopper(lane), lane.observation.count
        memory = memory_mb(daemon.pid)
        command = [sys.executable, "-c", HOG, str(core), str(priority), str(HOG_S)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as hog:
            assert hog.stdout.readline() == "hogging\n"
            stopper.start()
            stopper.join(PATIENCE_S)
            found = ended(lane, daemon, stopper.sent_ns, None, first, "a hog of the loop's priority", memory)
    judge(found, 0.0)
    assert found.memory_mb < MOST_MB
