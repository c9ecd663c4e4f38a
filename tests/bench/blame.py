"""Late ticks made on purpose, and whether the daemon names what made them: `rtctl bench blame`.

Each kind of disturbance comes in bursts half a second apart, on the loop's own core, a block of bursts of
each kind in turn, and all that again: what the machine does besides falls on every kind alike. Judged is the
worst tick that the daemon tells of, if half of its lateness at least fell into the burst; it is named right
only if cause and name both are. Bursts without such a tick, and those that shared the core with somebody
else's task, are told and do not count.
"""

from __future__ import annotations

import os
import re
import signal
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from rtctl.client import RigClient
from rtctl.errors import RtctlError
from rtctl.rig_file.config import load
from tests.bench.child import SAID, START_S, daemon
from tests.bench.disturbed_device import BLOCK, FAULT, KIND, install
from tests.bench.disturber import NAME, SPELL_S, disturber
from tests.bench.row import Row, in_turns

PAUSE_S = 0.6
"""From burst to burst: the daemon tells of late ticks four times a second at most."""

RIGHT = 0.95

LEAST_US, LEAST_FLOOD_US = 2000.0, 200.0
"""Least lateness that is judged. What a flood holds the loop up for ends with every few hundred packets."""

QUOTAS = Path("/sys/fs/cgroup/cpu")
"""Control groups of version 1; version 2 is not written to: systemd owns it."""

PRIORITY = 95
"""Of tasks that take the core from a loop with real-time rights."""


class _EndedError(RtctlError):
    """The loop has ended, and the daemon with it: a loop without real-time rights that stands for long is
    killed.
    """


@dataclass
class Told:
    """What was told of the bursts of one kind."""

    right: int = 0
    others: Counter[str] = field(default_factory=Counter)
    without: int = 0
    """Bursts that made no tick late, or had the core for a part of their time only."""

    @property
    def judged(self) -> int:
        """Bursts with a late tick."""
        return self.right + self.others.total()

    def row(self, name: str) -> Row:
        """The share named right."""
        wrong = ", ".join(f"{count} {text}" for text, count in self.others.most_common())
        return Row(
            name,
            self.right / self.judged if self.judged else float("nan"),
            "",
            f"{self.right} of {self.judged} bursts, {self.without} more without a late tick of theirs"
            + (f"; told instead: {wrong}" if wrong else ""),
            RIGHT,
            ">=",
        )


@dataclass(frozen=True)
class Kind:
    """A kind of disturbance: what a burst does, and what is right to say of it."""

    text: str
    burst: Callable[[], bool]
    """Whether it was made as it should."""
    cause: str
    name: str = ""
    least_us: float = LEAST_US


def rows(config: Path, bursts: int) -> Iterator[Row]:
    """One row for each kind, and one for all. Raises RtctlError without the right to a real-time priority."""
    period_s = 1.0 / load(config).config.loop.rate_hz
    rounds = 2 if bursts < 20 else 4
    block = -(-bursts // rounds)
    found: dict[str, Told] = {}
    ended: list[str] = []

    def turns() -> Iterator[None]:
        for kinds_of, realtime in ((_on_real_time, "require"), (_without_rights, "off")) * rounds:
            with (
                _noted(ended),
                tempfile.TemporaryDirectory(prefix="rt") as name,
                _rig(config, Path(name), realtime) as (rig, loop, core),
                ExitStack() as stack,
            ):
                for kind in kinds_of(stack, Path(name), loop, core, block):
                    _judge(rig, kind, block, period_s, found.setdefault(kind.text, Told()))
                    yield

    def told() -> Iterator[Row]:
        for kind, one in found.items():
            yield one.row(f"late ticks by {kind}: named right")
        yield Row("rigs that ended in the middle", float(len(ended)), "", "; ".join(ended))
        yield _sum(list(found.values())).row("late ticks of all kinds: named right")

    return in_turns(turns(), told)


@contextmanager
def _noted(ended: list[str]) -> Iterator[None]:
    """Go on with the next rig where a loop has ended, and note what its daemon said last."""
    try:
        yield
    except _EndedError as error:
        ended.append(str(error).rpartition("\n")[2])


def _sum(told: list[Told]) -> Told:
    return Told(
        sum(one.right for one in told),
        sum((one.others for one in told), Counter()),
        sum(one.without for one in told),
    )


def _on_real_time(stack: ExitStack, folder: Path, loop: int, core: int, count: int) -> Iterator[Kind]:
    """Kinds that reach a loop with real-time rights, and those of its device."""
    spell = stack.enter_context(disturber("task", core, PRIORITY))
    yield Kind("another task", spell, "another task", NAME)
    spell = stack.enter_context(disturber("ended", core, PRIORITY, count))
    yield Kind("a task that ends", spell, "another task", NAME)
    spell = stack.enter_context(disturber("brief", core, PRIORITY))
    yield Kind("a task begun and ended", spell, "another task", NAME)
    spell = stack.enter_context(disturber("flood", core))
    yield Kind("a flood of packets", spell, "softirq", "NET_RX", LEAST_FLOOD_US)
    yield Kind("a stop of the process", partial(_stop, loop), "stopped")
    yield Kind("a device that blocks", partial(_order, folder, BLOCK), "own cycle", "read")
    yield Kind("page faults", partial(_order, folder, FAULT), "page fault", "read")


def _without_rights(stack: ExitStack, _folder: Path, loop: int, core: int, _count: int) -> Iterator[Kind]:
    """Kinds that reach a loop without real-time rights."""
    os.sched_setaffinity(loop, {core})
    spell = stack.enter_context(disturber("task", core))
    yield Kind("an ordinary task, without real-time rights", spell, "another task", NAME)
    yield Kind("timer slack", partial(_slack, loop), "timer slack")
    if QUOTAS.is_dir():
        yield Kind("a quota", stack.enter_context(_group(loop)), "quota")


@contextmanager
def _rig(config: Path, folder: Path, realtime: str) -> Iterator[tuple[RigClient, int, int]]:
    """A daemon with a client, its loop's process and the core that this is on. With real-time rights, its
    device takes orders.
    """
    text = config.read_text().replace('"friction/', f'"{config.parent}/friction/')
    text = re.sub(r'^realtime = "\w+"', f'realtime = "{realtime}"', text, count=1, flags=re.MULTILINE)
    if realtime == "require":
        text = text.replace('kind = "mock"', f'kind = "{KIND}"', 1)
    here = folder / "source.toml"
    here.write_text(text)
    with (
        daemon(here, folder, "", seconds=600.0, environment=install(folder)) as process,
        RigClient(load(config).config.rig.name, runtime_dir=folder) as rig,
    ):
        rig.timeout_s = START_S
        rig.hello()
        loop = _child(process.pid)
        try:
            yield rig, loop, _core_of(loop)
        except (FileNotFoundError, ProcessLookupError) as error:
            said = (folder / SAID).read_text(errors="replace").strip()
            raise _EndedError(said) from error


def _child(pid: int) -> int:
    """The loop: the host's child that runs `rtctl.rt`."""
    for one in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
        if b"rtctl.rt" in Path(f"/proc/{one}/cmdline").read_bytes():
            return int(one)
    raise RtctlError("the daemon has no loop process")


def _core_of(pid: int) -> int:
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[36])


def _order(folder: Path, order: int) -> bool:
    """Have the device do it in its next `read`, which is over within a spell."""
    with (folder / "order").open("r+b") as file:
        file.write(bytes([order]))
    time.sleep(2 * SPELL_S)
    return True


def _stop(pid: int) -> bool:
    os.kill(pid, signal.SIGSTOP)
    try:
        time.sleep(SPELL_S)
    finally:
        os.kill(pid, signal.SIGCONT)
    return True


def _slack(pid: int) -> bool:
    """Have the kernel wake the loop up to `SPELL_S` late, for a spell."""
    file = Path(f"/proc/{pid}/timerslack_ns")
    before = file.read_text()
    file.write_text(str(round(SPELL_S * 1e9)))
    try:
        time.sleep(3 * SPELL_S)
    finally:
        file.write_text(before)
    return True


@contextmanager
def _group(pid: int) -> Iterator[Callable[[], bool]]:
    """Put the loop into a control group; what is yielded lets that run for a hundredth of the time, for a
    spell.
    """
    group = QUOTAS / f"rtctl-bench-{os.getpid()}"
    group.mkdir()
    quota = group / "cpu.cfs_quota_us"

    def hold() -> bool:
        quota.write_text("1000")
        time.sleep(10 * SPELL_S)
        quota.write_text("-1")
        return True

    try:
        (group / "cpu.cfs_period_us").write_text("100000")
        (group / "cgroup.procs").write_text(str(pid))
        yield hold
    finally:
        with suppress(ProcessLookupError):  # a loop that has ended is in no group
            (QUOTAS / "cgroup.procs").write_text(str(pid))
        group.rmdir()


def _judge(rig: RigClient, kind: Kind, bursts: int, period_s: float, found: Told) -> None:
    """Make so many bursts, and add what is told of them."""
    with rig.events() as events:
        quiet = time.monotonic() + PAUSE_S
        while time.monotonic() < quiet:
            events.receive(PAUSE_S)
        for _ in range(bursts):
            began = time.monotonic()
            made = kind.burst()
            ended = time.monotonic()
            worst: dict[str, Any] | None = None
            while (left_s := ended + PAUSE_S - time.monotonic()) > 0:
                event = events.receive(left_s)
                if (
                    event is not None
                    and event["event"] == "late"
                    and event["worst_us"] >= max(kind.least_us, worst["worst_us"] if worst else 0.0)
                    and inside(event, began, ended, period_s)
                ):
                    worst = event
            if worst is None or not made:
                found.without += 1
            elif worst["cause"] == kind.cause and kind.name in worst["name"]:
                found.right += 1
            else:
                found.others[f"{worst['cause']} ({worst['name']})"] += 1


def inside(event: dict[str, Any], began: float, ended: float, period_s: float) -> bool:
    """Whether half of the worst tick's lateness at least fell between two times of CLOCK_MONOTONIC, s.

    A tick that skipped slots bears the number of the slot that it began in; an event, number and deadline of
    the tick that it was told at.
    """
    deadline = event["monotonic_s"] - (event["tick"] - event["worst_tick"]) * period_s
    late_s = event["worst_us"] * 1e-6
    woke = deadline + late_s % period_s
    return bool(min(woke, ended + period_s) - max(woke - late_s, began - period_s) >= 0.5 * late_s)
