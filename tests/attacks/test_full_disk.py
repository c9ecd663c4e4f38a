"""The disk of recordings and event log fills up under torque: a disk of its own, 3 MB, in a mount namespace
that ends with the daemon.
"""

import contextlib
import os
import subprocess
import sys
from pathlib import Path

import pytest
from patience import PATIENCE_S, until
from test_full_memory_disk import unshared
from test_strangers import MOST_MS, shown

from rtctl.client import RigClient
from rtctl.errors import RecordingError
from rtctl.recording.reader import RecordingReader, all_parts
from rtctl.simulation.shipped_files import shipped_config
from tests.bench.attacks import MOST_MB, stop_ms
from tests.bench.flood import memory_mb

pytestmark = [
    pytest.mark.compiled,
    pytest.mark.skipif(not unshared(), reason="needs root and mount namespaces"),
]

SCRIPT = 'mount --make-rprivate / && mount -t tmpfs -o size=3m none "$1" && shift && exec "$@"'


class Daemon:
    """`rtctl run` of the simulated rig that keeps everything on the small disk."""

    def __init__(self, folder, *, records=True):
        self.folder, disk, self.said = folder / "run", folder / "disk", folder / "said"
        self.folder.mkdir(mode=0o700)
        disk.mkdir()
        source = shipped_config("mock.toml")
        text = source.read_text().replace('"friction/', f'"{source.parent}/friction/')
        rig = folder / "rig.toml"
        record = f'\n[record]\nfolder = "{disk}/recording"\nfree_mb = 0\n' if records else ""
        rig.write_text(f"{text}{record}")
        command = [sys.executable, "-m", "rtctl", "run", str(rig), "--runtime-dir", str(self.folder)]
        with self.said.open("w") as out:
            self.process = subprocess.Popen(
                ["unshare", "-m", "bash", "-c", SCRIPT, "-", str(disk), *command],
                stdout=out,
                stderr=out,
                env={**os.environ, "RTCTL_STATE_DIR": f"{disk}/state"},
            )
        self.disk = Path(f"/proc/{self.process.pid}/root{disk}")

    def __enter__(self):
        until(lambda: (self.folder / "mock" / "command").exists() or self.process.poll() is not None)
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()

    def parts(self):
        return sorted((self.disk / "recording").glob("*.mcap"))

    def says(self, words):
        until(lambda: words in self.said.read_text() or self.process.poll() is not None, words)
        assert self.process.poll() is None, self.said.read_text()


def fill(disk):
    with (disk / "fill").open("wb", buffering=0) as file, contextlib.suppress(OSError):
        while True:
            file.write(bytes(4096))


def test_a_disk_that_fills_up_delays_no_stop_and_what_was_written_is_read(tmp_path):
    with (
        Daemon(tmp_path) as daemon,
        RigClient("mock", runtime_dir=daemon.folder, timeout_s=PATIENCE_S) as rig,
    ):
        rig.arm(timeout_s=PATIENCE_S)
        until(daemon.parts, "a part of the recording")
        fill(daemon.disk)
        daemon.says("RECORDING BROKEN")
        rig.stop()
        until(lambda: rig.status()["state"] == "IDLE", "the end of the ramp")
        assert shown("a full disk", stop_ms(rig, lambda: None)) < MOST_MS
        assert memory_mb(daemon.process.pid) < MOST_MB
        reader = RecordingReader(all_parts(daemon.parts()[0]))
        assert len(reader.read().rows) > 100
        assert not reader.left_out
        daemon.process.terminate()
        assert daemon.process.wait(PATIENCE_S) == RecordingError.exit_code, daemon.said.read_text()


def test_a_zero_that_the_disk_refuses_is_told_and_written_once_there_is_room(tmp_path):
    # without a recording: a part of it that breaks is taken away, and leaves room for a zero
    with (
        Daemon(tmp_path, records=False) as daemon,
        RigClient("mock", runtime_dir=daemon.folder, timeout_s=PATIENCE_S) as rig,
    ):
        until(lambda: list(daemon.disk.glob("state/*/force-zero.json")), "the zero of the start")
        (zero,) = daemon.disk.glob("state/*/force-zero.json")
        before = zero.read_text()
        fill(daemon.disk)
        rig.tare(hands_off=True)
        daemon.says("ZERO OF THE FORCE BROKEN")
        assert zero.read_text() == before
        (daemon.disk / "fill").unlink()
        daemon.says("zero of the force: written again")
        assert zero.read_text() != before
        assert daemon.said.read_text().count("ZERO OF THE FORCE BROKEN") == 1
