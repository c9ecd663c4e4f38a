"""The plug-in itself: has every subclass of `Contract` run on each of its cases.

By `-p rtctl.backend_contract.plugin`, or `pytest_plugins` of the file of tests. It is no entry point: pytest
would then rewrite the assertions of all of rtctl, compiled code among it, wherever rtctl is installed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from rtctl.backend_contract import Case, Contract
from rtctl.backend_contract.subject import Subject


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """A test of a `Contract` runs once for each case."""
    if metafunc.cls is not None and issubclass(metafunc.cls, Contract) and "case" in metafunc.fixturenames:
        cases = metafunc.cls.cases
        metafunc.parametrize("case", list(cases.values()), ids=list(cases))


@pytest.fixture
def subject(case: Case, tmp_path: Path) -> Iterator[Subject]:
    """A backend of this case, made and not opened, with its device beside it."""
    made = Subject(case, tmp_path)
    yield made
    made.release()


@pytest.fixture
def running(subject: Subject) -> Subject:
    """A subject that is open."""
    subject.open()
    return subject
