"""`view = true`: the page of a running daemon; it dies, comes back, and the rig does not notice."""

import contextlib
import http.client
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from click.testing import CliRunner
from nursery import Program
from patience import PATIENCE_S, until
from ports import free_ports
from standstill import patient_clients

from rtctl.cli import cli
from rtctl.client import RigClient

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture
def port():
    return free_ports()


@contextlib.contextmanager
def running(tmp_path, port):
    """A daemon with its page: process, runtime folder."""
    folder = tmp_path / "r"
    folder.mkdir(mode=0o700)
    text = (CONFIGS / "mock.toml").read_text().replace('"friction/', f'"{CONFIGS}/friction/')
    config = tmp_path / "rig.toml"
    config.write_text(f"{text}\n[view]\nport = {port}\n")
    command = [
        sys.executable,
        "-m",
        "rtctl",
        "run",
        str(config),
        "--runtime-dir",
        str(folder),
        "--for",
        "150",
    ]
    process = Program(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        yield process, folder
    finally:
        if process.poll() is None:
            process.terminate()
        process.communicate(timeout=PATIENCE_S)


@pytest.fixture
def rig(tmp_path, port):
    with running(tmp_path, port) as made:
        yield made


def page(port, path="/"):
    """Status of the page, once somebody answers."""
    end = time.monotonic() + PATIENCE_S
    while True:
        link = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
        try:
            link.request("GET", path)
            answer = link.getresponse()
            return answer.status, answer.read()
        except ConnectionError:
            assert time.monotonic() < end, "the page never came"
            time.sleep(0.02)
        finally:
            link.close()


def children(pid):
    """Process ids by command line, of the children of `pid`."""
    out = {}
    for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
        with contextlib.suppress(OSError):  # it has just ended
            out[Path(f"/proc/{child}/cmdline").read_text().replace("\0", " ")] = int(child)
    return out


def view_of(pid):
    return until(lambda: next((c for line, c in children(pid).items() if "rtctl.client.view" in line), None))


def is_gone(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] in "ZX"
    except OSError:
        return True


def test_the_page_comes_with_the_rig_comes_back_when_it_dies_and_goes_with_it(rig, port):
    process, folder = rig
    with RigClient("mock", runtime_dir=str(folder), timeout_s=PATIENCE_S) as client:
        client.hello()
        assert page(port)[0] == 200
        with patient_clients():
            asked = ["view", "mock", "--runtime-dir", str(folder)]
            told = CliRunner().invoke(cli, asked, catch_exceptions=False)
        assert (folder / "mock/view").read_text().strip() in told.output
        first = view_of(process.pid)
        os.kill(first, signal.SIGKILL)
        until(
            lambda: [
                c for line, c in children(process.pid).items() if "rtctl.client.view" in line and c != first
            ]
        )
        assert page(port)[0] == 200
        assert client.latest_state().faults == ()
    process.send_signal(signal.SIGTERM)
    said = process.communicate(timeout=PATIENCE_S)[0]
    assert process.returncode == 0, said
    assert f"live view http://127.0.0.1:{port}/" in said
    assert "the live view ended with status -9" in said
    assert "#key=" not in said
    assert not (folder / "mock/view").exists()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port), timeout=1).close()


def test_a_port_in_use_is_told_and_the_rig_runs(tmp_path, port):
    with socket.create_server(("127.0.0.1", port)), running(tmp_path, port) as (process, folder):
        for line in process.stdout:
            if "the live view" in line:
                break
        assert (
            "Address already in use; what answers there is not this rig: give it another [view] port" in line
        )
        with RigClient("mock", runtime_dir=str(folder), timeout_s=PATIENCE_S) as client:
            assert client.hello()["rig"] == "mock"


def test_a_killed_daemon_takes_its_view_along(rig, port):
    process, _folder = rig
    assert page(port)[0] == 200
    view = view_of(process.pid)
    process.kill()
    until(lambda: is_gone(view), "the end of the view")
