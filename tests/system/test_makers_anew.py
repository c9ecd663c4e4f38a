"""The makers' own libraries, installed anew in the versions kept here, still say what `tests/contract/makers`
keeps of them.

The tests of every run hold our drivers against the kept answers; this one holds the answers against the
libraries.
"""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.system, pytest.mark.timeout(900)]

KEPT = Path(__file__).parents[1] / "contract" / "makers"


@pytest.fixture(scope="module")
def anew(tmp_path_factory):
    """A copy of the makers' folder without answers, and a Python that has their libraries."""
    root = tmp_path_factory.mktemp("makers")
    folder = shutil.copytree(KEPT, root / "makers", ignore=shutil.ignore_patterns("*.json", "__pycache__"))
    bare = [sys.executable, "-m", "venv", "--without-pip", root / "venv"]  # to give it a pip takes 4 s
    subprocess.run(bare, check=True, timeout=120)
    python = root / "venv/bin/python"
    pip = [sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-compile"]
    pip += ["-r", folder / "requirements.txt"]
    installed = subprocess.run(pip, capture_output=True, text=True, check=False, timeout=600)
    if installed.returncode:
        pytest.skip(f"the makers' libraries cannot be installed: {installed.stderr.strip().splitlines()[-1]}")

    def make(name):
        script = folder / f"make_{name}.py"
        done = subprocess.run(
            [python, script], cwd=folder, capture_output=True, text=True, check=False, timeout=300
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return json.loads((folder / f"{name}.json").read_text())

    return make


def kept(name):
    return json.loads((KEPT / f"{name}.json").read_text())


@pytest.mark.parametrize("name", ["vectors", "readings"])
def test_the_kept_answers_are_the_libraries_own(anew, name):
    assert anew(name) == kept(name)


def test_the_sensor_of_bota_is_read_as_it_was(anew):
    made, was = anew("bota"), kept("bota")
    assert (made["version"], made["commands"]) == (was["version"], was["commands"])
    # The sensor sends from its own clock on: the driver's first frame is another one each time.
    read, before = ({one["stamp_us"]: one for one in of["read"]} for of in (made, was))
    both = read.keys() & before.keys()
    assert len(both) >= len(before) // 2
    assert [read[stamp] for stamp in both] == [before[stamp] for stamp in both]
