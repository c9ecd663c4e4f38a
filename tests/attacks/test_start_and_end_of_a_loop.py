"""The loop process in its first moments: its host dies, a terminal hangs up, standard descriptors are
closed.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest
from patience import PATIENCE_S, until

from rtctl.errors import BusyError
from rtctl.host.loop_process import LoopProcess, is_dying
from rtctl.rig_file.config import load
from rtctl.rt.birth import OF_THE_TERMINAL
from rtctl.rt.shared_memory import Memory
from rtctl.wire.endpoints import RuntimeDirectory

ROOT = Path(__file__).parents[2]
MOCK = ROOT / "configs" / "mock.toml"
NOBODY = "1"  # as the number of a host: no test is started by init

SHORT_LIVED_HOST = """
import os, signal, sys, time
from rtctl.rig_file.config import load
from rtctl.wire.endpoints import RuntimeDirectory
from rtctl.host.loop_process import LoopProcess
from rtctl.rt.shared_memory import Memory
held = RuntimeDirectory.acquire("mock", sys.argv[2])
loop = LoopProcess(load(sys.argv[1]), Memory.create(1, 64, 1_000_000), held.lock_fd)
held.note_holder(loop.pid)
print(loop.pid, flush=True)
time.sleep(float(sys.argv[3]))
os.kill(os.getpid(), signal.SIGKILL)
"""

CLOSED = """exec "$@" <&- >&- 2>&-"""


def start(arguments, **more):
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen([sys.executable, *arguments], text=True, env=env, **more)


@pytest.mark.parametrize("delay_s", [0.0, 0.1, 0.3])
def test_a_host_that_is_killed_at_once_leaves_no_loop_and_no_lock(tmp_path, delay_s):
    folder = tmp_path / "run"
    folder.mkdir(mode=0o700)
    host = start(["-c", SHORT_LIVED_HOST, str(MOCK), str(folder), str(delay_s)], stdout=subprocess.PIPE)
    loop = int(host.communicate(timeout=PATIENCE_S)[0])
    try:
        until(lambda: is_dying(loop), "the end of the orphan")
        RuntimeDirectory.acquire("mock", folder).release()
    except (AssertionError, BusyError):
        os.kill(loop, signal.SIGKILL)
        raise


def test_a_loop_whose_host_has_gone_before_it_could_ask_ends_at_once():
    loop = start(["-m", "rtctl.rt", "99", NOBODY], stdin=subprocess.PIPE)
    try:
        assert loop.wait(PATIENCE_S) == 1
    finally:
        loop.kill()
        loop.communicate()


def ignored_or_held(pid):
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    masks = dict(line.split(":\t") for line in lines if line.startswith(("SigBlk", "SigIgn")))
    both = int(masks["SigBlk"], 16) | int(masks["SigIgn"], 16)
    return {number for number in OF_THE_TERMINAL if both & 1 << number - 1}


def test_what_a_terminal_sends_never_reaches_the_loop_from_its_first_moment_on():
    loaded, memory = load(MOCK), Memory.create(1, 64, 1_000_000)
    loop = LoopProcess(loaded, memory)
    try:
        end = time.monotonic() + 1.0
        while time.monotonic() < end:
            assert ignored_or_held(loop.pid) == {
                signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP,
            }  # fmt: skip
        for number in OF_THE_TERMINAL:
            os.kill(loop.pid, number)
        assert not loop.wait(0.2)
    finally:
        loop.close()
        memory.close()


def test_shared_memory_and_lock_never_take_the_number_of_a_standard_stream():
    code = (
        "import os, sys; from rtctl.rt.shared_memory import Memory; from rtctl.wire.endpoints "
        "import RuntimeDirectory\n"
        "held = RuntimeDirectory.acquire('mock', sys.argv[1])\n"
        "os._exit(0 if Memory.create(1, 8, 1000000).fd > 2 and held.lock_fd > 2 else 1)"
    )
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        command = ["bash", "-c", CLOSED, "-", sys.executable, "-c", code, folder]
        env = {**os.environ, "PYTHONPATH": str(ROOT)}
        assert subprocess.run(command, env=env, timeout=PATIENCE_S, check=False).returncode == 0


@pytest.mark.compiled
def test_a_daemon_whose_standard_descriptors_are_closed_runs_as_any_other(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir(mode=0o700)
    run = ["-m", "rtctl", "run", str(MOCK), "--runtime-dir", str(folder), "--for", "1"]
    command = ["bash", "-c", CLOSED, "-", sys.executable, *run]
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    assert subprocess.run(command, env=env, timeout=250, check=False).returncode == 0
