"""A loop process that has said its last word is not a stalled loop, however long its interpreter takes to go."""

import os

import pytest
from test_run import CONFIGS, finish, start

LINGER = """
import atexit, sys, time
if "rtctl.rt" in sys.orig_argv:
    atexit.register(time.sleep, {seconds})
"""


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "run"
    path.mkdir(mode=0o700)
    return path


@pytest.mark.parametrize("seconds", [1.0, 60.0], ids=["slow", "longer than the host waits"])
def test_a_process_that_lingers_after_an_orderly_end_is_no_failure(folder, tmp_path, monkeypatch, seconds):
    (tmp_path / "sitecustomize.py").write_text(LINGER.format(seconds=seconds))
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    code, summary, err = finish(start(CONFIGS / "mock.toml", folder, "--for", "1"))
    assert code == 0, (summary, err)
    assert summary["state"] == "SHUTDOWN"
