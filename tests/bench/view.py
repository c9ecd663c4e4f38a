"""The live view: what it takes of a core and of memory beside a rig, and how soon a browser shows it."""

from __future__ import annotations

import http.client
import os
import re
import socket
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rtctl.client import RigClient
from rtctl.errors import LoopDiedError
from rtctl.rig_file.config import load
from tests.bench.browser import browser, installed
from tests.bench.child import START_S, daemon
from tests.bench.row import Row, in_turns

SETTLE_S = 1.0
SIGNALS = "position_rad.0,hand_torque_nm.0,torque_applied_nm.0"
OPENING = "view: opening to first data drawn, median"
DRAWN = 'performance.getEntriesByName("first data drawn")[0]?.startTime'


@dataclass
class Shown:
    """A daemon with its view: port of the page, process id of the view."""

    port: int
    pid: int


def rows(config: Path, seconds: float, loads: int) -> Iterator[Row]:
    """CPU while nobody looks, then CPU and memory with one browser's stream open; page loads in a Chromium,
    where there is one."""
    with daemon_with_view(config) as shown:
        idle, before = _share(shown.pid, seconds), "before any browser came"
        yield Row("view: share of a core while nobody looks", 100 * idle, "%", before, 1.0)
        share, resident_mb, own_mb = _cost(shown, seconds)
        text = f"one browser, {seconds:g} s, source at 1 kHz"
        yield Row("view: share of a core", 100 * share, "%", text, 5.0)
        yield Row("view: most resident memory", resident_mb, "MB", f"{own_mb:.0f} MB of it its own", 50.0)
        program = installed()
        if program is None:
            text = "not measured: needs a Chromium (Debian: apt-get install chromium)"
            yield Row(OPENING, float("nan"), "ms", text)
            return
        started_ms: list[float] = []
        drawn_ms: list[float] = []
        bare_ms: list[float] = []
        turns = _page_loads(program, shown.port, loads, started_ms, drawn_ms, bare_ms)
        yield from in_turns(turns, lambda: [_page_row(started_ms[0], drawn_ms, bare_ms)])


def _page_loads(
    program: str, port: int, loads: int, started_ms: list[float], drawn_ms: list[float], bare_ms: list[float]
) -> Iterator[None]:
    began = time.monotonic()
    with browser(program) as opened:
        opened.ask("Browser.getVersion")
        started_ms.append(1e3 * (time.monotonic() - began))
        for _ in range(loads):
            for url, times, done in (
                ("about:blank", bare_ms, "performance.now()"),
                (f"http://127.0.0.1:{port}/", drawn_ms, DRAWN),
            ):
                before = time.monotonic()
                page = opened.page(url)
                found = float(opened.wait_for(page, done))
                times.append(found if url != "about:blank" else 1e3 * (time.monotonic() - before))
                opened.close(page)
            yield


def _page_row(started_ms: float, drawn_ms: list[float], bare_ms: list[float]) -> Row:
    text = (
        f"first {drawn_ms[0]:.0f}, slowest {max(drawn_ms):.0f} of {len(drawn_ms)}; beside it: start of the "
        f"browser {started_ms:.0f} ms, an empty tab {np.median(bare_ms):.0f} ms"
    )
    return Row(OPENING, float(np.median(drawn_ms)), "ms", text, 1000.0)


def _cost(shown: Shown, seconds: float) -> tuple[float, float, float]:
    """Share of a core, most resident memory and memory of its own, MB, while one browser follows."""
    done = threading.Event()
    follower = threading.Thread(target=_follow, args=(shown.port, done))
    follower.start()
    time.sleep(SETTLE_S)
    share = _share(shown.pid, seconds)
    resident_mb, own_mb = (
        _status_mb(shown.pid, "status", "VmHWM"),
        _status_mb(shown.pid, "smaps_rollup", "Pss_Anon"),
    )
    done.set()
    follower.join()
    return share, resident_mb, own_mb


def _follow(port: int, done: threading.Event) -> None:
    """Read the stream as a browser does."""
    link = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    link.request("GET", f"/stream?signals={SIGNALS}", headers={"X-Rtctl": "view"})
    answer = link.getresponse()
    while not done.is_set():
        answer.readline()
    link.close()


def _share(pid: int, seconds: float) -> float:
    """Of a core, over so long from now on."""
    before, began = _cpu_s(pid), time.monotonic()
    time.sleep(seconds)
    return (_cpu_s(pid) - before) / (time.monotonic() - began)


def _cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _status_mb(pid: int, file: str, name: str) -> float:
    found = re.search(rf"^{name}:\s+(\d+) kB", Path(f"/proc/{pid}/{file}").read_text(), re.MULTILINE)
    return float(found[1]) / 1000 if found else float("nan")


@contextmanager
def daemon_with_view(config: Path) -> Iterator[Shown]:
    """The daemon of a simulated rig with `[view]` on a free port."""
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        port = _free_port()
        with daemon(config, Path(folder), f"[view]\nport = {port}\n", "--arm") as process:
            with RigClient(load(config).config.rig.name, runtime_dir=folder, timeout_s=START_S) as client:
                client.hello()
            yield Shown(port, _view_of(process.pid, port))


def _view_of(host: int, port: int) -> int:
    """Process id of the view, once its page answers."""
    end = time.monotonic() + START_S
    while time.monotonic() < end:
        with socket.socket() as probe:
            answers = probe.connect_ex(("127.0.0.1", port)) == 0
        children = Path(f"/proc/{host}/task/{host}/children").read_text().split()
        lines = {int(pid): Path(f"/proc/{pid}/cmdline").read_bytes() for pid in children}
        found = [pid for pid, line in lines.items() if b"rtctl.client.view" in line]
        if answers and found:
            return found[0]
        time.sleep(0.05)
    raise LoopDiedError("the daemon's view never came")


def _free_port() -> int:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port: int = taken.getsockname()[1]
    return port
