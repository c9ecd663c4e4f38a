"""A backend from another package: found by its entry point, checked, and run by the real processes."""

import json
import os
import subprocess
import sys
from contextlib import nullcontext

import example_package
import pytest

from hw import registry
from hw.interface import BackendError, BackendInfo


@pytest.fixture
def site(tmp_path):
    folder = tmp_path / "site"
    with example_package.installed(folder):
        yield folder


def rig_file(folder, port=9100):
    text = (example_package.FOLDER / "rig.toml").read_text()
    path = folder / "rig.toml"
    path.write_text(text.replace("port = 9100", f"port = {port}"))
    return path


def run(*arguments, **more):
    command = [sys.executable, "-m", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=170, **more)


@pytest.mark.parametrize("already", [False, True], ids=["", "beside the example installed for good"])
def test_it_is_found_by_name_and_only_while_installed(tmp_path, already):
    name = f"{example_package.KIND}_of_this_test"
    with example_package.installed(tmp_path / "before") if already else nullcontext():
        with pytest.raises(BackendError, match=rf"no backend '{name}'; there are: .*mock"):
            registry.lookup(name)
        with example_package.installed(tmp_path / "site", name):
            info = registry.lookup(name)
            assert isinstance(info, BackendInfo)
            assert not info.simulated
            with pytest.raises(BackendError, match=rf"there are: .*{name}"):
                registry.lookup("udp-bord")
        with pytest.raises(BackendError, match=rf"no backend '{name}'"):
            registry.lookup(name)


def test_an_entry_point_that_is_no_backend_is_named(tmp_path):
    with example_package.installed(tmp_path / "site"):
        (points,) = tmp_path.glob("site/*.dist-info/entry_points.txt")
        points.write_text("[rtctl.backends]\nwrong = rtctl_udp_board.backend:STATE\n")
        with pytest.raises(BackendError, match=r"'wrong' of rtctl\.backends is not a"):
            registry.lookup("wrong")


def test_its_rig_file_is_checked_like_any_other(site, tmp_path):
    path = rig_file(tmp_path)
    shown = run("rtctl", "check", str(path), "--json")
    assert shown.returncode == 0, shown.stderr
    path.write_text(path.read_text() + "torque_max = 5\n")
    shown = run("rtctl", "check", str(path), "--json")
    assert shown.returncode == 3
    assert "device[0].options.torque_max" in json.loads(shown.stdout)["faults"][0]


def test_the_daemon_runs_it_in_the_loop_process(site, tmp_path):
    simulator = subprocess.Popen(
        [sys.executable, "-c", CHILD], stdout=subprocess.PIPE, text=True, env=os.environ.copy()
    )
    try:
        port = int(simulator.stdout.readline())
        path, folder = rig_file(tmp_path, port), tmp_path / "run"
        path.write_text(path.read_text() + "lost_after_s = 1.0\n")  # this machine is shared: no race with it
        folder.mkdir(mode=0o700)
        shown = run("rtctl", "run", str(path), "--for", "3", "--runtime-dir", str(folder), "--json")
        summary = json.loads(shown.stdout.splitlines()[-1])
        assert summary["ticks"] > 100, shown.stderr
        assert "LINK_LOST" not in summary["faults"]
        assert "BAD_SAMPLE" not in summary["faults"]
    finally:
        simulator.kill()
        simulator.communicate()


UNCLOSED = """
import sys
if "rtctl.rt" in sys.orig_argv:
    from rtctl_udp_board.backend import UdpBoard
    def close(self):
        raise RuntimeError("it hangs on")
    UdpBoard.close = close
"""


def test_one_that_fails_to_close_is_named_at_the_end(site, tmp_path):
    (site / "sitecustomize.py").write_text(UNCLOSED)
    folder = tmp_path / "run"
    folder.mkdir(mode=0o700)
    shown = run("rtctl", "run", str(rig_file(tmp_path)), "--for", "0.2", "--runtime-dir", str(folder))
    assert shown.returncode == 9, shown.stderr
    assert "rig.toml: device[0] 'board' (axis[0]): close: RuntimeError: it hangs on" in shown.stderr
    assert "without a word" not in shown.stderr


CHILD = """
import time
from rtctl_udp_board.simulator import PERIOD_S, Board
board = Board()
print(board.socket.getsockname()[1], flush=True)
while True:
    board.listen(time.monotonic())
    board.step()
    time.sleep(PERIOD_S)
"""


def test_the_example_says_what_the_contributing_page_says():
    text = (example_package.FOLDER / "README.md").read_text()
    for name in ("pyproject.toml", "backend.py", "options.py", "simulator.py", "rig.toml"):
        assert name in text
    for part in ("pyproject.toml", "rig.toml", "rtctl_udp_board/backend.py"):
        assert (example_package.FOLDER / part).is_file()
