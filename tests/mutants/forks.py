"""Runs the tests on every mutation of compiled functions, in forked copies of one collected pytest session.

Importing and collecting costs seconds, a unit test microseconds: so the session is collected once, its first
run tells (by coverage) which tests reach which line, and then each mutation gets a child process in which
the function's code is exchanged and only those tests run, the cheapest first, until one fails. Nothing is
written to the tree. `NUMBA_DISABLE_JIT=1` is needed: only a plain function's code can be exchanged.
"""

from __future__ import annotations

import importlib
import os
import resource
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import FunctionType

import coverage
import pytest
from mutations import Mutation

SLOWEST_S = 1.0
"""Tests that take longer are not repeated for each mutation."""

CHEAP_S = 0.02
"""Tests below this come first; after them those that noticed other changes of the same function."""

BUDGET_S = 4.0
"""Tests tried on one mutation take this long in all, or a little more; what they do not notice survives."""

STARTED_S = 10
"""Processor time granted beyond three times what the chosen tests take: an endless loop is caught, too."""


@dataclass
class Verdict:
    """What became of a mutation: the test that failed, "endless", or "" for a survivor."""

    mutation: Mutation
    by: str
    tests: int


@dataclass
class Session:
    """A pytest plugin: the first run under coverage, then all mutations."""

    mutations: list[Mutation]
    package: str
    jobs: int
    tell: Callable[[str], None]
    verdicts: list[Verdict] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)
    costs: dict[str, float] = field(default_factory=dict)
    noticed: Counter[tuple[str, str]] = field(default_factory=Counter)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note failures."""
        if report.failed:
            self.failed.append(report.nodeid)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """In the place of the plain run."""
        reaching = self._first_run(session.items)
        if self.failed:
            raise pytest.UsageError(f"without any mutation these fail: {', '.join(self.failed)}")
        self._try_all({item.nodeid: item for item in session.items}, reaching)
        return True

    def _first_run(self, items: list[pytest.Item]) -> dict[tuple[str, int], list[str]]:
        """Run everything once; which tests reach a line (module, line), cheapest first."""
        modules = {m.module: str(_file(self.package, m.module)) for m in self.mutations}
        measured = coverage.Coverage(data_file=None, include=list(modules.values()), config_file=False)
        measured.start()
        for item, following in zip(items, [*items[1:], None], strict=True):
            measured.switch_context(item.nodeid)
            start = time.process_time()
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
            self.costs[item.nodeid] = time.process_time() - start
        measured.stop()
        reaching = {}
        for module, file in modules.items():
            for line, contexts in measured.get_data().contexts_by_lineno(file).items():
                names = [name for name in contexts if self.costs.get(name, SLOWEST_S) < SLOWEST_S]
                reaching[module, line] = sorted(names, key=self.costs.__getitem__)
        return reaching

    def _try_all(self, items: dict[str, pytest.Item], reaching: dict[tuple[str, int], list[str]]) -> None:
        running: dict[int, tuple[Mutation, list[str], Path]] = {}
        waiting = list(reversed(self.mutations))
        with tempfile.TemporaryDirectory(prefix="rtctl-mutation-") as folder:
            while waiting or running:
                while waiting and len(running) < self.jobs:
                    mutation = waiting.pop()
                    names = self._in_order(_reaching(reaching, mutation), mutation.function)
                    note = Path(folder) / str(len(waiting))
                    running[self._child(mutation, [items[name] for name in names], note)] = (
                        mutation,
                        names,
                        note,
                    )
                pid, status = os.wait()
                mutation, names, note = running.pop(pid)
                by = note.read_text() if note.exists() else ""
                if not by and status != 0:
                    by = "endless" if os.WIFSIGNALED(status) else "the child broke"
                self.verdicts.append(Verdict(mutation, by, len(names)))
                self.noticed[mutation.function, by] += 1
                done, gone = len(self.verdicts), sum(not verdict.by for verdict in self.verdicts)
                self.tell(
                    f"\r{done} of {len(self.mutations)} tried, {gone} not noticed "
                    + ("" if by else f"\n{mutation.key}  ({len(names)} tests)\n")
                )

    def _in_order(self, names: list[str], function: str) -> list[str]:
        """The tests to try, the most promising first, as many as the budget allows."""
        names = sorted(
            names,
            key=lambda name: (self.costs[name] > CHEAP_S, -self.noticed[function, name], self.costs[name]),
        )
        spent, affordable = 0.0, 0
        while affordable < len(names) and spent < BUDGET_S:
            spent += self.costs[names[affordable]]
            affordable += 1
        return names[:affordable]

    def _child(self, mutation: Mutation, chosen: list[pytest.Item], note: Path) -> int:
        """Fork; the child exchanges the code, runs, writes down the test that failed, and ends."""
        pid = os.fork()
        if pid:
            return pid
        cost = sum(self.costs[item.nodeid] for item in chosen)
        most = int(STARTED_S + 3 * cost)
        resource.setrlimit(resource.RLIMIT_CPU, (most, most))
        self._silence(chosen)
        function = getattr(importlib.import_module(f"{self.package}.{mutation.module}"), mutation.function)
        assert isinstance(function, FunctionType), "needs NUMBA_DISABLE_JIT=1"
        function.__code__ = mutation.code()
        for item, following in zip(chosen, [*chosen[1:], None], strict=True):
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
            if self.failed:
                note.write_text(self.failed[0])
                os._exit(1)
        os._exit(0)

    @staticmethod
    def _silence(chosen: list[pytest.Item]) -> None:
        """Only the parent reports."""
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        for item in chosen[:1]:
            item.config.pluginmanager.unregister(name="terminalreporter")


def _reaching(reaching: dict[tuple[str, int], list[str]], mutation: Mutation) -> list[str]:
    """Tests of the mutation's line; a line in the middle of a statement has none of its own."""
    for line in range(mutation.line, mutation.first_line - 1, -1):
        if (mutation.module, line) in reaching:
            return reaching[mutation.module, line]
    return []


def _file(package: str, module: str) -> Path:
    found = importlib.import_module(f"{package}.{module}").__file__
    assert found is not None
    return Path(found)
