"""The daemon for a long time under churn and floods: does it grow, leak descriptors, or miss ticks of its
own?

Subscribers come and go, floods of junk, valid requests and targets come in turn, cyclictest runs on the
loop's core at the same time. Loopback only; everything started here ends with it.
"""

from __future__ import annotations

import random
import subprocess
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from rtctl.client import RigClient
from rtctl.errors import LoopDiedError, RtctlError
from rtctl.rig_file.config import load
from tests.bench import cyclictest
from tests.bench.child import SAID, START_S
from tests.bench.cyclictest import Latencies
from tests.bench.flood import daemon_on_loopback, flooding
from tests.bench.loop import loop_core
from tests.bench.row import Row, in_turns

FLOODS = ("junk", "valid", "targets")
FLOOD_PERIOD_S = 15.0
FLOOD_S = 2.0
MOST_WARM_UP_S = 60.0
REST_S = 3.0
MOST_START_S = 600.0
"""The daemon may live for this much longer than the soak."""
LAST_S = FLOOD_S + 1.0
"""A churn may end this much late: cyclictest runs for as long as our ticks are counted."""
GROWTH_MB = 1.0
LOOKS, LOOK_EVERY_S = 10, 0.1
MISSED_FACTOR = 1.2


@dataclass(frozen=True)
class Footprint:
    """Resident memory, MB, and open descriptors of host and loop together; ticks missed so far."""

    host_mb: float
    loop_mb: float
    descriptors: int
    missed: int
    ticks: int


@dataclass
class Found:
    """What a soak has found by now."""

    looks: list[Footprint] = field(default_factory=list)
    """After warming up, and after each flood since."""
    subscribers: int = 0
    beside: Future[Latencies] | None = None

    def missed_beside(self, interval_us: int) -> int | None:
        """Slots that cyclictest has missed; None without it, or where it was ended too."""
        try:
            return None if self.beside is None else self.beside.result().missed(interval_us)
        except RtctlError:
            return None


def rows(config: Path, minutes: float, say: Callable[[str], None] = lambda _text: None) -> Iterator[Row]:
    """Churn and flood for `minutes`; a first part, at most `MOST_WARM_UP_S`, is not counted."""
    found = Found()
    interval_us = round(1e6 / load(config).config.loop.rate_hz)
    return in_turns(_turns(config, 60.0 * minutes, found, say), lambda: _rows(found, interval_us))


def _turns(config: Path, seconds: float, found: Found, say: Callable[[str], None]) -> Iterator[None]:
    """A turn lasts from one flood to the next."""
    warm_up_s = min(MOST_WARM_UP_S, 0.3 * seconds)
    loaded = load(config).config.loop
    interval_us = round(1e6 / loaded.rate_hz)
    with (
        daemon_on_loopback(config, seconds + MOST_START_S) as (process, folder, _key, _port),
        RigClient(load(config).config.rig.name, runtime_dir=folder) as rig,
        ThreadPoolExecutor(1) as pool,
    ):
        rig.timeout_s = START_S
        rig.hello()
        found.subscribers += sum(_churn(rig, folder, warm_up_s, say))
        found.looks.append(_footprint(process, folder, rig))
        if cyclictest.available():
            whole_s = seconds - warm_up_s + REST_S + LAST_S
            found.beside = pool.submit(cyclictest.run, whole_s, interval_us, loaded.priority, loop_core())
        for came in _churn(rig, folder, seconds - warm_up_s, say):
            found.subscribers += came
            found.looks.append(_footprint(process, folder, rig))
            yield


def _rows(found: Found, interval_us: int) -> list[Row]:
    before, after, reference = found.looks[0], found.looks[-1], found.missed_beside(interval_us)
    text = f"{after.ticks - before.ticks} ticks, {found.subscribers} subscribers came and went"
    missed = after.missed - before.missed
    beside = "cyclictest is missing" if reference is None else f"cyclictest beside it {reference}"
    ratio = float("nan") if reference is None else missed / max(1, reference)
    return [
        Row("growth of the host", after.host_mb - before.host_mb, "MB", f"{after.host_mb:.1f} MB; {text}",
            GROWTH_MB),
        Row("growth of the loop", after.loop_mb - before.loop_mb, "MB", f"{after.loop_mb:.1f} MB", GROWTH_MB),
        Row("descriptors gained", after.descriptors - before.descriptors, "", f"{after.descriptors} open",
            0.0),
        Row("missed ticks against cyclictest", ratio, "x", f"ours {missed}, {beside}", MISSED_FACTOR),
    ]  # fmt: skip


def _churn(rig: RigClient, folder: str, seconds: float, say: Callable[[str], None]) -> Iterator[int]:
    """Subscribe, listen, go, again and again, and flood now and then; subscribers that came, at each flood
    but the first and at the end.
    """
    draw = random.Random(1)
    began = time.monotonic()
    next_flood, came, floods = began, 0, 0
    name = str(rig.hello()["rig"])
    while (now := time.monotonic()) < began + seconds:
        if now >= next_flood:
            if floods:
                yield came
                came = 0
            next_flood = now + FLOOD_PERIOD_S
            kind = FLOODS[floods % len(FLOODS)]
            floods += 1
            address = rig.endpoints.targets if kind == "targets" else rig.endpoints.command
            say(f"{now - began:.0f} of {seconds:.0f} s: flood of {kind}")
            with flooding(kind, address, FLOOD_S):
                came += _listen(name, folder, FLOOD_S)
        came += _listen(name, folder, draw.uniform(0.05, 0.5))
    time.sleep(REST_S)  # what the last ones left is freed
    yield came


def _listen(name: str, folder: str, seconds: float) -> int:
    """One subscriber for `seconds`."""
    end = time.monotonic() + seconds
    with RigClient(name, runtime_dir=folder) as client, client.ticks() as ticks, client.health() as health:
        while time.monotonic() < end:
            ticks.receive(0.05)
            health.receive(0.0)
    return 1


def _footprint(process: subprocess.Popen[bytes], folder: str, rig: RigClient) -> Footprint:
    host = process.pid
    children = Path(f"/proc/{host}/task/{host}/children").read_text().split()
    if not children:
        code = process.wait(START_S)
        raise LoopDiedError(f"the daemon ended, {code}: {(Path(folder) / SAID).read_text()}")
    loop = int(children[0])
    status = rig.status()
    return Footprint(
        host_mb=resident_mb(host),
        loop_mb=resident_mb(loop),
        descriptors=_kept_descriptors((host, loop)),
        missed=int(status["missed_ticks"]),
        ticks=int(status["tick"]),
    )


def _kept_descriptors(pids: tuple[int, int]) -> int:
    """Open descriptors of these processes, the fewest of several looks: who has just gone is let go of a
    moment later on a machine with other work, and what leaks is there at every look.
    """
    seen = []
    for _ in range(LOOKS):
        seen.append(sum(len(list(Path(f"/proc/{pid}/fd").iterdir())) for pid in pids))
        time.sleep(LOOK_EVERY_S)
    return min(seen)


def resident_mb(pid: int) -> float:
    """Resident memory of a process that is its own, MB: shared rings that fill up once are not counted."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("RssAnon:"):
            return float(line.split()[1]) / 1024
    return float("nan")
