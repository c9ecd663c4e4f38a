"""A copy of the tree in which one file at a time is spoilt, and the tests run on it.

Tests run as plain Python (`NUMBA_DISABLE_JIT=1`): compiling the law takes longer than testing it. They run in
a fork of a process that has imported everything but our own packages, so that nothing of one mutant is left
for the next, and importing costs nothing. Modules of tests that are marked `compiled` as a whole say nothing
as plain Python; they run compiled, in a process of their own.
"""

from __future__ import annotations

import importlib
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
COPIED = ("rtctl", "hw", "tests", "docs", "configs", "systemd", "pyproject.toml")
WARM = ("pytest", "hypothesis", "numpy", "numba", "zmq", "msgpack", "pydantic", "click")
MOST_S, COMPILED_MOST_S = 120, 600
"""Least processor time of one mutant, where an endless loop ends. The second: with what must be compiled."""

SOUND_MOST_S = 900
"""Of tests on the tree as it is: some take minutes as plain Python."""

PATIENCE = 2.0
"""Times what its tests take on the tree as it is, a mutant gets."""

COMPILED = "pytestmark = pytest.mark.compiled"

OPTIONS = (
    "-x",
    "-q",
    "-p",
    "no:cacheprovider",
    "-W",
    "ignore::RuntimeWarning",
    "-W",
    "ignore::pytest.PytestAssertRewriteWarning",
    "--durations=0",
    "--tb=no",
)
SURVIVED, TESTS_FAILED, INTERRUPTED, NOT_FOUND = 0, 1, 2, 4


def say(text: str) -> None:
    """Show a line at once."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


@dataclass(frozen=True)
class Outcome:
    """What the tests said: the first one that failed ("" when all passed), and how long it took, s."""

    by: str
    seconds: float


class Workshop:
    """One copy of the tree. Use it from one process only."""

    def __init__(self, root: Path = ROOT) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="rtctl-mutants-")
        self.tree = Path(self._folder.name) / "tree"
        self.tree.mkdir()
        for name in COPIED:
            if (root / name).is_dir():
                ignored = shutil.ignore_patterns("__pycache__", ".hypothesis", "recordings")
                shutil.copytree(root / name, self.tree / name, ignore=ignored)
            else:
                shutil.copy(root / name, self.tree / name)
        for name in WARM:
            importlib.import_module(name)

    def run(self, tests: Sequence[str], path: str = "", text: str = "", sound_s: float = 0.0) -> Outcome:
        """Run `tests` with the file at `path` replaced by `text`, or as it is, which took `sound_s`."""
        file = self.tree / path if path else None
        original = file.read_bytes() if file else b""
        start = time.monotonic()
        try:
            if file:
                file.write_text(text)
                for stale in (file.parent / "__pycache__").glob(f"{file.stem}.*.pyc"):
                    stale.unlink()
            least_s = round(PATIENCE * sound_s) if path else SOUND_MOST_S
            by = self._forked(tests, least_s, keep_bytecode=not path)
        finally:
            if file:
                file.write_bytes(original)
        return Outcome(by, time.monotonic() - start)

    def _forked(self, tests: Sequence[str], least_s: int, *, keep_bytecode: bool) -> str:
        note = self.tree.parent / "failed"
        note.unlink(missing_ok=True)
        pid = os.fork()
        if pid == 0:
            self._child(tests, note, least_s, keep_bytecode=keep_bytecode)
        _, status = os.waitpid(pid, 0)
        _end_group(pid)
        if os.WIFSIGNALED(status):
            return "endless, or ended by a signal"
        code = os.WEXITSTATUS(status)
        if code == SURVIVED:
            return ""
        if code in (TESTS_FAILED, INTERRUPTED, NOT_FOUND) and note.exists():
            return note.read_text()
        raise RuntimeError(f"pytest {' '.join(tests)} ended with {code}: see {self.tree.parent / 'output'}")

    def _child(self, tests: Sequence[str], note: Path, least_s: int, *, keep_bytecode: bool) -> None:
        os.setsid()
        compiled = any(COMPILED in (self.tree / test.partition("::")[0]).read_text() for test in tests)
        most_s = max(least_s, COMPILED_MOST_S if compiled else MOST_S)
        resource.setrlimit(resource.RLIMIT_CPU, (most_s, most_s))
        output = os.open(self.tree.parent / "output", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(output, 1)
        os.dup2(output, 2)
        os.chdir(self.tree)
        sys.path[:0] = [str(self.tree)]
        sys.dont_write_bytecode = not keep_bytecode
        os.environ.update(PYTHONPATH=str(self.tree), RTCTL_CACHE_DIR=str(self.tree.parent / "cache"))
        code = 3
        try:
            if compiled:
                anew = {**os.environ, "NUMBA_DISABLE_JIT": "0"}
                anew |= {} if keep_bytecode else {"PYTHONDONTWRITEBYTECODE": "1"}
                os.execve(sys.executable, [sys.executable, __file__, str(note), *tests], anew)
            code = _tested(tests, note)
        finally:
            os._exit(code)

    def close(self) -> None:
        """Remove the copy."""
        self._folder.cleanup()


def _tested(tests: Sequence[str], note: Path) -> int:
    """pytest's exit code, with what failed in the note; tests of which none ran have failed."""
    import pytest

    seen = _FirstFailure(note)
    code = int(pytest.main([*OPTIONS, *tests], plugins=[seen]))
    if code == SURVIVED and not seen.ran:
        note.write_text("no test ran")
        return TESTS_FAILED
    return code


class _FirstFailure:
    """Writes down the first test that fails, or the module that cannot be collected."""

    def __init__(self, note: Path) -> None:
        self._note, self.ran = note, 0

    def pytest_runtest_logreport(self, report) -> None:
        self.ran += report.when == "call" and not report.skipped
        if report.failed and not self._note.exists():
            self._note.write_text(report.nodeid)

    def pytest_collectreport(self, report) -> None:
        if report.failed and not self._note.exists():
            self._note.write_text(f"cannot be imported by {report.nodeid}")


def _end_group(pid: int) -> None:
    """End what the tests of a mutant left running: the group is the child's own."""
    try:
        os.killpg(pid, signal.SIGKILL)
    except ProcessLookupError:
        return


if __name__ == "__main__":
    sys.exit(_tested(sys.argv[2:], Path(sys.argv[1])))
