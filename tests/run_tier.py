"""Runs a tier of tests, a part for each core: `python tests/run_tier.py check|test|volume`.

Tests that meet a clock run as two parts, alone at their priority; parts that start beside them get only what
nobody else wants (SCHED_IDLE), so that no real-time loop waits for them. As tests that meet a clock leave
their core idle for most of the time, as many parts as there are cores run besides. A part's output goes to a
file and is shown when it fails. Ctrl-C ends all parts.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import re
import resource
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import few
import tiers

ROOT = tiers.TESTS.parent
LOGS = ROOT / "build" / "tests"
BIN = Path(sys.executable).parent
NOTHING_COLLECTED = 5
END_S = 30.0
"""Time that an interrupted part may take to end its rigs before it is killed."""

ENOUGH_FILES = 25
"""In one part: it starts Python and imports for three seconds."""
LEAST_WEIGHT = 19
"""Nice value of a session that takes only what no other one wants."""

UNHURRIED = "--timeout=1800"
"""Of one test: beside busy others it may stand still for long."""

FIRST = "unit/hw"
"""Compiles what the daemons of CAN and serial rigs run: no test that meets a clock need wait for that."""

VOLUME = re.compile(r"mark\.volume|asked_often")
"""In a file of tests of which some are volume (`tests/amounts.py`)."""

COUNTED = re.compile(r"(\d+) (passed|failed|errors?|skipped|xfailed|xpassed)")


@dataclass
class Part:
    """A program with its output. `clock`: what starts beside it leaves it alone. `idle`: it does so always.

    `compiles`: what meets a clock begins when this has ended. `slow_files`: those that take long.
    """

    name: str
    command: tuple[str, ...]
    clock: bool = False
    idle: bool = False
    compiles: bool = False
    slow_files: int = 0
    process: subprocess.Popen[bytes] | None = None
    began: float = field(default=0.0)

    @property
    def log(self) -> Path:
        """Where its output goes."""
        return LOGS / f"{self.name.replace('/', '-').replace(' ', '+')}.log"

    def start(self, *, idle: bool) -> None:
        """In a process group of its own, to be ended whole; an idle one in a session, which weighs little."""
        self.began = time.monotonic()
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                self.command,
                cwd=ROOT,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                process_group=None if idle else 0,
                start_new_session=idle,
                preexec_fn=_be_idle if idle else None,
            )

    def signal(self, number: int) -> None:
        """To its whole group, of which some may live when the program itself has ended."""
        if self.process is not None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.process.pid, number)

    def be_ordinary(self) -> None:
        """Let all of it take its share again. Without root's rights it stays as it is: idle."""
        _weigh_session(self.process.pid, 0)
        for process in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError):
                if os.getpgid(int(process.name)) == self.process.pid:
                    for thread in (process / "task").iterdir():
                        if os.sched_getscheduler(int(thread.name)) == os.SCHED_IDLE:
                            os.sched_setscheduler(int(thread.name), os.SCHED_OTHER, os.sched_param(0))


def _be_idle() -> None:
    os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    _weigh_session(os.getpid(), LEAST_WEIGHT)


def _weigh_session(pid: int, nice: int) -> None:
    """The kernel may weigh sessions against each other before it looks at what is in them."""
    with contextlib.suppress(OSError):
        Path(f"/proc/{pid}/autogroup").write_text(str(nice))


def pytest_part(name: str, files: list[Path], *options: str, clock: bool = False, idle: bool = False) -> Part:
    """These files in one session of pytest; an idle one asks as often as `tests/amounts.py` has it."""
    chosen = [str(path.relative_to(ROOT)) for path in files]
    quiet = ("-q", "--color=no", "-p", "no:cacheprovider")
    asked = ("env", "RTCTL_TEST_VOLUME=1") if idle else ()
    command = (*asked, sys.executable, "-m", "pytest", *quiet, *options, *chosen)
    return Part(name, command, clock, idle, slow_files=sum(not tiers.is_quick(path) for path in files))


def by_folder(files: list[Path], *options: str) -> list[Part]:
    """Whole folders, so many together that it pays to start Python and to import what they need."""
    parts, names, together = [], [], []
    for folder, inside in itertools.groupby(files, lambda path: path.parent):
        names.append(folder.relative_to(ROOT).as_posix().removeprefix("tests/"))
        together += inside
        if len(together) >= ENOUGH_FILES:
            parts.append(pytest_part(" ".join(names), together, *options))
            names, together = [], []
    if together:
        parts.append(pytest_part(" ".join(names), together, *options))
    return parts


def check() -> list[Part]:
    """The inner loop: format, lint, types, contracts, and the tests that are done in seconds."""
    style = '"$0"/ruff format --check . && "$0"/ruff check . && "$0"/lint-imports --no-cache'
    quick = [path for path in tiers.every_file() if tiers.is_quick(path)]
    return [
        Part("style", ("sh", "-c", style, str(BIN))),
        Part("types", (str(BIN / "mypy"),)),
        *by_folder(quick),
    ]


def test() -> list[Part]:
    """What a user would run: everything but volume, and but what needs other people's programs.

    What takes long begins early, so that no core has the last long part to itself. What every daemon runs is
    compiled before the first of them begins: those that begin at a time would each compile it.
    """
    files = tiers.every_file()
    clock = [path for path in files if tiers.meets_a_clock(path)]
    others = by_folder([path for path in files if path not in clock], UNHURRIED)
    beside = sorted(others, key=lambda part: (FIRST not in part.name.split(), -part.slow_files))
    compiled = (sys.executable, "-m", "rtctl", "compile", "configs/mock.toml")
    return [
        Part("compile", compiled, compiles=True),
        pytest_part("clock", [path for path in clock if not tiers.is_patient(path)], clock=True),
        pytest_part("patient clock", [path for path in clock if tiers.is_patient(path)], clock=True),
        *beside,
    ]


def volume() -> list[Part]:
    """The same questions asked many more times, beside anything; of two parts, one took 165 s longer."""
    files = [path for path in tiers.every_file() if few.names(path) or VOLUME.search(path.read_text())]
    return [pytest_part(f"volume {k}", files[k::6], "-m", "volume", UNHURRIED, idle=True) for k in range(6)]


TIERS = {"check": check, "test": test, "volume": volume}


class Run:
    """Some parts at a time, in their order; what each said is counted, and shown if it failed."""

    def __init__(self, parts: list[Part], at_a_time: int) -> None:
        self._waiting, self._running, self._at_a_time = list(parts), [], at_a_time
        self._counted: Counter[str] = Counter()
        self._used_s = _used_s()
        self._failed: list[Part] = []
        self._began = time.monotonic()

    def whole(self) -> int:
        """Until all have ended; the exit code."""
        while self._waiting or self._running:
            while len(self._running) < self._places() and (part := self._next()):
                self._start(part)
            for part in list(self._running):
                if part.process.poll() is not None:
                    self._running.remove(part)
                    part.signal(signal.SIGKILL)  # nothing it started outlives it
                    self._judge(part)
                    if part.clock:
                        self._make_way_no_more()
            time.sleep(0.05)
        return self._sum_up()

    def _places(self) -> int:
        """One more for each that meets a clock: it mostly waits, and others take only what that leaves."""
        return self._at_a_time + sum(part.clock for part in self._running)

    def _next(self) -> Part | None:
        """The first that waits and may begin."""
        compiling = any(part.compiles for part in self._running)
        return next((part for part in self._waiting if not (compiling and part.clock)), None)

    def _start(self, part: Part) -> None:
        say(f"begins                          {part.name}")
        self._waiting.remove(part)
        clock = any(one.clock for one in (*self._running, *self._waiting))
        part.start(idle=part.idle or not (part.clock or part.compiles or not clock))
        self._running.append(part)

    def _make_way_no_more(self) -> None:
        if not any(part.clock for part in (*self._running, *self._waiting)):
            for part in self._running:
                if not part.idle:
                    part.be_ordinary()

    def _judge(self, part: Part) -> None:
        text = part.log.read_text(errors="replace")
        last = text.rstrip().rpartition("\n")[2].strip("= ")
        found = {what.rstrip("s"): int(number) for number, what in COUNTED.findall(last)}
        self._counted.update(found)
        used_before_s, self._used_s = self._used_s, _used_s()
        took = f"{time.monotonic() - part.began:6.1f} s ({self._used_s - used_before_s:5.1f} s of a core)"
        if part.process.returncode in (0, NOTHING_COLLECTED):
            counts = ", ".join(f"{number} {what}" for what, number in found.items())
            say(f"ok      {took}  {part.name}  {counts}")
        else:
            self._failed.append(part)
            say(f"FAILED  {took}  {part.name} ({part.process.returncode})\n{text}")

    def _sum_up(self) -> int:
        counts = ", ".join(f"{number} {what}" for what, number in self._counted.items()) or "nothing counted"
        say(f"{counts} in {time.monotonic() - self._began:.0f} s; what they said: {os.path.relpath(LOGS)}/")
        for part in self._failed:
            lines = part.log.read_text(errors="replace").splitlines()
            named = [line for line in lines if line.startswith(("FAILED ", "ERROR "))]
            say("\n".join([f"FAILED part {part.name}", *named]))
        return 1 if self._failed else 0

    def end(self) -> None:
        """Ask all that run to end, as Ctrl-C would; kill what does not."""
        for part in self._running:
            part.signal(signal.SIGINT)
        deadline = time.monotonic() + END_S
        while any(part.process.poll() is None for part in self._running) and time.monotonic() < deadline:
            time.sleep(0.05)
        for part in self._running:
            part.signal(signal.SIGKILL)


def _used_s() -> float:
    """Processor time of all that was started and has ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def tell_of_slow_files(parts: list[Part]) -> None:
    """What of the inner loop takes too long to be in it."""
    lines = [line for part in parts for line in tiers.not_quick(part.log.read_text(errors="replace"))]
    if lines:
        told = "not quick: for LONG of tests/tiers.py, unless something was compiled just now"
        say("\n".join([told, *lines]))


def say(text: str) -> None:
    """Show it at once."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def main() -> int:
    """Run the tier named on the command line; the exit code."""
    if len(sys.argv) != 2 or sys.argv[1] not in TIERS:
        say(f"usage: python tests/run_tier.py {'|'.join(TIERS)}")
        return 2
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job has it ignored
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    LOGS.mkdir(parents=True, exist_ok=True)
    parts = TIERS[sys.argv[1]]()
    run = Run(parts, at_a_time=max(2, len(os.sched_getaffinity(0))))
    try:
        code = run.whole()
        if sys.argv[1] == "check":
            tell_of_slow_files(parts)
        return code
    except KeyboardInterrupt:
        run.end()
        say("interrupted")
        return 130


if __name__ == "__main__":
    sys.exit(main())
