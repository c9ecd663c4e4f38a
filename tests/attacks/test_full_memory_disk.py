"""/dev/shm is full, and so is the place for sockets: in mount namespaces of their own, that end with their
one process.
"""

import os
import shutil
import subprocess
import sys

import pytest

from rtctl.simulation.shipped_files import shipped_config

FULL = """
set -e
mount --make-rprivate /
mount -t tmpfs -o size=64k,nr_inodes={inodes} none {where}
dd if=/dev/zero of={where}/fill bs=1k count=100 2>/dev/null || true
exec "$@"
"""
SHM, RUN = "/dev/shm", "/mnt"


def unshared():
    """Whether this machine lets us have mounts of our own."""
    if os.geteuid() != 0 or shutil.which("unshare") is None:
        return False
    return subprocess.run(["unshare", "-m", "true"], capture_output=True, check=False).returncode == 0


pytestmark = pytest.mark.skipif(not unshared(), reason="needs root and mount namespaces")


def run(where, inodes, *arguments):
    script = FULL.format(where=where, inodes=inodes)
    command = ["unshare", "-m", "bash", "-c", script, "-", sys.executable, "-m", "rtctl", "run"]
    config = str(shipped_config("mock.toml"))
    return subprocess.run(
        [*command, config, *arguments], capture_output=True, text=True, timeout=280, check=False
    )


@pytest.mark.system
def test_a_full_dev_shm_is_nothing_to_a_daemon(tmp_path):
    """What host and loop share has no name there (decision 0001)."""
    folder = tmp_path / "run"
    folder.mkdir(mode=0o700)
    done = run(SHM, 0, "--runtime-dir", str(folder), "--for", "1", "--arm")
    assert done.returncode == 0, done.stderr


def test_a_full_place_for_sockets_is_refused_by_name():
    done = run(RUN, 3, "--runtime-dir", f"{RUN}/rtctl", "--for", "1")
    assert done.returncode == 3, done.stderr
    assert f"{RUN}/rtctl" in done.stderr
    assert "No space left on device" in done.stderr
    assert "set RTCTL_RUNTIME_DIR to a folder of your own" in done.stderr
