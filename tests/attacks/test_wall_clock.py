"""Somebody steps the wall clock by years, to and fro, while the rig is armed: nothing that decides looks at it.

CLOCK_REALTIME is the machine's; no namespace has one of its own, so it is not stepped here. That only the files below read it is
held by the first test, and the second steps what they read. The loop's process (`rtctl.rt`, `rtctl.control`, `hw`) has no reader at all.
"""

import re
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest
from patience import PATIENCE_S

from rtctl.config import load
from rtctl.control.vocabulary import State
from rtctl.demo import shipped_config
from rtctl.host.auto_arm import AutoArm
from rtctl.host.supervisor import Host

ROOT = Path(__file__).parents[2]
READS_IT = re.compile(
    r"\btime\.(time|time_ns|localtime|gmtime|ctime|strftime)\(|datetime\.(now|utcnow|today)\(|CLOCK_REALTIME|from time import"
)
READERS = {
    "rtctl/experiments/report.py": "the date of a report",
    "rtctl/friction/learn/fit.py": "the date of a model",
    "rtctl/friction/report/write.py": "the date of a report",
    "rtctl/host/description.py": "the wall time of the start, once, to be told beside monotonic times",
    "rtctl/host/telemetry.py": "the same of a virtual clock, in each message",
    "rtctl/identify/dataset.py": "the date of a data set",
    "rtctl/keys.py": "the date of a key",
    "rtctl/recording/parts.py": "the date of a part",
    "rtctl/recording/setup.py": "the date of a recording",
}
YEAR_NS = 365 * 86_400 * 10**9


def test_only_what_tells_a_person_the_date_reads_the_wall_clock():
    found = {
        str(path.relative_to(ROOT))
        for top in ("rtctl", "hw")
        for path in (ROOT / top).rglob("*.py")
        if READS_IT.search(path.read_text())
    }
    assert found == set(READERS)


class Step:
    """Steps the wall clock with every batch of ticks; ends the run when the rig has been active for a while."""

    def __init__(self, monkeypatch):
        self.rows, self.steps, self._true = [], 0, time.time_ns
        monkeypatch.setattr(time, "time_ns", lambda: self._true() + (-1) ** self.steps * self.steps * YEAR_NS)

    def __call__(self, host, rows):
        self.rows.append(rows)
        self.steps += 1
        active = sum(int((batch["state"] == State.ACTIVE).sum()) for batch in self.rows)
        if active > 500:
            host.finish()


@pytest.mark.compiled
def test_a_rig_under_torque_does_not_notice_that_the_clock_is_stepped(monkeypatch):
    step = Step(monkeypatch)
    with (
        tempfile.TemporaryDirectory(prefix="rt") as folder,
        Host(load(shipped_config("mock.toml")), observers=[AutoArm(), step], runtime_dir=folder) as host,
    ):
        summary = host.run(PATIENCE_S)
    rows = np.concatenate(step.rows)
    assert step.steps > 10
    assert (rows["state"] == State.ACTIVE).sum() > 500, summary
    assert (np.diff(rows["time_ns"]) > 0).all()
    assert not set(summary["faults"]) - {"STALLED"}, summary  # a busy machine's own
