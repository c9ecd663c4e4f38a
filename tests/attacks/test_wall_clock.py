"""Somebody steps the wall clock by hours and years, to and fro, while the rig is armed: nothing that decides
looks at it.

The machine's own clock is left alone. Host, loop and renderer load a library (`stepped_clock.c`) that puts
CLOCK_REALTIME, gettimeofday and time off by what the test says. A board in C judges the torque, and
recordings are read back.
"""

import contextlib
import os
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from judged import Stopper, armed, ended, judged_lanes, obeyed_ns, show
from nursery import Nursery
from patience import PATIENCE_S
from stepped_clock import SteppedClock
from test_judged_in_c import LONG_S, judge

from rtctl.control.vocabulary import Environment, State
from rtctl.recording.reader import RecordingReader, all_parts
from tests.bench.flood import memory_mb

ROOT = Path(__file__).parents[2]
READS_IT = re.compile(
    r"\btime\.(time|time_ns|localtime|gmtime|ctime|strftime)\(|datetime\.(now|utcnow|today)\("
    r"|CLOCK_REALTIME|from time import"
)
READERS = {
    "hw/can/adapter.py": "the stamp of a frame for peers on the in-process bus, as python-can writes it",
    "rtctl/experiments/report.py": "the date of a report",
    "rtctl/friction/learn/fit.py": "the date of a model",
    "rtctl/friction/learn/report_write.py": "the date of a report",
    "rtctl/host/exchange/rig_description.py": "the wall time of the start, once, to be told beside "
    "monotonic times",
    "rtctl/host/exchange/streams.py": "the same of a virtual clock, in each message",
    "rtctl/identify/dataset.py": "the date of a data set",
    "rtctl/wire/keys.py": "the date of a key",
    "rtctl/recording/parts.py": "the date of a part",
    "rtctl/recording/setup.py": "the date of a recording",
    "rtctl/whole_files.py": "the age of what a power cut left of a file, beside whether its process is gone",
}
STEPS_H = (3.0, -3.0, 24 * 365 * 10, -24 * 365 * 10)
"""Of the wall clock against the true one, one after the other: by hours and by years, both ways."""

EACH_S = 0.3
RENDERER = """
import sys, time
from rtctl.client import RigClient
print("ready", flush=True)
sys.stdin.readline()
with RigClient(sys.argv[1], runtime_dir=sys.argv[2], timeout_s=60.0) as rig, rig.lease() as lease:
    rig.set_environment(0, "remote")
    while not lease.lost:
        lease.set_target([lease.start_rad[0] + 0.2])
        time.sleep(0.02)
"""


class Renderer:
    """A program whose clock is stepped, too: moves the proxy until the rig is stopped."""

    def __init__(self, lane):
        command = [sys.executable, "-c", RENDERER, lane.name, str(lane.runtime)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline() == "ready\n"

    def begin(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    def close(self):
        self.process.kill()
        self.process.communicate()


def test_only_what_tells_a_person_the_date_reads_the_wall_clock():
    found = {
        str(path.relative_to(ROOT))
        for top in ("rtctl", "hw")
        for path in (ROOT / top).rglob("*.py")
        if READS_IT.search(path.read_text())
    }
    assert found == set(READERS)


def record_all(lane):
    path, folder = lane.config, lane.folder / "recording"
    path.write_text(f'{path.read_text()}\n[record]\nfolder = "{folder}"\n')
    return folder


def under_steps(client, ticks, renderer, clock):
    """Ticks of an armed rig whose targets come from a renderer, and its samples, through all steps."""
    rows, samples = [], []
    renderer.begin()
    end = time.monotonic() + PATIENCE_S
    while (ticks.receive(PATIENCE_S)["environment_kind"][-1] != Environment.REMOTE).any():
        assert time.monotonic() < end, "no targets"
    for hours in STEPS_H:
        clock.step(hours)
        end = time.monotonic() + EACH_S
        while time.monotonic() < end:
            rows.append(ticks.receive(PATIENCE_S))
            samples.append(client.latest_state())
    return np.concatenate(rows), samples


def live(lane, nursery, clock, halt_s=0.0):
    """A daemon through all steps, then a STOP; its host halted in that moment if `halt_s`. None where a tick
    was missed or was not ACTIVE.
    """
    renderer = Renderer(lane)
    try:
        daemon, client = armed(lane, nursery)
        stopper = Stopper(lane)
        assert clock.is_in(daemon.pid)
        assert clock.is_in(daemon.loop())
        with client, client.ticks() as ticks:
            rows, samples = under_steps(client, ticks, renderer, clock)
            first, memory = lane.observation.count, memory_mb(daemon.pid)
            with halted(daemon, halt_s):
                stopper.start()
            begun = obeyed_ns(ticks, stopper.sent_ns, 10.0)
        stopper.join(PATIENCE_S)
    finally:
        renderer.close()
    what = f"the wall clock stepped{', the host halted' if halt_s else ''}"
    found = ended(lane, daemon, stopper.sent_ns, begun, first, what, memory)
    went = set(np.diff(rows["tick"]))
    if (rows["state"] == State.ACTIVE).all() and went == {1}:
        return rows, samples, found
    show(
        f"begun anew: states {set(rows['state'])}, faults {set(rows['faults'])}, ticks by {went}: "
        f"{found.words}"
    )
    return None


def lived(*life):
    """The first life that a busy machine did not disturb; a clock that is stepped would disturb all of
    them.
    """
    for _ in range(5):
        if (found := live(*life)) is not None:
            return found
    raise AssertionError("not every tick, and ACTIVE in it, in any of five lives")


@contextlib.contextmanager
def halted(daemon, seconds):
    if not seconds:
        yield
        return
    os.kill(daemon.pid, signal.SIGSTOP)
    try:
        yield
        time.sleep(seconds)
    finally:
        os.kill(daemon.pid, signal.SIGCONT)


@pytest.fixture(scope="module")
def clock(tmp_path_factory):
    return SteppedClock(tmp_path_factory.mktemp("clock"))


def test_a_rig_under_torque_does_not_notice_that_the_clock_is_stepped(clock, tmp_path_factory, monkeypatch):
    """Torque, target ages, samples, recording, STOP, and the heartbeat: after a step back, too, a loop goes
    on without its host for 200 ms.
    """
    for name, value in clock.environment.items():
        monkeypatch.setenv(name, value)
    with judged_lanes(tmp_path_factory.mktemp("stepped"), 2) as lanes, ThreadPoolExecutor(2) as pool:
        folder, nursery = record_all(lanes[0]), Nursery()
        try:
            lives = [pool.submit(lived, lane, nursery, clock, k * LONG_S) for k, lane in enumerate(lanes)]
            lives = [life.result() for life in lives]
        finally:
            nursery.close()
    assert clock.reads > 0
    assert clock.waits == 0
    for halt_s, (rows, samples, found) in zip((0.0, LONG_S), lives, strict=True):
        judge(found, halt_s)
        went_on(rows, samples)
    recorded_whole(folder, lives[0][0])


def went_on(rows, samples):
    assert set(np.diff(rows["tick"])) == {1}
    assert (np.diff(rows["time_ns"]) > 0).all()
    assert len({round(one.timestamp - one.monotonic_s, 3) for one in samples}) == 1, (
        "stamps go on as they began"
    )
    assert all(0.0 <= one.age_s < PATIENCE_S for one in samples)
    monotonic_s = [one.monotonic_s for one in samples]
    assert monotonic_s == sorted(monotonic_s)


def recorded_whole(folder, rows):
    newest = max(folder.glob("*.mcap"), key=lambda path: path.stat().st_mtime_ns)
    reader = RecordingReader(all_parts(newest))
    found = reader.read()
    damage = (reader.cut, reader.left_out, reader.notes, reader.bad_chunks)
    assert not any(damage), damage
    at = np.searchsorted(found.rows["tick"], rows["tick"])
    assert (found.rows["time_ns"][at] == rows["time_ns"]).all()
    assert len({round(event["timestamp"] - event["monotonic_s"], 3) for event in found.events}) == 1
    assert rows["time_ns"][-1] * 1e-9 < found.events[-1]["monotonic_s"], "the STOP"
