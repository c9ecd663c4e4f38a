"""`rtctl monitor` as a program."""

import json
import os
import signal
import subprocess
import sys

from fake_rig import FakeRig
from nursery import Program
from patience import PATIENCE_S, until


def monitor(root, *options, **more):
    command = [sys.executable, "-m", "rtctl", "monitor", "--runtime-dir", str(root), *options]
    return Program(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **more)


def test_monitor_writes_one_json_object_per_sample(root):
    with FakeRig(root):

        def samples_of_two_seconds():
            """None where this machine stood still for most of them."""
            process = monitor(root, "--json", "--for", "2")
            out, err = process.communicate(timeout=PATIENCE_S)
            told = [json.loads(line) for line in out.splitlines()]
            stood_still = process.returncode == 12 or any("no_data_s" in one for one in told)
            assert process.returncode == 0 or stood_still, err
            return None if stood_still else told

        samples = until(samples_of_two_seconds, "two seconds without a standstill", 4 * PATIENCE_S)
    assert len(samples) > 5
    assert samples[0]["state"] == "IDLE"
    assert samples[0]["temperature_c"] == [None]


def test_monitor_shows_lines_and_ctrl_c_ends_it_cleanly(root):
    with FakeRig(root):
        process = monitor(root, "mock")
        assert any("IDLE" in line for line in process.stdout)
        os.kill(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, err.strip()) == (0, "")


def test_monitor_without_a_daemon_is_one_clear_line(root):
    process = monitor(root)
    out, err = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, out) == (12, "")
    assert err.count("\n") == 1
    assert "rtctl run" in err
