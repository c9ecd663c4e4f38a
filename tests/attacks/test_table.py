"""README.md names every attack of the suite and its test, and nothing that is not there."""

import ast
import re
from pathlib import Path

import pytest

from tests.bench.attacks import ATTACKS

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
TEXT = (HERE / "README.md").read_text()
NAMED = re.findall(r"`((?:tests/)?[\w/]*test_\w+\.py)(?:::(test_\w+))?`", TEXT)


def path_of(name):
    return ROOT / name if name.startswith("tests/") else HERE / name


@pytest.mark.parametrize(("file", "test"), NAMED)
def test_what_the_table_names_is_there(file, test):
    tree = ast.parse(path_of(file).read_text())
    names = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert test in names if test else any(name.startswith("test_") for name in names)


def test_every_file_of_the_suite_is_in_the_table():
    assert {path_of(file) for file, _ in NAMED} >= set(HERE.glob("test_*.py")) - {Path(__file__)}


def test_every_kind_of_attack_of_the_benchmark_is_in_the_table():
    assert {attack.kind for attack in ATTACKS} <= set(re.findall(r"`(\w+)`", TEXT))


def test_what_the_issue_of_the_suite_asks_for_is_in_the_table():
    rows = "\n".join(line.split("|")[1] for line in TEXT.splitlines() if line.startswith("| "))
    for words in (
        "raw bytes", "half-open ZMTP", "frames", "identities", "epochs", "two unix users", "keys",
        "the operator's browser",
        "full disk", "full /dev/shm", "few descriptors", "no memory", "wall clock stepped",
        "a hog of the loop's priority",
        "SIGSTOP of loop or host", "100 times, judged by `board.c`",
    ):  # fmt: skip
        assert words in rows, words
