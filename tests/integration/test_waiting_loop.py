"""A loop process is started before the rig file is read: what becomes of it when that rig is refused, or its
host dies.
"""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from patience import PATIENCE_S, until
from rtctl_process import CONFIGS, children, finish, start_anew

from rtctl.client import RigClient
from rtctl.errors import BusyError, DeviceError, LoopDiedError, ModelError, StabilityError
from rtctl.host.loop_process import LoopProcess, order_of
from rtctl.host.waiting_loop import WaitingLoop
from rtctl.rig_file.config import load
from rtctl.rt.process import _told
from rtctl.rt.shared_memory import Memory
from rtctl.wire.endpoints import RuntimeDirectory

LISTENING = """
import os, sys
loop = "rtctl.rt" in sys.orig_argv
if loop:
    open({pids!r}, "a").write(f"{{os.getpid()}}\\n")
def hear(event, arguments):
    if event == "open" and loop and str(arguments[0]) == {port!r}:
        open({opened!r}, "w").close()
sys.addaudithook(hear)
"""
"""Of every program that is started: tells a loop process, and whether it opens the device."""


class Watched:
    """A serial rig whose port is a file, and what became of the loop processes that were started for it."""

    def __init__(self, folder):
        self.folder, self.port, self.opened, self.pids = (
            folder / name for name in ("run", "port", "opened", "pids")
        )
        self.folder.mkdir(mode=0o700)
        self.port.touch()
        text = LISTENING.format(pids=str(self.pids), port=str(self.port), opened=str(self.opened))
        (folder / "sitecustomize.py").write_text(text)
        self.config = folder / "rig.toml"
        self.text = (CONFIGS / "serial.toml").read_text().replace("/tmp/rtctl-board", str(self.port))
        self.environment = {"PYTHONPATH": os.pathsep.join([str(folder), *sys.path])}

    def run(self):
        command = [sys.executable, "-m", "rtctl", "run", str(self.config), "--runtime-dir", str(self.folder)]
        return subprocess.run(
            command,
            env={**os.environ, **self.environment},
            capture_output=True,
            text=True,
            timeout=250,
            check=False,
        )

    def loops(self):
        return [int(pid) for pid in self.pids.read_text().split()] if self.pids.exists() else []


@pytest.fixture
def watched(tmp_path):
    return Watched(tmp_path)


REFUSED = {
    "a key that there is not": ("stiffness_nm_rad = 10.0", "stifness = 10.0", 3),
    "a coupling that cannot be proved": ("stiffness_nm_rad = 10.0", "stiffness_nm_rad = 90.0",
        StabilityError.exit_code),
    "a friction model that is missing": ("[axis.environment]",
        '[axis.friction]\nmodel = "none.json"\n[axis.environment]', ModelError.exit_code),
}  # fmt: skip


@pytest.mark.parametrize("why", REFUSED)
def test_a_refused_rig_opens_no_device_and_its_loop_is_gone_without_a_word(watched, why):
    before, after, code = REFUSED[why]
    assert before in watched.text
    watched.config.write_text(watched.text.replace(before, after))
    done = watched.run()
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    assert done.stderr.startswith("rtctl: ")
    assert not watched.opened.exists()
    until(lambda: all(map(gone, watched.loops())), "the end of its loop")


@pytest.mark.compiled
def test_the_same_rig_unrefused_opens_its_device(watched):
    """Else the test before this one would see nothing."""
    watched.config.write_text(watched.text)
    done = watched.run()
    assert done.returncode == DeviceError.exit_code, done.stderr
    assert watched.opened.exists()
    assert len(watched.loops()) == 1


@pytest.mark.compiled
@pytest.mark.parametrize("delay_s", [0.0, 0.4, 1.2])
def test_a_host_that_is_killed_in_any_phase_of_its_start_leaves_no_loop_and_no_lock(tmp_path, delay_s):
    folder = tmp_path / "run"
    folder.mkdir(mode=0o700)
    host = start_anew(CONFIGS / "mock.toml", folder, "--for", "60")
    try:
        loop = until(lambda: children(host.pid), "the loop")[0]
        time.sleep(delay_s)
        host.send_signal(signal.SIGKILL)
        host.wait(PATIENCE_S)
        until(lambda: not Path(f"/proc/{loop}").exists(), "the end of the orphan")
        RuntimeDirectory.acquire("mock", folder).release()
    finally:
        host.kill()
        host.communicate()


@pytest.mark.compiled
def test_of_two_that_start_at_once_one_runs_and_the_other_is_refused(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir(mode=0o700)
    both = [start_anew(CONFIGS / "mock.toml", folder) for _ in range(2)]
    refused = until(lambda: next((one for one in both if one.poll() is not None), None), "the refusal")
    code, said, _ = finish(refused)
    assert (code, said["error"]) == (BusyError.exit_code, "BusyError")
    other = both[1 - both.index(refused)]
    until(lambda: len(children(other.pid)) == 1, "the other's loop")
    with RigClient("mock", runtime_dir=folder, timeout_s=PATIENCE_S) as client:
        until(lambda: client.status()["state"] == "IDLE")
    other.send_signal(signal.SIGTERM)
    code, summary, err = finish(other)
    assert (code, summary["state"]) == (0, "SHUTDOWN"), err


def gone(pid):
    return not Path(f"/proc/{pid}").exists()


def test_a_loop_that_is_not_told_to_begin_ends_with_who_waits_for_it():
    with WaitingLoop() as waiting:
        waiting.prepare(order_of(load(CONFIGS / "mock.toml")))
        assert not gone(waiting.process.pid)
    assert gone(waiting.process.pid)
    waiting.close()


def test_a_loop_prepares_for_one_rig_only():
    one, another = (order_of(load(CONFIGS / name)) for name in ("mock.toml", "mock-2axis.toml"))
    with WaitingLoop() as waiting:
        waiting.prepare(one)
        waiting.prepare(one)
        with pytest.raises(ValueError, match="another rig"):
            waiting.prepare(another)


def test_what_comes_as_one_is_two_lines_and_no_descriptor_is_lost():
    """The kernel hands out two messages as one where both are there."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        ours.sendall(b"{}\n")
        socket.send_fds(ours, [b"\n"], [ours.fileno(), theirs.fileno()])
        ours.shutdown(socket.SHUT_WR)
        told = list(_told(theirs))
    assert [text for text, _ in told] == [b"{}", b""]
    descriptors = told[-1][1]
    assert len(descriptors) == 2
    for descriptor in descriptors:
        os.close(descriptor)


@pytest.mark.parametrize("text", [b"", b'{"rig"', b"{}"], ids=["nothing", "half a line", "no line's end"])
def test_what_is_not_a_whole_line_is_no_order(text):
    ours, theirs = socket.socketpair()
    with theirs:
        with ours:
            ours.sendall(text)
        assert list(_told(theirs)) == []


def test_a_loop_that_died_while_it_waited_is_told_as_any_other():
    memory = Memory.create(1, 64, 1_000_000)
    with WaitingLoop() as waiting:
        waiting.process.kill()
        waiting.process.wait()
        loop = LoopProcess(load(CONFIGS / "mock.toml"), memory, waiting=waiting)
    try:
        assert not loop.poll()
        with pytest.raises(LoopDiedError, match="without a word"):
            loop.raise_if_failed()
    finally:
        loop.close()
        memory.close()


def test_what_a_loop_is_told_is_the_rig():
    order = json.loads(order_of(load(CONFIGS / "mock-2axis.toml")))
    assert order["rig"]["n_axes"] == 2
    assert [device["kind"] for device in order["devices"]] == ["mock"]
