"""Late ticks made on purpose, and whether the daemon names what made them: `rtctl bench blame`.

Each kind of disturbance comes in bursts half a second apart, on the loop's own core. Judged is the worst tick that the
daemon tells of within the time of each burst; bursts that made no tick late are told and do not count.

`python -m tests.bench.blame CORE PRIORITY` is the task that takes the core: a spell of computing for every line that it reads.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rtctl.client import RigClient
from rtctl.errors import RtctlError
from rtctl.rig_file.config import load
from tests.bench.child import START_S, daemon, end
from tests.bench.row import Row

SPELL_S = 0.02
"""How long a burst takes the loop's core, or stops the loop."""

PAUSE_S = 0.6
"""From burst to burst: the daemon tells of late ticks four times a second at most."""

RIGHT = 0.95

QUOTAS = Path("/sys/fs/cgroup/cpu")
"""Control groups of version 1; version 2 is not written to: systemd owns it."""

HOG = "rtctl-hog"


@dataclass
class Told:
    """What was told of the bursts of one kind."""

    kind: str
    right: int = 0
    others: list[str] = field(default_factory=list)
    without: int = 0

    def row(self) -> Row:
        """The share named right."""
        judged = self.right + len(self.others)
        wrong = f"; told instead: {', '.join(sorted(set(self.others)))}" if self.others else ""
        return Row(
            f"late ticks by {self.kind}: named right",
            self.right / judged if judged else float("nan"),
            "",
            f"{judged} bursts, {self.without} more without a late tick{wrong}",
            RIGHT,
            ">=",
        )


def rows(config: Path, bursts: int) -> list[Row]:
    """One row for each kind. Raises RtctlError without the right to a real-time priority."""
    found = []
    with tempfile.TemporaryDirectory(prefix="rt") as name, _rig(config, Path(name), "") as (rig, loop, core):
        with _hog(core, 95) as spell:
            found.append(_told(rig, "another task", bursts, spell, {"another task"}, HOG))
        found.append(_told(rig, "a stop of the process", bursts, lambda: _stop(loop), {"stopped"}))
    with tempfile.TemporaryDirectory(prefix="rt") as name:
        more = f'\n[[device.options.faults]]\nchannel = "loop"\nkind = "stall"\nat_s = 3.0\nfor_ticks = 1\nevery_s = {PAUSE_S}\nvalue = 20\n'
        with _rig(config, Path(name), more) as (rig, _loop, _core):
            found.append(_told(rig, "a device that blocks", bursts, lambda: None, {"own cycle"}, "read"))
    with (
        tempfile.TemporaryDirectory(prefix="rt") as name,
        _rig(config, Path(name), "", realtime="off") as (rig, loop, core),
        _hog(core, 0) as spell,
    ):
        os.sched_setaffinity(loop, {core})
        kind = "an ordinary task, without real-time rights"
        found.append(_told(rig, kind, bursts, spell, {"another task"}, HOG))
        found.append(_told(rig, "timer slack", bursts, lambda: _slack(loop), {"timer slack"}))
        if QUOTAS.is_dir():
            found.append(_told(rig, "a quota", bursts, lambda: _hold(loop), {"quota"}))
    return [one.row() for one in found]


@contextmanager
def _rig(
    config: Path, folder: Path, more: str, realtime: str = "require"
) -> Iterator[tuple[RigClient, int, int]]:
    """A daemon with a client, its loop's process and the core that this is on."""
    text = config.read_text().replace('"friction/', f'"{config.parent}/friction/')
    here = folder / "source.toml"
    here.write_text(
        re.sub(r'^realtime = "\w+"', f'realtime = "{realtime}"', text, count=1, flags=re.MULTILINE)
    )
    with (
        daemon(here, folder, more, seconds=600.0) as process,
        RigClient(load(config).config.rig.name, runtime_dir=folder) as rig,
    ):
        rig.timeout_s = START_S
        rig.hello()
        loop = _child(process.pid)
        yield rig, loop, _core_of(loop)


def _child(pid: int) -> int:
    """The loop: the host's child that runs `rtctl.rt`."""
    for one in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
        if b"rtctl.rt" in Path(f"/proc/{one}/cmdline").read_bytes():
            return int(one)
    raise RtctlError("the daemon has no loop process")


def _core_of(pid: int) -> int:
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[36])


def _stop(pid: int) -> None:
    os.kill(pid, signal.SIGSTOP)
    try:
        time.sleep(SPELL_S)
    finally:
        os.kill(pid, signal.SIGCONT)


def _slack(pid: int) -> None:
    """Have the kernel wake the loop up to `SPELL_S` late, for a spell."""
    file = Path(f"/proc/{pid}/timerslack_ns")
    before = file.read_text()
    file.write_text(str(round(SPELL_S * 1e9)))
    try:
        time.sleep(3 * SPELL_S)
    finally:
        file.write_text(before)


def _hold(pid: int) -> None:
    """Put the loop into a control group that may run for a hundredth of the time, for a spell."""
    group = QUOTAS / f"rtctl-bench-{os.getpid()}"
    group.mkdir()
    try:
        (group / "cpu.cfs_period_us").write_text("100000")
        (group / "cpu.cfs_quota_us").write_text("1000")
        (group / "cgroup.procs").write_text(str(pid))
        time.sleep(10 * SPELL_S)
    finally:
        (QUOTAS / "cgroup.procs").write_text(str(pid))
        group.rmdir()


@contextmanager
def _hog(core: int, priority: int) -> Iterator[Callable[[], None]]:
    """A task that takes the core for a spell whenever it is asked to."""
    command = [sys.executable, "-m", "tests.bench.blame", str(core), str(priority)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert process.stdin is not None
    assert process.stdout is not None
    asked, done = process.stdin, process.stdout

    def spell() -> None:
        asked.write(b"\n")
        asked.flush()
        done.readline()

    try:
        if done.readline() != b"ready\n":
            raise RtctlError(f"no real-time priority {priority} for the task that disturbs; run as root")
        yield spell
    finally:
        asked.close()
        done.close()
        end(process)


def _told(
    rig: RigClient, kind: str, bursts: int, burst: Callable[[], None], causes: set[str], name: str = ""
) -> Told:
    found = Told(kind)
    with rig.events() as events:
        quiet = time.monotonic() + PAUSE_S
        while time.monotonic() < quiet:
            events.receive(PAUSE_S)
        for _ in range(bursts):
            burst()
            worst: dict[str, Any] | None = None
            until = time.monotonic() + PAUSE_S
            while (left_s := until - time.monotonic()) > 0:
                event = events.receive(left_s)
                if event is None or event["event"] != "late":
                    continue
                if event["worst_us"] >= 2e3 and (worst is None or event["worst_us"] > worst["worst_us"]):
                    worst = event
            if worst is None:
                found.without += 1
            elif worst["cause"] in causes and name in worst["name"]:
                found.right += 1
            else:
                found.others.append(f"{worst['cause']} ({worst['name']})")
    return found


def _say(word: str) -> None:
    sys.stdout.write(f"{word}\n")
    sys.stdout.flush()


def main(core: int, priority: int) -> None:
    """Compute for `SPELL_S` whenever a line comes."""
    Path("/proc/self/comm").write_text(HOG)
    os.sched_setaffinity(0, {core})
    try:
        if priority:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except PermissionError:
        _say("refused")
        return
    _say("ready")
    for _ in sys.stdin:
        began = time.monotonic()
        while time.monotonic() - began < SPELL_S:
            pass
        _say("done")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
