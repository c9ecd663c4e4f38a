"""Clients whose stack nobody here wrote, from docs/protocol.md alone: Node.js and C++, by ipc and by TCP with
a key.
"""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from patience import until
from ports import free_ports
from standstill import OF_THIS_MACHINE, TRIES, stopped_by

from rtctl.client import RigClient, State
from rtctl.wire.keys import KeyStore

pytestmark = [pytest.mark.system, pytest.mark.timeout(600)]

CLIENTS = Path(__file__).parent / "clients"
CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture(scope="module")
def daemon():
    """The mock rig with a hand that rests, reached by ipc and TCP: runtime folder, TCP address, keys by role.

    At 200 Hz: the clients of a busy machine may be silent for half a second.
    """
    with tempfile.TemporaryDirectory(prefix="rt") as name:
        folder, port = Path(name), free_ports(3)
        store = KeyStore(folder / "keys")
        keys = {role: store.new(role, role, folder / f"{role}.key") for role in ("operator", "observer")}
        text = (CONFIGS / "mock.toml").read_text().replace("amplitude_rad = 0.3", "amplitude_rad = 0.0")
        text = text.replace('"friction/', f'"{CONFIGS}/friction/')
        for shipped, here in (("rate_hz = 1000.0", "rate_hz = 200.0"), ("_rad = 60.0", "_rad = 12.0")):
            assert text.count(shipped) == 1
            text = text.replace(shipped, here)
        text += f'\n[gateway]\nbind = "127.0.0.1"\nport = {port}\ncurve_dir = "keys"\n'
        (folder / "rig.toml").write_text(text)
        command = [sys.executable, "-m", "rtctl", "run", "rig.toml", "--runtime-dir", name, "--for", "500"]
        process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            with RigClient("mock", runtime_dir=folder, timeout_s=120.0) as rig:
                rig.hello()
                yield folder, f"127.0.0.1:{port}", keys, rig
        finally:
            process.terminate()
            process.wait(60)


@pytest.fixture(scope="module")
def node(tmp_path_factory):
    """Command of the Node.js client, its two packages installed as locked."""
    if not (shutil.which("node") and shutil.which("npm")):
        pytest.skip("needs Node.js: apt-get install nodejs npm")
    folder = tmp_path_factory.mktemp("node")
    for file in (CLIENTS / "node").iterdir():
        if file.is_file():
            shutil.copy(file, folder)
    install = ["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"]
    done = subprocess.run(install, cwd=folder, capture_output=True, text=True, check=False, timeout=300)
    if done.returncode != 0:
        pytest.skip(f"npm cannot install the packages: {done.stderr.strip()[-300:]}")
    return ["node", str(folder / "renderer.mjs")]


@pytest.fixture(scope="module")
def cpp(tmp_path_factory):
    """Command of the C++ client, compiled without a warning."""
    if not (
        shutil.which("g++")
        and Path("/usr/include/zmq.h").exists()
        and Path("/usr/include/msgpack.h").exists()
    ):
        pytest.skip("needs a compiler and libraries: apt-get install g++ libzmq3-dev libmsgpack-dev")
    program = tmp_path_factory.mktemp("cpp") / "renderer"
    flags = ["-std=c++17", "-O2", "-Wall", "-Wextra", "-Werror"]
    source = str(CLIENTS / "cpp" / "renderer.cpp")
    subprocess.run(
        ["g++", *flags, source, "-o", str(program), "-lzmq", "-lmsgpackc"], check=True, timeout=300
    )
    return [str(program)]


@pytest.fixture(params=["node", "cpp"])
def client(request):
    return request.getfixturevalue(request.param)


def run(command, *more):
    return subprocess.run([*command, *more], capture_output=True, text=True, check=False, timeout=280)


def run_in_time(rig, command, *more):
    """The client's run; another one where this machine stood still for longer than a renderer may be
    silent.
    """
    for _ in range(TRIES):
        with rig.events() as events:
            done = run(command, *more)
            if done.returncode == 0 or not stopped_by(rig, events) <= OF_THIS_MACHINE:
                break
    return done


@pytest.mark.parametrize("way", ["ipc", "tcp"])
def test_it_subscribes_holds_the_lease_moves_the_joint_and_stops(daemon, client, way):
    folder, address, keys, rig = daemon
    where = [str(folder / "mock")] if way == "ipc" else [address, str(keys["operator"])]
    done = run_in_time(rig, client, way, *where)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["role"] == "operator"
    assert told["moved_rad"] > 0.015
    assert told["samples"] > 20
    assert told["gaps"] == 0
    until(lambda: rig.status()["state"] != "STOPPING", "the end of the ramp")
    status = rig.status()
    assert (status["state"], status["fault_first"], status["lease_holder"]) == ("IDLE", None, None)


def test_an_observer_is_told_that_it_may_not(daemon, client):
    _folder, address, keys, rig = daemon
    done = run(client, "tcp", address, str(keys["observer"]))
    assert done.returncode == 1
    assert "forbidden" in done.stderr
    assert rig.latest_state().state == State.IDLE
