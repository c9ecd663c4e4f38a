"""The first start after an update: nothing is compiled yet."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from patience import until

from rtctl.client import RigClient

CONFIGS = Path(__file__).parents[2] / "configs"
PATIENCE_S = 300.0

pytestmark = [pytest.mark.compiled, pytest.mark.timeout(600)]


@pytest.fixture
def rig_file(request, tmp_path):
    """The shipped one, or without an observer: its tuning takes eigenvalues, which are compiled before loop
    and host are.
    """
    if not getattr(request, "param", ""):
        return CONFIGS / "mock.toml"
    path, text = tmp_path / "rig.toml", (CONFIGS / "mock.toml").read_text()
    text = text.replace('"friction/', f'"{CONFIGS}/friction/')
    path.write_text(text.replace("intent_nm = 0.05 ", "observer = { gain = 0.0 }\nintent_nm = 0.05 "))
    return path


@pytest.fixture
def first(tmp_path, rig_file):
    folder = tmp_path / "run"
    folder.mkdir(mode=0o700)
    command = ["-m", "rtctl", "run", str(rig_file), "--runtime-dir", str(folder), "--for", "60"]
    environment = {**os.environ, "RTCTL_CACHE_DIR": str(tmp_path / "cache")}
    process = subprocess.Popen([sys.executable, *command], env=environment, stderr=subprocess.PIPE, text=True)
    yield process, folder
    process.kill()
    process.communicate()


def descendants(pid):
    found = [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    return found + [deeper for child in found for deeper in descendants(child)]


def compiles_for_the_host(pid):
    try:
        return "rtctl.host.preparation" in Path(f"/proc/{pid}/cmdline").read_text()
    except FileNotFoundError:
        return False


@pytest.mark.volume  # compiles all of a daemon
def test_the_compiler_leaves_nothing_of_itself_in_the_host(first):
    """200 MB is what a gateway may take; a process that has compiled the law takes twice as much."""
    process, folder = first
    # the host's own process may have begun before the loop's first word of what it compiles
    said = [line for line in (process.stderr.readline() for _ in range(6)) if "of the loop so far" in line][
        :2
    ]
    assert len(said) == 2
    assert all("on the first start of a version only" in line for line in said), said
    done = [int(re.search(r"(\d+) functions of the loop so far", line)[1]) for line in said]
    assert done[0] < done[1], "it goes on"
    most = [int(re.search(r"of at most (\d+)", line)[1]) for line in said]
    assert done[1] <= most[0] <= most[1], "and there is an end"
    with RigClient("mock", runtime_dir=str(folder), timeout_s=PATIENCE_S) as rig:
        rig.hello()
    status = Path(f"/proc/{process.pid}/status").read_text()
    most_kb = int(status.partition("VmHWM:")[2].split()[0])
    assert most_kb < 200_000


@pytest.mark.parametrize("rig_file", ["no observer"], indirect=True)
def test_a_signal_while_it_compiles_ends_all_of_it(first):
    process, _ = first
    deadline = time.monotonic() + PATIENCE_S
    while not any(map(compiles_for_the_host, children := descendants(process.pid))):
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.01)
    time.sleep(1.0)
    process.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 143, said
    assert "Traceback" not in said
    until(lambda: not [child for child in children if Path(f"/proc/{child}").exists()], "the end of all")
