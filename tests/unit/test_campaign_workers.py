"""Workers of a campaign end with the process that began them: a campaign that was ended left one process a
core for ever.
"""

import os
import signal
import subprocess
import sys
from pathlib import Path

from patience import PATIENCE_S, until

from rtctl.simulation import campaign_margins, campaign_workers
from rtctl.simulation.campaign_workers import results

WORK = r"""
import os, time
from rtctl.simulation.campaign_workers import results
def work(i):
    os.write(1, b"%d\n" % os.getpid())
    time.sleep(600)
list(results(work, [1, 2], jobs=2))
"""


def test_results_come_in_the_order_of_what_was_asked():
    assert list(results(pow, [2, 3, 4], [1, 2, 3], jobs=2)) == [2, 9, 64]


def test_workers_end_with_their_parent():
    command = [sys.executable, "-c", WORK]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as parent:
        try:
            workers = [int(parent.stdout.readline()) for _ in range(2)]
        finally:  # whatever was read, or the test would wait for as long as the work takes
            parent.send_signal(signal.SIGTERM)
        assert parent.wait(PATIENCE_S) == -signal.SIGTERM
        try:
            until(lambda: not any(map(_lives, workers)), "the end of the workers")
        finally:
            for pid in filter(_lives, workers):
                os.kill(pid, signal.SIGKILL)


def _lives(pid):
    """Whether it runs: one that has ended and that nobody has asked for has no program."""
    return Path(f"/proc/{pid}/exe").exists()


def test_there_are_as_many_workers_as_cores_that_may_be_used(monkeypatch):
    asked = []

    class Pool(campaign_workers.ProcessPoolExecutor):
        def __init__(self, n, **options):
            asked.append(n)
            super().__init__(n, **options)

    monkeypatch.setattr(campaign_workers, "ProcessPoolExecutor", Pool)
    monkeypatch.setattr(os, "cpu_count", lambda: 64)
    assert list(results(pow, [2], [3])) == [8]
    assert asked == [len(os.sched_getaffinity(0))]


def test_the_campaign_of_linear_rigs_has_such_workers_too(monkeypatch):
    asked, told = [], []

    def here(work, *arguments, jobs):
        asked.append((work, jobs))
        yield from (
            [("worst", index, False, None) for index in part] for _seed, part in zip(*arguments, strict=True)
        )

    monkeypatch.setattr(campaign_workers, "results", here)
    found = campaign_margins.run(25, seed=1, jobs=3, progress=told.append)
    assert asked == [(campaign_margins._part, 3)]
    assert (found.certified, told) == ({"worst": 25}, [20, 5])
