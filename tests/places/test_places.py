"""What a new environment, a new measured channel and a new kernel cost: each is added to a copy of the
sources, and works there.

A folder beside this file is such an addition, as a contributor would write it: files that are new, in their
places; `edits.toml`, what changes in files that are there; and `proof.py`, tests of what then works from one
end to the other. CONTRIBUTING.md says the same in words.
"""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
COPIED = ("rtctl", "hw", "configs", "tests", "docs", "pyproject.toml")
NOT_COUNTED = {"edits.toml", "proof.py"}
MOST = {"environment": 3, "channel": 4, "kernel": 2}
"""Files of rtctl and hw that are new or changed, at most (issue 16)."""

HELD_TO = {
    "environment": ["tests/unit/control/test_environments.py"],
    "channel": ["tests/unit/hw/test_channels.py", "tests/unit/hw/test_mock_options.py"],
    "kernel": ["tests/unit/friction/test_kinds.py"],
}
"""Tests of today that hold every row of the table to what a row promises."""


def is_new(path):
    return path.is_file() and path.name not in NOT_COUNTED and "__pycache__" not in path.parts


def add(what, tree):
    """Make the addition in this copy; the files that are new or changed."""
    folder, touched = HERE / what, set()
    for path in filter(is_new, sorted(folder.rglob("*"))):
        name = path.relative_to(folder).as_posix()
        assert not (tree / name).exists(), f"{name} is no new file"
        shutil.copy(path, tree / name)
        touched.add(name)
    for edit in tomllib.loads((folder / "edits.toml").read_text())["edit"]:
        path = tree / edit["file"]
        text = path.read_text()
        assert text.count(edit["find"]) == 1, f"{edit['file']}: not there once: {edit['find']}"
        path.write_text(text.replace(edit["find"], edit["put"]))
        touched.add(edit["file"])
    return touched


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A copy of the sources, with what Python has compiled of them."""
    folder = tmp_path_factory.mktemp("tree")
    for name in COPIED:
        if (ROOT / name).is_file():
            shutil.copy2(ROOT / name, folder / name)
        else:
            shutil.copytree(
                ROOT / name, folder / name, ignore=shutil.ignore_patterns("*.mcap", "node_modules")
            )
    return folder


@pytest.fixture(scope="module")
def touched(tree):
    """The files that each addition touches; all are made in one copy."""
    return {what: add(what, tree) for what in MOST}


@pytest.mark.parametrize("what", MOST)
def test_a_new_one_is_added_in_few_places(what, touched):
    assert all(name.startswith(("rtctl/", "hw/")) for name in touched[what])
    assert len(touched[what]) <= MOST[what], sorted(touched[what])


@pytest.mark.compiled
@pytest.mark.usefixtures("touched")
def test_each_works_from_one_end_to_the_other(tree):
    env = {**os.environ, "PYTHONPATH": f"{tree}:{tree}/tests", "NUMBA_DISABLE_JIT": "1"}
    quiet = ("-q", "-W", "ignore::RuntimeWarning", "-p", "no:cacheprovider")
    asked = ["-m", "pytest", *quiet, "--import-mode=importlib"]  # three files have one name
    files = [
        file for what, held_to in HELD_TO.items() for file in (f"tests/places/{what}/proof.py", *held_to)
    ]
    done = subprocess.run(
        [sys.executable, *asked, *files],
        cwd=tree,
        env=env,
        capture_output=True,
        text=True,
        timeout=750,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_every_addition_here_is_made():
    assert {path.parent.name for path in HERE.rglob("edits.toml")} == MOST.keys()
