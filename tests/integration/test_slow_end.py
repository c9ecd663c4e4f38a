"""The end of an interpreter is nobody's end: the daemon does not wait for its own, and a loop process that
has said its last word is not a stalled loop, however long its interpreter takes to go.
"""

import os
import signal

import pytest
from patience import until
from rtctl_process import CONFIGS, finish, start_anew

from rtctl.client import RigClient

LINGER = """
import atexit, sys, time
if "rtctl.rt" in sys.orig_argv:
    atexit.register(time.sleep, {seconds})
"""


@pytest.mark.parametrize("seconds", [1.0, 60.0], ids=["slow", "longer than the host waits"])
def test_a_process_that_lingers_after_an_orderly_end_is_no_failure(folder, tmp_path, monkeypatch, seconds):
    (tmp_path / "sitecustomize.py").write_text(LINGER.format(seconds=seconds))
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    code, summary, err = finish(start_anew(CONFIGS / "mock.toml", folder, "--for", "1"))
    assert code == 0, (summary, err)
    assert summary["state"] == "SHUTDOWN"


MARK = """
import atexit, pathlib, sys
if sys.orig_argv[2:4] == ["rtctl", "run"]:
    atexit.register(pathlib.Path({path!r}).touch)
"""


def test_a_daemon_does_not_wait_for_its_interpreter_to_be_taken_apart(folder, tmp_path, monkeypatch):
    """This takes .3 s and more: SIGTERM is to end the daemon within .2 s."""
    (tmp_path / "sitecustomize.py").write_text(MARK.format(path=str(tmp_path / "taken apart")))
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    process = start_anew(CONFIGS / "mock.toml", folder)
    with RigClient("mock", runtime_dir=folder, timeout_s=150) as client:
        until(lambda: client.status()["state"])
    process.send_signal(signal.SIGTERM)
    code, summary, err = finish(process)
    assert (code, summary["state"]) == (0, "SHUTDOWN"), err
    assert not (tmp_path / "taken apart").exists()
