"""What `make` installs is what was tested, and nothing without a hash."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PIN = re.compile(r"^([A-Za-z0-9._-]+)==(\S+)")
HASH = re.compile(r"--hash=sha256:[0-9a-f]{64}\b")


def normal(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def requirements(text):
    """Name -> (version, number of hashes) of each requirement; whatever else stands there is a failure."""
    found = {}
    for one in text.replace("\\\n", " ").splitlines():
        pin = PIN.match(one)
        assert pin, one
        found[normal(pin[1])] = pin[2], len(HASH.findall(one))
    return found


@pytest.fixture(scope="module")
def tested():
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    return {
        normal(name): version
        for name, version in (line.split("==") for line in lines if not line.startswith("#"))
    }


@pytest.mark.parametrize("lock", ["run", "dev", "bench"])
def test_everything_that_is_fetched_has_a_hash_and_the_version_that_was_tested(tested, lock):
    locked = requirements((ROOT / "locks" / f"{lock}.txt").read_text())
    assert all(hashes for _, hashes in locked.values())
    differ = {
        name: (version, tested[name])
        for name, (version, _) in locked.items()
        if tested.get(name, version) != version
    }
    assert not differ


def test_the_locks_hold_what_the_project_asks_for():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    asked = {"run": project["dependencies"], "dev": extras["dev"] + extras["can"], "bench": extras["bench"]}
    for lock, names in asked.items():
        locked = requirements((ROOT / "locks" / f"{lock}.txt").read_text())
        wanted = {
            normal(re.match(r"[A-Za-z0-9._-]+", name)[0]) for name in [*names, "hatchling", "editables"]
        }
        assert wanted - {"rtctl"} <= locked.keys()


def test_make_fetches_nothing_without_a_hash():
    lines = [line for line in (ROOT / "Makefile").read_text().splitlines() if "$(PIP)" in line]
    assert len(lines) == 4
    assert all("--require-hashes" in line or "--no-deps --no-build-isolation" in line for line in lines)
