"""`make` with a Python that is too old: told before anything is made or installed."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.skipif(not shutil.which("make"), reason="no make on this machine")


def test_an_old_python_is_told_before_pip_is_called(tmp_path):
    old = tmp_path / "python3.10"
    old.write_text(
        '#!/bin/sh\ncase "$1" in --version) echo Python 3.10.12;; -c) exit 1;; *) touch called; exit 0;; '
        "esac\n"
    )
    old.chmod(0o755)
    made = [f"PYTHON={old}", f"VENV={tmp_path}/venv"]
    done = subprocess.run(
        ["make", *made, "run"], cwd=ROOT, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 2
    assert "Python 3.10.12 is too old: rtctl needs Python 3.11 or newer" in done.stderr
    assert not (tmp_path / "venv").exists()


def test_the_bound_is_that_of_the_package():
    assert 'requires-python = ">=3.11"' in (ROOT / "pyproject.toml").read_text()
    check = "import sys; sys.exit(sys.version_info < (3, 11))"
    assert check in (ROOT / ".ci/make-venv").read_text()
    assert subprocess.run([sys.executable, "-c", check], check=False).returncode == 0
